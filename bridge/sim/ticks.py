"""A common tick for everything that moves: drives that tick together wake their process only once."""

from __future__ import annotations

import math
from typing import Final

TICK_S: Final = 0.01


def next_tick(time: float) -> float:
    """The first multiple of ``TICK_S`` after ``time`` in seconds, at least half a tick later."""
    return math.floor(time / TICK_S + 1.5) * TICK_S
