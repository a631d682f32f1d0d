"""Parameter set that a drive works with, by bits of its control or status word."""

from __future__ import annotations

from collections.abc import Sequence


class ParameterSet:
    """Number of a parameter set in a word, from 1 on. ``bits`` are its places, the low one first."""

    def __init__(self, bits: Sequence[int]) -> None:
        self._bits = tuple(bits)
        self.mask = sum(1 << bit for bit in bits)
        """Mask of these bits; all of them are 0 in set 1."""

    def of(self, word: int) -> int:
        return 1 + sum((word >> bit & 1) << place for place, bit in enumerate(self._bits))
