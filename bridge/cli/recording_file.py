"""Recordings as files that other programs read: traces by python-can's writers, and JSON lines."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import can

from bridge.base.errors import OperationFailed
from bridge.can.pythoncan import message_of
from bridge.recorder.recording import SUFFIX, Segment
from bridge.recorder.told import frames_of, lines_of

_LINES: Final = ".jsonl"
_TRACES: Final[dict[str, Callable[[Path], Any]]] = {
    ".log": can.CanutilsLogWriter,
    ".asc": can.ASCWriter,
    ".blf": can.BLFWriter,
}
SUFFIXES: Final = (SUFFIX, *_TRACES, _LINES)


def write_as(segments: list[Segment], target: Path) -> int:
    """Write a recording in the format that the suffix of ``target`` tells; returns the number of frames or
    lines. Raises ``OperationFailed``."""
    try:
        if target.suffix == _LINES:
            return _write_lines(segments, target)
        return _write_trace(segments, target)
    except OSError as error:
        raise OperationFailed(f"{target} cannot be written: {error.strerror}") from None


def _write_lines(segments: list[Segment], target: Path) -> int:
    number = 0
    with target.open("w", encoding="utf-8") as file:
        for line in lines_of(segments):
            file.write(json.dumps(line) + "\n")
            number += 1
    return number


def _write_trace(segments: list[Segment], target: Path) -> int:
    # The bridge takes frames in, and then says what it sends: by time they are in order.
    frames = sorted(frames_of(segments), key=lambda one: one.frame.time)
    with _TRACES[target.suffix](target) as writer:
        for one in frames:
            writer(message_of(one.frame, one.frame.time, one.bus, is_rx=not one.is_ours))
    return len(frames)
