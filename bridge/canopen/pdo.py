"""PDO codecs, compiled from a mapping (CiA 301 §7.5.2.36).

Whole bytes, which drives usually map, become one ``struct.Struct``; anything else is split with shifts:
objects follow each other without gaps, the first at bit 0 of the first byte, little-endian.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from typing import Final

_CODES: Final = {8: "B", 16: "H", 32: "I", 64: "Q"}
_DUMMY_INDICES: Final = range(0x0001, 0x0020)
MOST_BYTES: Final = 8
MOST_BITS: Final = 8 * MOST_BYTES


@dataclass(frozen=True, slots=True)
class PdoEntry:
    """One mapped object: index, sub-index, length in bits."""

    index: int
    sub: int
    bits: int

    @classmethod
    def from_object(cls, value: int) -> PdoEntry:
        """Entry of the 32-bit value of 16xxh/1Axxh: ``IIIISSLL``."""
        return cls(value >> 16, value >> 8 & 0xFF, value & 0xFF)

    def to_object(self) -> int:
        return self.index << 16 | self.sub << 8 | self.bits

    @property
    def is_dummy(self) -> bool:
        """True if it stands for a data type and fills a gap (CiA 301 §7.4.7): sent as 0, ignored when
        received."""
        return self.index in _DUMMY_INDICES

    def __str__(self) -> str:
        return f"{self.index:04X}:{self.sub:02X}/{self.bits}"


class MappingError(ValueError):
    """A PDO mapping that cannot be compiled: of an entry that has no possible number of bits, or of
    ``length`` bytes, which are too many."""

    def __init__(self, message: object, entry: PdoEntry | None = None, length: int = 0) -> None:
        super().__init__(message)
        self.entry = entry
        self.length = length


class PdoCodec:
    """Packs and unpacks one PDO. Values are the integers of the entries in order, unsigned except for the
    objects in ``signed``, given as (index, sub)."""

    def __init__(self, entries: tuple[PdoEntry, ...], signed: Collection[tuple[int, int]] = ()) -> None:
        """Raises MappingError if an entry does not have 1…64 bits or the sum exceeds eight bytes."""
        for entry in entries:
            if not 1 <= entry.bits <= MOST_BITS:
                raise MappingError(f"{entry}: 1…{MOST_BITS} bits can be mapped", entry)
        total = sum(entry.bits for entry in entries)
        self.entries = entries
        self.length = (total + 7) // 8
        if self.length > MOST_BYTES:
            message = f"{self.length} bytes are mapped, a PDO has {MOST_BYTES}"
            raise MappingError(message, length=self.length)
        signs = [(entry.index, entry.sub) in signed for entry in entries]
        self.has_signed = any(signs)
        self._masks = tuple((1 << entry.bits) - 1 for entry in entries)
        self._fields: tuple[tuple[int, int, int], ...] = ()
        """Shift, mask and sign bit of each entry, if no Struct fits."""
        self._pack: struct.Struct | None = None
        self.unpack: Callable[[bytes], tuple[int, ...]] = self._split
        """The values in data of exactly ``length`` bytes."""
        if all(entry.bits in _CODES for entry in entries):
            codes = [_CODES[entry.bits] for entry in entries]
            self._pack = struct.Struct("<" + "".join(codes))
            received = [c.lower() if sign else c for c, sign in zip(codes, signs, strict=True)]
            self.unpack = struct.Struct("<" + "".join(received)).unpack
        else:
            shift = 0
            fields: list[tuple[int, int, int]] = []
            for entry, mask, sign in zip(entries, self._masks, signs, strict=True):
                fields.append((shift, mask, (mask + 1) >> 1 if sign else 0))
                shift += entry.bits
            self._fields = tuple(fields)

    def _split(self, data: bytes) -> tuple[int, ...]:
        number = int.from_bytes(data, "little")
        # (x ^ sign) - sign extends the sign, and is x for sign = 0.
        return tuple(((number >> shift & mask) ^ sign) - sign for shift, mask, sign in self._fields)

    def pack(self, values: Sequence[int]) -> bytes:
        """The frame's data; of each value only the lowest bits are sent."""
        masked = tuple(value & mask for value, mask in zip(values, self._masks, strict=True))
        if self._pack:
            return self._pack.pack(*masked)
        number = 0
        for value, (shift, _, _) in zip(masked, self._fields, strict=True):
            number |= value << shift
        return number.to_bytes(self.length, "little")
