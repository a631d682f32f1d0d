"""PDO codecs, compiled from a mapping (CiA 301 §7.5.2.36) into one ``struct.Struct``."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import Final

_CODES: Final = {8: "B", 16: "H", 32: "I", 64: "Q"}
_DUMMY_INDICES: Final = range(0x0001, 0x0020)
MOST_BYTES: Final = 8


@dataclass(frozen=True, slots=True)
class Entry:
    """One mapped object: index, sub-index, length in bits."""

    index: int
    sub: int
    bits: int

    @classmethod
    def from_object(cls, value: int) -> Entry:
        """From the 32-bit value of 16xxh/1Axxh: ``IIIISSLL``."""
        return cls(value >> 16, value >> 8 & 0xFF, value & 0xFF)

    def to_object(self) -> int:
        return self.index << 16 | self.sub << 8 | self.bits

    @property
    def is_dummy(self) -> bool:
        return self.index in _DUMMY_INDICES

    def __str__(self) -> str:
        return f"{self.index:04X}:{self.sub:02X}/{self.bits}"


class MappingError(ValueError):
    """A PDO mapping that cannot be compiled; the message names the entry."""


class PdoCodec:
    """Packs and unpacks one PDO. Values are the raw unsigned integers of the entries, in order."""

    __slots__ = ("_struct", "entries", "length")

    def __init__(self, entries: tuple[Entry, ...]) -> None:
        """Raises MappingError where an entry's length is not 8, 16, 32 or 64 bits or the sum exceeds
        eight bytes."""
        for entry in entries:
            if entry.bits not in _CODES:
                raise MappingError(f"{entry}: only 8, 16, 32 and 64 bits can be mapped")
        self.entries = entries
        self._struct = struct.Struct("<" + "".join(_CODES[entry.bits] for entry in entries))
        self.length = self._struct.size
        if self.length > MOST_BYTES:
            raise MappingError(f"{self.length} bytes are mapped, a PDO has {MOST_BYTES}")

    def unpack(self, data: bytes) -> tuple[int, ...]:
        """The values in ``data``, which must be exactly ``length`` bytes long."""
        return self._struct.unpack(data)

    def pack(self, values: tuple[int, ...]) -> bytes:
        return self._struct.pack(*values)
