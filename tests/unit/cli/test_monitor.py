"""Lines of the monitor: a frame with its time, what it is for, and nothing that a terminal obeys."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.bustools.decode import FrameKind, FrameMeaning
from bridge.canopen.frame import EXTENDED, REMOTE, Frame
from bridge.cli.monitor import Record, for_people

SAID = FrameMeaning(next(iter(FrameKind)), 5, "TPDO1 conveyor", "ready")


@pytest.mark.parametrize(
    ("frame", "line"),
    [
        (
            Frame(0x185, b"\x31\x02"),
            "    1.500000  185  31 02                    TPDO1 conveyor          ready",
        ),
        (
            Frame(0x705 | REMOTE, b"\0"),
            "    1.500000  705  remote                   TPDO1 conveyor          ready",
        ),
        (
            Frame(0x1234567 | EXTENDED),
            "    1.500000  01234567                           TPDO1 conveyor          ready",
        ),
    ],
)
def test_a_frame_has_its_columns(frame: Frame, line: str) -> None:
    assert for_people(frame, SAID, 1.5) == line


def test_what_others_say_is_escaped_and_no_blank_stands_at_the_end() -> None:
    said = FrameMeaning(SAID.kind, 5, "a\x1b[31m", "")
    line = for_people(Frame(0x185), said, 1.5)
    assert "\x1b" not in line
    assert line == line.rstrip()


def test_a_record_is_as_candump_writes_it(tmp_path: Path) -> None:
    path = tmp_path / "trace.log"
    with Record(path, is_recorded=True) as record:
        record.write("can0", Frame(0x185, b"\x31\x02", 1.5))
        record.write("can0", Frame(0x705 | REMOTE, b"\0", 2.5))
    assert path.read_text() == "(1.500000) can0 185#3102\n(2.500000) can0 705#R1\n"
