"""Publishing grid shared by both processes.

The bus process sends changes to the OPC UA front right before the front looks for them, and the front
publishes to its clients right after; otherwise each would wait for the next.

Times are of the monotonic clock, which is also the event loop's and the same in all processes.
"""

from __future__ import annotations

import math
from typing import Final

LOOK_EVERY_S: Final = 0.05
"""Shortest publishing interval: more often, nobody would see it."""
_TO_FRONT_S: Final = 0.006
"""Typical delay of a change on the link to the front."""
_LOOK_S: Final = 0.008
"""Typical duration of one look. Changes that it misses are sent one cycle later."""


def next_look(now: float) -> float:
    """The first look after ``now``."""
    return (math.floor(now / LOOK_EVERY_S) + 1) * LOOK_EVERY_S


def next_before_look(now: float) -> float:
    """The first moment after ``now`` from which something reaches the front right before it looks."""
    return next_look(now + _TO_FRONT_S) - _TO_FRONT_S


def cycle_by(at: float) -> float:
    """The last moment until ``at`` that is right behind a look: publishing cycles are then."""
    return math.floor((at - _LOOK_S) / LOOK_EVERY_S) * LOOK_EVERY_S + _LOOK_S
