"""Captures of a bus as files that other tools read: candump's and ASC, with times by the wall clock."""

from __future__ import annotations

import io
from itertools import pairwise

import can
import pytest

from bridge.canopen.frame import EXTENDED, REMOTE, Frame
from bridge.service.page.capture import CaptureFile

NOON_NS = 1_795_262_400_000_000_000
FRAMES = [
    Frame(0x185, b"\1\2", 10.5),
    Frame(0x705 | REMOTE, b"\0", 10.6),
    Frame(0x1234567 | EXTENDED, bytes(8), 10.7),
]


def captured(form: str, *frames: Frame) -> bytes:
    file = CaptureFile("can0", form, lambda at: NOON_NS + round((at - 10.0) * 1e9))
    file.add(frames)
    assert file.frames == len(frames)
    return file.content()


def test_candump_s_lines() -> None:
    assert captured("candump", *FRAMES).decode().splitlines() == [
        "(1795262400.500000) can0 185#0102 R",
        "(1795262400.600000) can0 705#R R",
        "(1795262400.700000) can0 01234567#0000000000000000 R",
    ]


@pytest.mark.parametrize(("form", "reader"), [("candump", can.CanutilsLogReader), ("asc", can.ASCReader)])
def test_what_is_written_is_read_by_python_can(form: str, reader: type) -> None:
    text = io.StringIO(captured(form, *FRAMES).decode())
    found = list(reader(text))
    assert [
        (one.arbitration_id, one.is_extended_id, one.is_remote_frame, bytes(one.data or b"")) for one in found
    ] == [
        (0x185, False, False, b"\1\2"),
        (0x705, False, True, b""),
        (0x1234567, True, False, bytes(8)),
    ]
    gaps = [after.timestamp - before.timestamp for before, after in pairwise(found)]
    assert gaps == pytest.approx([0.1, 0.1], abs=1e-3)


def test_of_a_silent_bus_a_file_has_no_frames() -> None:
    assert captured("candump") == b""
