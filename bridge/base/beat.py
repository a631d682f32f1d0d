"""The beat on which OPC UA clients are told of changes, in both processes: the bus process tells the front
right before it looks, and the front tells its clients right after. Else each of them would wait for the next.

Times are of the monotonic clock, which is also the event loop's and the same in all processes.
"""

from __future__ import annotations

import math
from typing import Final

LOOK_EVERY_S: Final = 0.05
"""As long as the shortest publishing interval: more often, nobody would see it."""
_BEFORE_S: Final = 0.006
"""Which a change takes to the front, about."""
_BEHIND_S: Final = 0.008
"""Which a look takes, about. What it has not seen by then is told a cycle later."""


def next_look(now: float) -> float:
    """The first look after ``now``."""
    return (math.floor(now / LOOK_EVERY_S) + 1) * LOOK_EVERY_S


def next_before_look(now: float) -> float:
    """The first moment after ``now`` from which something reaches the front right before it looks."""
    return next_look(now + _BEFORE_S) - _BEFORE_S


def cycle_by(at: float) -> float:
    """The last moment until ``at`` that is right behind a look: publishing cycles are then."""
    return math.floor((at - _BEHIND_S) / LOOK_EVERY_S) * LOOK_EVERY_S + _BEHIND_S
