"""Due times: a common tick for everything that moves, and the first of several deadlines."""

from __future__ import annotations

import math
from typing import Final

TICK_S: Final = 0.01
"""Drives that tick together wake their process only once."""


def next_tick(time: float) -> float:
    """The first multiple of ``TICK_S`` after ``time`` in seconds, at least half a tick later."""
    return math.floor(time / TICK_S + 1.5) * TICK_S


def earliest(*deadlines: float | None) -> float | None:
    first = None
    for deadline in deadlines:
        if deadline is not None and (first is None or deadline < first):
            first = deadline
    return first
