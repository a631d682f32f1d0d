"""Conversion of PDO entries to the 16-bit words of a drive and back."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

from bridge.canopen.pdo import PdoEntry

WORD_BITS: Final = 16
_WORD_MASK: Final = 0xFFFF


class WordPlace(NamedTuple):
    """Place of a mapped object among the words of its drive.

    It fills ``span`` words from ``word`` on, the low one first; or, with ``bits``, that many bits of one word
    from ``shift`` on.
    """

    word: int
    span: int = 1
    shift: int = 0
    bits: int = 0


class WordMap:
    """Conversion of one PDO's values into words and back.

    An object that is longer than a word fills several; one that is shorter fills its word with its sign or
    with zeros, unless it shares the word with others.
    """

    def __init__(self, entries: Sequence[PdoEntry], places: Sequence[WordPlace | None], words: int) -> None:
        """``words`` is the number of words that the drive has; entries beyond them are left out."""
        self._count = len(entries)
        whole: list[tuple[int, int, int]] = []
        parts: list[tuple[int, int, int, int]] = []
        for number, (entry, place) in enumerate(zip(entries, places, strict=True)):
            if place is None or entry.is_dummy or place.word >= words:
                continue
            if place.bits:
                parts.append((place.word, number, place.shift, (1 << min(place.bits, entry.bits)) - 1))
                continue
            fills = min(place.span, (entry.bits + WORD_BITS - 1) // WORD_BITS, words - place.word)
            whole += [(place.word + part, number, part * WORD_BITS) for part in range(fills)]
        self._whole = tuple(whole)
        self._parts = tuple(parts)
        self._shared = tuple(dict.fromkeys(word for word, *_ in parts))
        short = all(entry.bits <= WORD_BITS for entry in entries)
        in_order = [(number, number) for number in range(len(entries))]
        self.in_order = len(entries) if short and [item[:2] for item in whole] == in_order else 0
        """Number of words, from the first on, that are the values as they are and without a sign; 0 where the
        mapping is any other."""

    def unpack(self, values: Sequence[int], words: list[int]) -> None:
        """Write the values to their places in ``words``."""
        for place, entry, shift in self._whole:
            words[place] = values[entry] >> shift & _WORD_MASK
        if self._parts:
            for place in self._shared:
                words[place] = 0
            for place, entry, shift, mask in self._parts:
                words[place] |= (values[entry] & mask) << shift & _WORD_MASK

    def pack(self, words: Sequence[int]) -> list[int]:
        """Values of the entries; anything mapped beside the words is 0."""
        values = [0] * self._count
        for place, entry, shift in self._whole:
            values[entry] |= words[place] << shift
        for place, entry, shift, mask in self._parts:
            values[entry] = words[place] >> shift & mask
        return values
