"""Raw words to values with a unit and back."""

from __future__ import annotations

from dataclasses import dataclass


def signed(word: int) -> int:
    """A 16-bit word as the signed number it stands for: C000h is -16384."""
    return word - 0x1_0000 if word & 0x8000 else word


@dataclass(frozen=True, slots=True)
class LinearScale:
    """value = word × full / at; ``limit`` is the largest magnitude as a multiple of ``full``."""

    full: float
    at: int
    limit: float

    @property
    def high(self) -> float:
        """Largest value that the word and the limit allow, in the value's unit."""
        return min(self.full * self.limit, self.full * 0x7FFF / self.at)

    @property
    def low(self) -> float:
        return max(-self.full * self.limit, -self.full * 0x8000 / self.at)

    def from_word(self, word: int) -> float:
        return signed(word) * self.full / self.at

    def to_word(self, value: float) -> int:
        """The nearest word. Raises ValueError where ``value`` is out of range."""
        if not self.low <= value <= self.high:
            raise ValueError(f"takes {self.low:g}…{self.high:g}, not {value:g}")
        return round(value * self.at / self.full) & 0xFFFF
