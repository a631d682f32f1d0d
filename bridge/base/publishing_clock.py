"""Publishing grid shared by both processes.

The bus process sends changes to the OPC UA front right before the front looks for them, and the front
publishes to its clients right after; otherwise each would wait for the next.

Times are of the monotonic clock, which is also the event loop's and the same in all processes.
"""

from __future__ import annotations

import math
from typing import Final

PUBLISH_EVERY_S: Final = 0.05
"""Grid of publishing, and shortest publishing interval, seconds: more often, nobody would see it."""
_TO_FRONT_S: Final = 0.006
"""Typical delay of a change on the link to the front, seconds."""
_PUBLISH_S: Final = 0.008
"""Typical time in seconds for the front to take in the changes. Later ones are published one cycle later."""


def next_publish(now: float) -> float:
    """First instant of the grid after ``now``: the front publishes then."""
    return (math.floor(now / PUBLISH_EVERY_S) + 1) * PUBLISH_EVERY_S


def next_send(now: float) -> float:
    """First instant after ``now`` from which a change reaches the front right before it publishes."""
    return next_publish(now + _TO_FRONT_S) - _TO_FRONT_S


def cycle_by(at: float) -> float:
    """Last instant until ``at`` right after the front has taken in the changes: publishing cycles begin
    then."""
    return math.floor((at - _PUBLISH_S) / PUBLISH_EVERY_S) * PUBLISH_EVERY_S + _PUBLISH_S
