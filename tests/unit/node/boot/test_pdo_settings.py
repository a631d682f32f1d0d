"""PDO settings at boot-up: off, set, on again (CiA 301 §7.5.2.35), and only where they differ."""

from __future__ import annotations

import struct
from pathlib import Path

from bridge.canopen.frame import Frame
from bridge.command.drive_link import NodeState
from bridge.image import Quality
from tests.support.bench import Bench, write_site

REQUEST = 0x605


def booted(tmp_path: Path, *, node: str = "", drive: str = "", bus: str = "") -> Bench:
    bench = Bench(write_site(tmp_path, node=node, drive=drive, bus=bus))
    bench.run(1.5)
    return bench


def status(bench: Bench) -> str:
    return str(bench.value("conveyor/node/boot_status"))


def written(bench: Bench) -> list[bytes]:
    """Every expedited write to the node, in order: index, sub-index, bytes."""
    return [frame.data for frame in bench.sent(REQUEST) if frame.data[0] & 0xE3 == 0x23]


def writes_of(bench: Bench, index: int) -> list[tuple[int, int]]:
    """Sub-index and value of each write to this object."""
    found: list[tuple[int, int]] = []
    for data in written(bench):
        at, sub, value = struct.unpack_from("<HBI", data, 1)
        if at == index:
            found.append((sub, value))
    return found


SYNCHRONOUS = "tpdo = { transmission_type = 1 }\nrpdo = { transmission_type = 1 }"


def test_a_pdo_is_switched_off_set_and_switched_on_again(tmp_path: Path) -> None:
    bench = booted(tmp_path, drive=SYNCHRONOUS)
    assert status(bench).startswith("ok")
    assert writes_of(bench, 0x1800) == [(1, 0xC0000185), (2, 1), (1, 0x40000185)]
    assert writes_of(bench, 0x1400) == [(1, 0xC0000205), (2, 1), (1, 0x40000205)]
    assert bench.plant.drives["conveyor/fu1"].quality is Quality.GOOD
    assert not writes_of(bench, 0x1801), "nobody asked for it"


def test_a_pdo_that_is_as_wanted_is_not_touched(tmp_path: Path) -> None:
    bench = booted(tmp_path, drive="tpdo = { transmission_type = 255, event_ms = 250, inhibit_ms = 10.0 }")
    assert status(bench).startswith("ok")
    assert not writes_of(bench, 0x1800)


def test_a_pdo_that_is_off_is_switched_on_where_the_site_file_asks_for_it(tmp_path: Path) -> None:
    """BU 2500 §6.4: bit 31 of 1800h:1."""
    bench = Bench(write_site(tmp_path, drive="tpdo = { event_ms = 100 }"))
    bench.node.on_frame(Frame(REQUEST, bytes.fromhex("23001801850100C0")), bench.now)
    bench.run(1.5)
    assert writes_of(bench, 0x1800) == [(5, 100), (1, 0x40000185)]
    assert bench.plant.drives["conveyor/fu1"].quality is Quality.GOOD


def test_a_pdo_that_is_off_is_the_drives_problem_where_nobody_asks_for_it(tmp_path: Path) -> None:
    bench = Bench(write_site(tmp_path))
    bench.node.on_frame(Frame(REQUEST, bytes.fromhex("23001801850100C0")), bench.now)
    bench.run(1.5)
    assert status(bench).startswith("J: conveyor/fu1")
    assert "1800h:01: the PDO is switched off" in status(bench)
    assert bench.plant.drives["conveyor/fu1"].quality is Quality.CONFIG_ERROR
    assert bench.plant.drives["conveyor/fu2"].quality is Quality.GOOD


def test_another_mapping_is_written_only_where_it_differs(tmp_path: Path) -> None:
    """BU 2500 §6.4: sub 0 := 0, the entries, sub 0 := n; still four words."""
    mapping = 'tpdo = { mapping = ["3001:01/16", "3003:02/16", "3003:01/16", "3003:03/16"] }'
    bench = booted(tmp_path, drive=mapping)
    entries = [0x30010110, 0x30030210, 0x30030110, 0x30030310]
    assert writes_of(bench, 0x1A00) == [(0, 0), *enumerate(entries, 1), (0, 4)]
    assert status(bench).startswith("ok")


def test_a_refused_pdo_setting_names_object_and_value(tmp_path: Path) -> None:
    bench = booted(tmp_path, drive="tpdo = { transmission_type = 245 }")
    assert "J: 1800h:02: the node aborted" in status(bench)
    assert "F5h" in status(bench)
    assert bench.network.nodes[0].state is NodeState.OPERATIONAL, "its other drives work"
