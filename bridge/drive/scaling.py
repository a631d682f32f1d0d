"""Scaling of raw words to values with a unit, and back."""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import Final

from bridge.canopen.datatypes import INTEGERS
from bridge.image import DataType
from bridge.image.limits import out_of_range
from bridge.mapping.model import ProcessValue
from bridge.text import Text

_WORD_BITS: Final = 32
_EXACT: Final = 1 << 53
"""Magnitude up to which every whole number is exact as a float."""


@dataclass(frozen=True, slots=True)
class LinearScale:
    """Scale of a word: value = word × full / at + offset; ``limit`` is the largest magnitude as a multiple of
    ``full``.

    The word is a number of ``raw``, 16 or 32 bits. ``least`` and ``most`` are what the family allows beside
    that, in the value's unit.
    """

    full: float
    at: float = 1
    limit: float = math.inf
    offset: float = 0.0
    raw: DataType = DataType.INT16
    least: float = -math.inf
    most: float = math.inf

    @property
    def _ends(self) -> tuple[float, float]:
        number = INTEGERS[self.raw]
        one, other = (raw * self.full / self.at + self.offset for raw in (number.low, number.high))
        return min(one, other), max(one, other)

    @property
    def high(self) -> float:
        """Largest value that the word and the limits allow, in the value's unit."""
        return min(abs(self.full) * self.limit, self._ends[1], self.most)

    @property
    def low(self) -> float:
        return max(-abs(self.full) * self.limit, self._ends[0], self.least)

    def from_word(self, word: int) -> float:
        return INTEGERS[self.raw].from_word(word) * self.full / self.at + self.offset

    def to_word(self, value: float) -> int:
        """The nearest word. Raises ValueNotTaken where ``value`` is out of range."""
        if not self.low <= value <= self.high:
            raise out_of_range(self.low, self.high, value)
        return INTEGERS[self.raw].to_word(round((value - self.offset) * self.at / self.full))


def _ratio(factor: float) -> tuple[float, float]:
    """A decimal factor as full / at: 0.006 as 3 / 500. So a word's value is the nearest number there is:
    2800758 × 0.001 is 2800.7580000000003, and 2800758 / 1000 is 2800.758."""
    ratio = Fraction(repr(factor))
    is_exact = abs(ratio.numerator) <= _EXACT >> _WORD_BITS and ratio.denominator <= _EXACT
    return (float(ratio.numerator), float(ratio.denominator)) if is_exact else (factor, 1.0)


def is_scale(full: float) -> bool:
    """Whether a parameter with this value scales anything."""
    return 0 < full < math.inf


def _is_known(value: float | None) -> bool:
    return value is not None and is_scale(value)


def no_scale(parameter: str, value: float) -> Text:
    """Text about ``parameter``, whose value is no scale: nothing is made of the words that it scales."""
    return Text.of("meaning.no_scale", parameter=parameter, value=value)


def scale_of(value: ProcessValue, full: float | None = None, over: float | None = 1.0) -> LinearScale | None:
    """Scale of a value, ``full`` and ``over`` being the values of its parameters; None where it has none, or
    where that is not known."""
    scale = value.scale
    if scale is None or (scale.full is not None and not (_is_known(full) and _is_known(over))):
        return None
    least = -math.inf if value.low is None else value.low
    most = math.inf if value.high is None else value.high
    if scale.full is None or full is None or over is None:
        over, under = _ratio(scale.factor)
        return LinearScale(over, under, math.inf, scale.offset, value.raw_type, least, most)
    return LinearScale(full, (scale.at or 1) * over, scale.limit, 0.0, value.raw_type, least, most)
