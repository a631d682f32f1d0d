"""Boot-up after CiA 302-2, on a virtual clock with a simulated SK TU4-CAO."""

from __future__ import annotations

import struct
from pathlib import Path

import pytest

from bridge.canopen import abort
from bridge.canopen.frame import Frame
from bridge.canopen.sdo import SdoError
from bridge.command.link import NodeState
from bridge.config.download import Download
from bridge.image import Quality
from bridge.node.boot.actions import BootResult, Read, Step, Write
from bridge.node.boot.configuration import configuration_stamp, configure
from bridge.node.boot.status import HINTS, TEXTS, BootError
from tests.support.bench import BEGIN_S, Bench, write_site

REQUEST = 0x605
START = Frame(0, b"\x01\x05")


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


def was_started(bench: Bench) -> bool:
    return START in [frame._replace(time=0.0) for frame in bench.log]


def test_every_letter_of_the_standard_has_its_text() -> None:
    assert "".join(sorted(TEXTS)) == "ABCDEFGHIJKLMNO"
    assert HINTS.keys() <= TEXTS.keys()


# identity


@pytest.mark.parametrize(
    ("rule", "letter", "where"),
    [
        ("device_type = 0x00020192", "C", "1000h:00"),
        ("vendor_id = 0xB9", "D", "1018h:01"),
        ("product_code = 0x0BADBEEF", "M", "1018h:02"),
        ("revision = 0x0BADBEEF", "N", "1018h:03"),
        ("serial = 0x0BADBEEF", "O", "1018h:04"),
    ],
)
def test_another_device_is_named_with_letter_object_expected_and_read(
    tmp_path: Path, rule: str, letter: str, where: str
) -> None:
    bench = booted(tmp_path, node=f"[bus.node.identity]\n{rule}")
    assert status(bench).startswith(f"{letter}: {where} is ")
    assert "expected" in status(bench)
    assert HINTS[letter] in status(bench)
    assert bench.plant.drives["conveyor/fu1"].quality is Quality.CONFIG_ERROR
    assert not was_started(bench)


def test_a_mask_leaves_out_what_may_differ(tmp_path: Path) -> None:
    """STÖBER's product code is the rated power: only some of its bits say which device it is."""
    rule = "[bus.node.identity]\nproduct_code = 0x0BADBE00\nproduct_code_mask = 0"
    assert status(booted(tmp_path, node=rule)).startswith("ok")


def test_name_and_software_version_are_shown(tmp_path: Path) -> None:
    bench = booted(tmp_path)
    assert bench.value("conveyor/fu1/identity/device_name") == "SK TU4-CAO"
    assert bench.value("conveyor/node/software_version") != ""


def test_a_node_that_does_not_answer_is_b_and_says_what_to_look_at(tmp_path: Path) -> None:
    bench = Bench(write_site(tmp_path), present=False)
    bench.run(3.0)
    assert status(bench).startswith("B: 1000h:00: no valid answer")
    assert HINTS["B"] in status(bench)


# configuration

P151 = """
[[bus.node.configure]]
object = "2097:01"
type = "uint16"
value = 500
"""
P151_IS_500 = bytes.fromhex("2B972001F4010000")


def test_the_configuration_is_written_once_and_read_back(tmp_path: Path) -> None:
    """BU 2500 §7.1.1: P151 is 2097h:1."""
    bench = booted(tmp_path, node=P151)
    assert P151_IS_500 in written(bench)
    assert "1 of 1 objects of the configuration were written" in status(bench)
    bench.log.clear()
    bench.node.power_cycle()
    bench.run(2.0)
    assert status(bench).startswith("ok")
    before_start = written(bench)
    assert before_start.count(P151_IS_500) <= 1


def test_what_the_node_has_already_is_not_written(tmp_path: Path) -> None:
    bench = Bench(write_site(tmp_path, node=P151))
    bench.node.on_frame(Frame(REQUEST, P151_IS_500), bench.now)
    bench.run(1.5)
    assert P151_IS_500 not in written(bench)
    assert status(bench).startswith("ok")


def test_a_value_that_the_node_refuses_is_j_with_object_and_value(tmp_path: Path) -> None:
    wrong = P151.replace("2097:01", "2FFF:01")
    bench = booted(tmp_path, node=wrong)
    assert status(bench).startswith("J: 2FFFh:01: the node aborted: ")
    assert "01F4h" in status(bench)
    assert not was_started(bench)
    assert bench.plant.drives["conveyor/fu1"].quality is Quality.CONFIG_ERROR


class Device:
    """Answers a boot-up generator as a node with these objects would."""

    def __init__(self, objects: dict[tuple[int, int], bytes], *, deaf: bool = False) -> None:
        self.objects = objects
        self.deaf = deaf
        self.writes: list[tuple[int, int, bytes]] = []

    def configure(self, *downloads: Download, store: bool = False) -> BootResult:
        result = BootResult()
        steps = configure(downloads, store=store, result=result)
        answer: bytes | SdoError | None = None
        while True:
            try:
                action = steps.throw(answer) if isinstance(answer, SdoError) else steps.send(answer)
            except StopIteration:
                return result
            answer = None if isinstance(action, Step) else self._answer(action)

    def _answer(self, action: object) -> bytes | SdoError:
        if isinstance(action, Write):
            self.writes.append((action.index, action.sub, action.data))
            if not self.deaf:
                self.objects[action.index, action.sub] = action.data
            return b""
        assert isinstance(action, Read)
        found = self.objects.get((action.index, action.sub))
        return SdoError(action.index, action.sub, 0x06020000, by_server=True) if found is None else found


