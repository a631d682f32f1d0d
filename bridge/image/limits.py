"""Limits of a value as people read them: what is shown as allowed is allowed."""

from __future__ import annotations

from decimal import ROUND_CEILING, ROUND_FLOOR, Context, Decimal
from typing import Final

_DIGITS: Final = 6


def shown_range(low: float | None, high: float | None) -> str:
    """``-100…99.9969``: each end with six digits at most, rounded towards the inside; whole numbers have all
    their digits."""
    least = "" if low is None else _shown(low, ROUND_CEILING)
    most = "" if high is None else _shown(high, ROUND_FLOOR)
    if high is None:
        return f"{least} and more"
    return f"{least}…{most}" if least else f"up to {most}"


def _shown(value: float, inwards: str) -> str:
    exact = Decimal(repr(value) if isinstance(value, float) else value)
    if exact.is_infinite() or exact == exact.to_integral_value():
        return f"{value:.0f}"
    return f"{Context(prec=_DIGITS, rounding=inwards).create_decimal(exact).normalize():f}"
