"""Limits of a value as people read them: what is shown as allowed is allowed."""

from __future__ import annotations

from decimal import ROUND_CEILING, ROUND_FLOOR, Context, Decimal
from typing import Final

from bridge.text import Text

_DIGITS: Final = 6


class ValueNotTaken(ValueError):
    """A value that is not taken. ``said`` begins with "takes"."""

    def __init__(self, said: Text) -> None:
        super().__init__(said)
        self.said = said


def out_of_range(low: float | None, high: float | None, value: float) -> ValueNotTaken:
    """Refusal of ``value``, which is beyond these limits."""
    return ValueNotTaken(Text.of("takes.range", range=shown_range(low, high), value=f"{value:.10g}"))


def shown_range(low: float | None, high: float | None) -> Text:
    """``-100…99.9969``: each end with six digits at most, rounded towards the inside; whole numbers have all
    their digits."""
    least = "" if low is None else _shown(low, ROUND_CEILING)
    most = "" if high is None else _shown(high, ROUND_FLOOR)
    if high is None:
        return Text.of("range.from", low=least)
    if low is None:
        return Text.of("range.up_to", high=most)
    return Text.of("range.between", low=least, high=most)


def _shown(value: float, inwards: str) -> str:
    exact = Decimal(repr(value) if isinstance(value, float) else value)
    if exact.is_infinite() or exact == exact.to_integral_value():
        return f"{value:.0f}"
    return f"{Context(prec=_DIGITS, rounding=inwards).create_decimal(exact).normalize():f}"