SPEED = Download(0x2401, 0, struct.pack("<I", 2500))


def test_a_node_that_has_our_configuration_date_is_left_alone() -> None:
    """STÖBER, §9: 1020h (A211/A212)."""
    device = Device({(0x1020, 1): bytes(4), (0x1020, 2): bytes(4), (0x2401, 0): bytes(4)})
    device.configure(SPEED, store=True)
    days, at_ms = configuration_stamp((SPEED,))
    assert device.writes == [
        (0x2401, 0, SPEED.data),
        (0x1020, 1, struct.pack("<I", days)),
        (0x1020, 2, struct.pack("<I", at_ms)),
        (0x1010, 1, b"save"),
    ]
    device.writes.clear()
    notes = device.configure(SPEED, store=True).notes
    assert device.writes == []
    assert notes == ["the node has this configuration already (1020h)"]


def test_another_configuration_has_another_date() -> None:
    other = Download(0x2401, 0, struct.pack("<I", 2501))
    assert configuration_stamp((SPEED,)) != configuration_stamp((other,))
    days, at_ms = configuration_stamp((SPEED,))
    assert 1 <= days <= 0xFFFF
    assert 0 <= at_ms < 86_400_000


def test_a_date_that_the_file_brings_is_taken() -> None:
    dated = (SPEED, Download(0x1020, 1, b"\x10\x27\0\0"), Download(0x1020, 2, b"\x01\0\0\0"))
    assert configuration_stamp(dated) == (10_000, 1)


def test_a_node_that_does_not_keep_a_value_is_named_with_both() -> None:
    device = Device({(0x2401, 0): struct.pack("<I", 7)}, deaf=True)
    with pytest.raises(BootError, match="J: 2401h:00 is 00000007h after 000009C4h was written"):
        device.configure(SPEED)


def test_a_command_is_written_blindly() -> None:
    device = Device({})
    device.configure(Download(0x1011, 1, b"load", read_back=False))
    assert device.writes == [(0x1011, 1, b"load")]


def test_a_mapping_from_a_dcf_is_written_with_the_pdo_off_and_sub_0_last() -> None:
    """CiA 301 §7.5.2.36."""
    device = Device(
        {
            (0x1800, 1): struct.pack("<I", 0x4000_0185),
            (0x1800, 2): b"\xff",
            (0x1A00, 0): b"\x01",
            (0x1A00, 1): struct.pack("<I", 0x30010110),
        }
    )
    device.configure(
        Download(0x1800, 2, b"\x01"),
        Download(0x1A00, 1, struct.pack("<I", 0x30030110)),
        Download(0x1A00, 2, struct.pack("<I", 0x30030210)),
        Download(0x1A00, 0, b"\x02"),
    )
    assert [(index, sub, int.from_bytes(data, "little")) for index, sub, data in device.writes] == [
        (0x1800, 1, 0xC000_0185),
        (0x1A00, 0, 0),
        (0x1A00, 1, 0x30030110),
        (0x1A00, 2, 0x30030210),
        (0x1A00, 0, 2),
        (0x1800, 2, 1),
        (0x1800, 1, 0x4000_0185),
    ]


# PDOs

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


# error control


def test_the_node_is_heard_before_it_is_started(tmp_path: Path) -> None:
    bench = booted(tmp_path)
    start = next(place for place, frame in enumerate(bench.log) if frame._replace(time=0.0) == START)
    assert any(frame.can_id == 0x705 and frame.data == b"\x7f" for frame in bench.log[:start])


def test_a_node_whose_heartbeat_does_not_come_is_k(tmp_path: Path) -> None:
    bench = Bench(write_site(tmp_path))
    bench.deaf_to = frozenset((0x705,))
    bench.run(2.5)
    assert status(bench).startswith("K: nothing was heard while waiting for heartbeat")
    assert not was_started(bench)


@pytest.mark.parametrize("answers", range(1, 30, 4))
def test_a_time_out_has_the_letter_of_its_step_and_the_node_is_lost(tmp_path: Path, answers: int) -> None:
    bench = Bench(write_site(tmp_path))
    receive, left = bench.receive, answers

    def receive_some(*frames: Frame) -> None:
        nonlocal left
        for frame in frames:
            left -= frame.can_id == 0x585
            if left >= 0:
                receive(frame)

    bench.receive = receive_some
    while not bench.network.nodes[0].has_concluded:
        bench.run(0.1)
    assert bench.now < BEGIN_S + 5.0, "not every object that nothing needs is waited for"
    assert status(bench)[:3] in ("D: ", "M: ", "N: ", "O: ", "J: ")
    assert abort.text(abort.TIMED_OUT) in status(bench)
    assert bench.network.nodes[0].state is NodeState.LOST
    assert not was_started(bench)
