"""Values of 32 bits, two registers each."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from bridge.image import Image, Quality, Reading, Value
from bridge.northbound.modbus.registers import Row, Words32
from bridge.northbound.modbus.unit import refuse_all_absent


class Values32:
    """The rows of a block that begins at register ``first``. Ranges begin and end between values."""

    def __init__(self, rows: Sequence[Row], owner: str, image: Image, words32: Words32, first: int) -> None:
        self.rows: Final = rows
        self.indices: Final = [image.index[f"{owner}/{row.name}"] for row in rows]
        self._image = image
        self._words32 = words32
        self._first = first

    def read(self, start: int, end: int, *, beside: bool = False) -> list[int]:
        """Registers from ``start`` up to ``end``: a value that is not there reads as 0. Raises
        ``ModbusException`` where none is, unless the request reads other registers ``beside`` them."""
        places = slice(max(start - self._first, 0) // 2, max(end - self._first, 0) // 2)
        readings = [self._image[index] for index in self.indices[places]]
        if not beside:
            refuse_all_absent([reading.quality for reading in readings])
        words: list[int] = []
        for row, reading in zip(self.rows[places], readings, strict=True):
            words += words_read(row, reading, self._words32)
        return words

    def not_good(self) -> list[bool]:
        """One for each row."""
        return [quality is not Quality.GOOD for quality in self._image.qualities(self.indices)]

    def written(self, start: int, words: Sequence[int]) -> list[tuple[Row, Value]]:
        """Value written to each row, by its type."""
        first = (start - self._first) // 2
        pairs = zip(words[::2], words[1::2], strict=True)
        rows = self.rows[first : first + len(words) // 2]
        return [(row, value_of(row, pair, self._words32)) for row, pair in zip(rows, pairs, strict=True)]


def words_read(row: Row, reading: Reading, words32: Words32) -> tuple[int, ...]:
    """The registers of a row as they are read: 0 where its value is not there."""
    return words_of(row, reading.value, words32) if reading.quality.has_value else (0,) * row.size


def words_of(row: Row, value: Value, words32: Words32) -> tuple[int, ...]:
    """The registers of a value."""
    if row.type == "float32":
        return words32.from_float(float(value))
    if row.size == 1:
        return (int(value) & 0xFFFF,)
    return words32.from_int(int(value))


def value_of(row: Row, words: Sequence[int], words32: Words32) -> Value:
    """The value of written registers."""
    if row.type == "float32":
        return words32.to_float(*words)
    is_signed = row.type.startswith("int")
    if row.size == 1:
        (word,) = words
        return word - (1 << 16) if is_signed and word >> 15 else word
    return words32.to_int(*words, signed=is_signed)
