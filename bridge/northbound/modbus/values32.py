"""Values of 32 bits, two registers each."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from bridge.image import Image, Value
from bridge.northbound.modbus.registers import Row, Words32
from bridge.northbound.modbus.unit import refuse_quality


class Values32:
    """The rows of a block that begins at register ``first``. Ranges begin and end between values."""

    def __init__(self, rows: Sequence[Row], owner: str, image: Image, words32: Words32, first: int) -> None:
        self.rows: Final = rows
        self.indices: Final = [image.index[f"{owner}/{row.name}"] for row in rows]
        self._image = image
        self._words32 = words32
        self._first = first

    def read(self, start: int, end: int) -> list[int]:
        """Raises ``Refused`` where the quality of one of them is none that is served."""
        words: list[int] = []
        places = slice(max(start - self._first, 0) // 2, max(end - self._first, 0) // 2)
        for row, index in zip(self.rows[places], self.indices[places], strict=True):
            reading = self._image[index]
            refuse_quality(reading.quality)
            words += words_of(row, reading.value, self._words32)
        return words

    def written(self, start: int, words: Sequence[int]) -> list[tuple[Row, Value]]:
        """What is written to each, by its type."""
        first = (start - self._first) // 2
        pairs = zip(words[::2], words[1::2], strict=True)
        rows = self.rows[first : first + len(words) // 2]
        return [(row, value_of(row, pair, self._words32)) for row, pair in zip(rows, pairs, strict=True)]


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
