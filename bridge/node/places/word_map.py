"""From the entries of a PDO to the 16-bit words of a drive and back."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

from bridge.canopen.pdo import PdoEntry

WORD_BITS: Final = 16
_WORD_MASK: Final = 0xFFFF


class WordPlace(NamedTuple):
    """The place of a mapped object among the words of its drive.

    It fills ``span`` words from ``word`` on, the low one first; or, with ``bits``, so many bits of one
    word from ``shift`` on.
    """

    word: int
    span: int = 1
    shift: int = 0
    bits: int = 0


class WordMap:
    """Unpacks the values of one PDO's entries into words and back.

    An object that is longer than a word fills several; one that is shorter fills its word with its sign
    or with zeros, unless it shares the word with others.
    """

    def __init__(self, entries: Sequence[PdoEntry], places: Sequence[WordPlace | None], words: int) -> None:
        """``words`` is how many the drive has; what lies beyond them is left out."""
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
        """How many of the words the values are, from the first on as they are and without a sign; 0 where
        they are anything else."""

    def unpack(self, values: Sequence[int], words: list[int]) -> None:
        """Write the values into their places of ``words``."""
        for place, entry, shift in self._whole:
            words[place] = values[entry] >> shift & _WORD_MASK
        if self._parts:
            for place in self._shared:
                words[place] = 0
            for place, entry, shift, mask in self._parts:
                words[place] |= (values[entry] & mask) << shift & _WORD_MASK

    def pack(self, words: Sequence[int]) -> list[int]:
        """The values of the entries; what is mapped beside the words is 0."""
        values = [0] * self._count
        for place, entry, shift in self._whole:
            values[entry] |= words[place] << shift
        for place, entry, shift, mask in self._parts:
            values[entry] = words[place] >> shift & mask
        return values
