"""A configuration to be downloaded to a node: from the site file, or a concise DCF (CiA 302-3)."""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

_HEAD: Final = struct.Struct("<HBI")
_COUNT: Final = struct.Struct("<I")

COMMANDS: Final = frozenset((0x1010, 0x1011))

INTEGERS: Final = {
    "bool": (1, False),
    "int8": (1, True),
    "int16": (2, True),
    "int32": (4, True),
    "int64": (8, True),
    "uint8": (1, False),
    "uint16": (2, False),
    "uint32": (4, False),
    "uint64": (8, False),
}
"""Size in bytes and sign of CiA 301's integers."""
REALS: Final = {"real32": "<f", "real64": "<d"}
"""Formats of CiA 301's floating point numbers."""


@dataclass(frozen=True, slots=True)
class Download:
    """One object and its bytes as they go over the wire.

    With ``read_back`` it is compared first, written where it differs and read back; without, it is written
    blindly, as a command is.
    """

    index: int
    sub: int
    data: bytes
    read_back: bool = True

    @property
    def is_command(self) -> bool:
        """Store or restore: these never read back what was written (CiA 301 §7.5.2.13–14)."""
        return self.index in COMMANDS

    @property
    def name(self) -> str:
        return f"{self.index:04X}h:{self.sub:02X}"


def encode(kind: str, value: bool | int | float | str) -> bytes:
    """``value`` as CiA 301 has it on the wire. Raises ValueError where it does not fit ``kind``."""
    if kind in INTEGERS:
        return _integer(kind, value)
    if kind in REALS:
        if isinstance(value, bool | str):
            raise ValueError(f"a {kind} is a number")
        try:
            return struct.pack(REALS[kind], value)
        except OverflowError:
            raise ValueError(f"{value} is too large for a {kind}") from None
    if not isinstance(value, str):
        raise ValueError(f"a {kind} is a text in quotes")
    encoders: dict[str, Callable[[str], bytes]] = {"string": _text, "bytes": bytes.fromhex}
    return encoders[kind](value)


def _text(value: str) -> bytes:
    try:
        return value.encode("latin-1")
    except UnicodeEncodeError:
        raise ValueError("a string has characters of ISO 8859-1 only") from None


def _integer(kind: str, value: bool | int | float | str) -> bytes:
    size, signed = INTEGERS[kind]
    if kind == "bool":
        if value not in (0, 1) or isinstance(value, float | str):
            raise ValueError("a bool is true or false")
        return bytes((int(value),))
    if isinstance(value, bool | float | str):
        raise ValueError(f"a {kind} is a whole number")
    try:
        return value.to_bytes(size, "little", signed=signed)
    except OverflowError:
        low, high = (-(1 << 8 * size - 1), (1 << 8 * size - 1) - 1) if signed else (0, (1 << 8 * size) - 1)
        raise ValueError(f"a {kind} is {low}…{high}") from None


def parse_concise_dcf(content: bytes) -> tuple[Download, ...]:
    """The objects of a concise DCF, 1F22h (CiA 302-3): count, then index, sub-index, size, data.

    Raises ValueError that names the entry where the stream is cut or says something impossible.
    """
    if len(content) < _COUNT.size:
        raise ValueError("is too short for a concise DCF: it begins with the number of entries")
    count = _COUNT.unpack_from(content)[0]
    place = _COUNT.size
    found: list[Download] = []
    for entry in range(1, count + 1):
        if place + _HEAD.size > len(content):
            raise ValueError(f"ends within entry {entry} of {count}")
        index, sub, size = _HEAD.unpack_from(content, place)
        place += _HEAD.size
        if not size or place + size > len(content):
            raise ValueError(f"entry {entry}, {index:04X}h:{sub:02X}, has an impossible size of {size} bytes")
        found.append(Download(index, sub, content[place : place + size], index not in COMMANDS))
        place += size
    if place != len(content):
        raise ValueError(f"has {len(content) - place} bytes after its {count} entries")
    return tuple(found)


def to_concise_dcf(downloads: tuple[Download, ...]) -> bytes:
    """``downloads`` as a concise DCF, 1F22h."""
    parts = [_COUNT.pack(len(downloads))]
    for one in downloads:
        parts += [_HEAD.pack(one.index, one.sub, len(one.data)), one.data]
    return b"".join(parts)
