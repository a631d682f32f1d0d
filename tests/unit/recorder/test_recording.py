"""Files of recordings: what is whole is read, and what is not is said."""

from __future__ import annotations

import zlib
from pathlib import Path

import msgspec
import pytest

from bridge.base.errors import OperationFailed
from bridge.recorder.recording import (
    MAGIC,
    Header,
    State,
    header_chunk,
    notes_of,
    read,
    state_chunk,
    turns_chunk,
)

HEADER = Header(version="1", site="hall", buses=("can0",), number=3, began=12.5, epoch_ns=10**18)
STATE = State("code", 7, {"can0": [1, 2]}, b"core")
TURNS = [msgspec.msgpack.encode(["take_in", [], 12.6]), msgspec.msgpack.encode(["pump", []])]
WHOLE = header_chunk(HEADER) + state_chunk(STATE) + turns_chunk(TURNS)


def file_with(folder: Path, content: bytes) -> Path:
    path = folder / "x.recording"
    path.write_bytes(content)
    return path


def test_what_was_written_is_read(tmp_path: Path) -> None:
    other = msgspec.structs.replace(HEADER, number=4)
    segments = read(file_with(tmp_path, MAGIC + WHOLE + header_chunk(other) + turns_chunk(TURNS)))
    assert [segment.header for segment in segments] == [HEADER, other]
    assert [segment.state for segment in segments] == [STATE, None]
    assert [segment.turns for segment in segments] == [TURNS, TURNS]


@pytest.mark.parametrize("cut", range(1, len(turns_chunk(TURNS))))
def test_what_was_cut_off_at_the_end_is_left_out(tmp_path: Path, cut: int) -> None:
    [segment] = read(file_with(tmp_path, (MAGIC + WHOLE)[:-cut]))
    assert segment.state == STATE
    assert segment.turns == []


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"", "is no recording"),
        (b"(1.0) can0 705#05\n", "is no recording"),
        (MAGIC + b"H\0\0\0\2ab", "is damaged"),
        (MAGIC + b"H\xff\xff\xff\xff", "is damaged"),
        (MAGIC + b"H" + len(zlib.compress(b"{}")).to_bytes(4, "big") + zlib.compress(b"{}"), "is damaged"),
    ],
)
def test_what_is_no_recording_is_named(tmp_path: Path, content: bytes, says: str) -> None:
    with pytest.raises(OperationFailed, match=says):
        read(file_with(tmp_path, content))


def test_a_file_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(OperationFailed, match="No such file"):
        read(tmp_path / "y.recording")


@pytest.mark.parametrize(
    "turn", [b"", b"\xc1", msgspec.msgpack.encode({"a": 1}), msgspec.msgpack.encode(["x"])]
)
def test_a_turn_that_is_none_is_named(turn: bytes) -> None:
    with pytest.raises(OperationFailed, match="turn"):
        notes_of(turn)
