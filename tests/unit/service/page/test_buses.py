"""The buses of a site for the page: the layout of PDOs, what frames say, and files of them."""

from __future__ import annotations

import io
from itertools import pairwise
from pathlib import Path
from typing import Any

import can
import pytest

from bridge.base.errors import OperationFailed
from bridge.canopen.frame import EXTENDED, REMOTE, Frame
from bridge.project import load_project
from bridge.service.page.buses import Buses
from bridge.service.page.capture import CaptureFile
from tests.support import sites

DEMO = Path("bridge/demo/site.toml")


def epoch_ns(at: float) -> int:
    return round((1_700_000_000 + at) * 1e9)


def buses(path: Path = DEMO) -> Buses:
    return Buses(load_project(path), epoch_ns)


def pdos(layouts: dict[str, Any], node: str) -> dict[str, Any]:
    (found,) = [one for one in layouts["can0"]["nodes"] if one["name"] == node]
    return {one["label"]: one for one in found["pdos"]}


def test_a_pdo_is_laid_out_by_bits_with_what_its_words_carry() -> None:
    found = pdos(buses().layouts(), "conveyor")
    rpdo = found["RPDO1 conveyor/fu1"]
    assert (rpdo["cob_id"], rpdo["bytes"]) == ("205", 8)
    assert [(part["name"], part["from"], part["bits"]) for part in rpdo["parts"]] == [
        ("control_word", 0, 16),
        ("setpoint_1", 16, 16),
        ("setpoint_2", 32, 16),
        ("setpoint_3", 48, 16),
    ]
    assert rpdo["parts"][1]["carries"] == ["frequency Hz"]


def test_no_two_parts_of_a_pdo_overlap_and_none_is_beyond_its_end() -> None:
    for bus in buses().layouts().values():
        for node in bus["nodes"]:
            assert node["pdos"]
            for pdo in node["pdos"]:
                end = 0
                for part in pdo["parts"]:
                    assert part["from"] >= end, pdo
                    assert part["bits"] > 0
                    end = part["from"] + part["bits"]
                assert end <= 8 * pdo["bytes"], pdo


FRAMES = [
    Frame(0x205, bytes.fromhex("7f04000000000000"), 1.25),
    Frame(0x80, b"", 1.5),
    Frame(0x705 | REMOTE, b"", 1.75),
    Frame(0x18FF1234 | EXTENDED, b"\x01\x02", 2.0),
]


@pytest.mark.parametrize(("form", "reader"), [("candump", can.CanutilsLogReader), ("asc", can.ASCReader)])
def test_what_was_captured_is_read_by_others(form: str, reader: Any) -> None:
    file = CaptureFile("can0", form, epoch_ns)
    file.add(FRAMES[:1])
    file.add(FRAMES[1:])
    assert file.frames == 4
    read = list(reader(io.StringIO(file.content().decode())))
    assert [one.arbitration_id for one in read] == [0x205, 0x80, 0x705, 0x18FF1234]
    assert [bytes(one.data) for one in read] == [frame.data for frame in FRAMES]
    assert [one.is_remote_frame for one in read] == [False, False, True, False]
    assert [one.is_extended_id for one in read] == [False, False, False, True]
    gaps = [later.timestamp - one.timestamp for one, later in pairwise(read)]
    assert gaps == pytest.approx([0.25, 0.25, 0.25], abs=1e-5)


async def waits() -> bool:
    return False


async def test_a_bus_that_nobody_drives_cannot_be_listened_to(tmp_path: Path) -> None:
    path = sites.write(tmp_path, sites.bus(sites.node(sites.drive("fu1", "lease", 1000))))
    ((name, bitrate, tap),) = buses(path).taps()
    assert (name, bitrate, tap.lost) == ("can0", 250_000, 0)
    with pytest.raises(OperationFailed, match="can0 cannot be listened to"):
        tap.open()
    assert tap.take() == []
    tap.close()
    with pytest.raises(OperationFailed, match="can0 cannot be listened to"):
        await buses(path).capture("can0", 1.0, "asc", waits)
