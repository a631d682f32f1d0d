"""The file of a recording: chunks, each with its kind, its length and its content, which is compressed.

A file begins with ``MAGIC``. It has one or more segments: a header, the checkpoint at its beginning, and
turns. What was cut off at the end of a file, because its writer ended, is left out.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO, Final

import msgspec

from bridge.base.errors import OperationFailed
from bridge.recorder.tape import Notes

MAGIC: Final = b"drivebridge recording 1\n"
SUFFIX: Final = ".recording"
_LONGEST: Final = 256 * 1024 * 1024
"""Longest content of a chunk, bytes."""
_LEVEL: Final = 1
_HEADER, _STATE, _TURNS = b"H", b"S", b"T"


class Header(msgspec.Struct, frozen=True, kw_only=True):
    """Beginning of a segment: ``began`` is in seconds of the monotonic clock, ``epoch_ns`` the wall clock
    then."""

    version: str
    site: str
    buses: tuple[str, ...]
    number: int
    began: float
    epoch_ns: int


class State(msgspec.Struct, frozen=True, array_like=True):
    """The checkpoint at the beginning of a segment. ``code`` is the fingerprint of the program that made it,
    ``buses`` the status of each by its name, and ``count`` the number of requests until then."""

    code: str
    count: int
    buses: dict[str, list[Any]]
    core: bytes


@dataclass(frozen=True, slots=True)
class Segment:
    """One segment of a recording."""

    header: Header
    state: State | None
    turns: list[bytes]
    """The notes of each turn, in MessagePack."""


def header_chunk(header: Header) -> bytes:
    return _chunk(_HEADER, msgspec.json.encode(header))


def state_chunk(state: State) -> bytes:
    return _chunk(_STATE, msgspec.msgpack.encode(state))


def turns_chunk(turns: list[bytes]) -> bytes:
    """Chunk with the notes of these turns."""
    parts: list[bytes] = []
    for notes in turns:
        parts += (len(notes).to_bytes(4, "big"), notes)
    return _chunk(_TURNS, b"".join(parts))


def _chunk(kind: bytes, content: bytes) -> bytes:
    packed = zlib.compress(content, _LEVEL)
    return kind + len(packed).to_bytes(4, "big") + packed


def notes_of(turn: bytes) -> Notes:
    """Raises ``OperationFailed`` for what are no notes."""
    try:
        notes = msgspec.msgpack.decode(turn, type=Notes)
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as error:
        raise OperationFailed(f"a turn that cannot be read: {error}") from None
    match notes:
        case [str(), list(), *_]:
            return notes
        case _:
            raise OperationFailed("a turn without kind and arguments")


def whole_chunks(file: BinaryIO) -> Iterator[bytes]:
    """The chunks of a part of a recording as they are, without one that is cut off at its end."""
    while len(start := file.read(5)) == 5:
        length = int.from_bytes(start[1:], "big")
        if length > _LONGEST or len(packed := file.read(length)) < length:
            return
        yield start + packed


def read(path: Path) -> list[Segment]:
    """The segments of a file. Raises ``OperationFailed`` for what is no recording."""
    try:
        with path.open("rb") as file:
            if file.read(len(MAGIC)) != MAGIC:
                raise OperationFailed(f"{path} is no recording of drivebridge")
            return list(_segments(file))
    except OSError as error:
        raise OperationFailed(f"{path}: {error.strerror}") from None
    except (msgspec.MsgspecError, zlib.error, UnicodeDecodeError) as error:
        raise OperationFailed(f"{path} is damaged: {error}") from None


def _segments(file: BinaryIO) -> Iterator[Segment]:
    header: Header | None = None
    state: State | None = None
    turns: list[bytes] = []
    for kind, content in _chunks(file):
        if kind == _HEADER:
            if header:
                yield Segment(header, state, turns)
            header, state, turns = msgspec.json.decode(content, type=Header), None, []
        elif kind == _STATE:
            state = msgspec.msgpack.decode(content, type=State)
        elif kind == _TURNS:
            turns += _turns(content)
    if header:
        yield Segment(header, state, turns)


def _chunks(file: BinaryIO) -> Iterator[tuple[bytes, bytes]]:
    while len(start := file.read(5)) == 5:
        length = int.from_bytes(start[1:], "big")
        if length > _LONGEST:
            raise zlib.error(f"a chunk of {length} bytes")
        packed = file.read(length)
        if len(packed) < length:
            return
        unpacked = zlib.decompressobj()
        content = unpacked.decompress(packed, _LONGEST)
        if unpacked.unconsumed_tail:
            raise zlib.error(f"a chunk of more than {_LONGEST} bytes")
        yield start[:1], content


def _turns(content: bytes) -> Iterator[bytes]:
    at = 0
    while at + 4 <= len(content):
        length = int.from_bytes(content[at : at + 4], "big")
        yield content[at + 4 : at + 4 + length]
        at += 4 + length
