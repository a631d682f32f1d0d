"""Places of a drive's words in a PDO."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from bridge.canopen.pdo import PdoEntry
from bridge.node.places.word_map import WORD_BITS, WordPlace


@dataclass(frozen=True, slots=True)
class Field:
    """Bits of a PDO; ``shift`` is how far up they belong in their word."""

    start: int
    length: int
    is_signed: bool = False
    shift: int = 0

    def then(self, other: Field) -> Field | None:
        """Both as one, where the other one follows at once."""
        follows = other.start == self.start + self.length and other.shift == self.shift + self.length
        if not follows or self.is_signed or other.is_signed:
            return None
        return Field(self.start, self.length + other.length, shift=self.shift)


@dataclass(frozen=True, slots=True)
class WordLayout:
    """``words`` by the word's place, its parts from the lowest bit on; ``others`` are objects that are no
    word of the drive."""

    words: dict[int, list[Field]]
    others: list[tuple[PdoEntry, Field]]


def lay_out(
    entries: Sequence[PdoEntry], places: Sequence[WordPlace | None], signed: frozenset[tuple[int, int]]
) -> WordLayout:
    """The bits of each word. Objects that share a word and follow each other become one field."""
    layout = WordLayout({}, [])
    begin = 0
    for entry, place in zip(entries, places, strict=True):
        is_signed = (entry.index, entry.sub) in signed
        if place is None:
            if not entry.is_dummy:
                layout.others.append((entry, Field(begin, entry.bits, is_signed)))
        elif place.bits:
            _add(layout.words, place.word, Field(begin, min(place.bits, entry.bits), shift=place.shift))
        else:
            for part in range(place.span):
                length = min(WORD_BITS, entry.bits - part * WORD_BITS)
                if length > 0:
                    field = Field(begin + part * WORD_BITS, length, is_signed and length < WORD_BITS)
                    _add(layout.words, place.word + part, field)
        begin += entry.bits
    return layout


def _add(words: dict[int, list[Field]], word: int, field: Field) -> None:
    parts = words.setdefault(word, [])
    joined = parts[-1].then(field) if parts else None
    if joined is None:
        parts.append(field)
    else:
        parts[-1] = joined
