"""Bursts, and how one turns into a stop by itself: its sender keeps the controller's deadline."""

from __future__ import annotations

import math
from typing import Final, NamedTuple

from bridge.canopen.frame import Frame

MOST_FRAMES: Final = 256
"""The longest sequence that the kernel's broadcast manager takes (MAX_NFRAMES of net/can/bcm.c)."""
SHORTEST: Final = 4
"""Shorter bursts are not for the kernel: it counts the first frame, so they would end before a renewal."""
_ROUNDING: Final = 1e-9


class BurstEnd(NamedTuple):
    """End of a burst: from ``at`` on (monotonic seconds) it sends ``frame``; with None it ends then."""

    at: float
    frame: Frame | None


class Burst(NamedTuple):
    """One of ``frames`` every ``period_s`` seconds, ``total`` times.

    They have one identifier and take turns: a SYNC with its counter is a burst of n frames. A burst of one
    frame may have an ``ending``: from then on that one's frame is sent instead, still ``total`` in all.
    """

    frames: tuple[Frame, ...]
    period_s: float
    total: int
    ending: BurstEnd | None = None

    @property
    def can_id(self) -> int:
        return self.frames[0].can_id


class Sequence(NamedTuple):
    """Content of one broadcast manager job: ``frames`` are sent in turn, ``total`` of them in all. The first
    ``head`` may enable the drive, where others follow them; 0 where all are the same."""

    frames: tuple[Frame, ...]
    total: int
    head: int = 0


def sequence(burst: Burst, now: float, *, extra: int = 0) -> Sequence:
    """A burst that is handed over ``now`` and keeps to its ``ending``.

    In a running burst the next frame may come at any time within a period. So the number of frames until the
    deadline is rounded up: the stop never comes before it, and at most two periods after it. ``extra`` is the
    number of frames that are sent at once, out of turn. The length of the sequence stays the same, because
    the manager lets none grow; one that is too long for it is cut at the deadline.
    """
    frames, period_s, count, ending = burst
    if len(frames) != 1:
        return Sequence(frames, count)
    frame, length = frames[0], min(count, MOST_FRAMES)
    if ending is None:
        return Sequence((frame,) * length, count)
    left = ending.at - now
    head = math.ceil(left / period_s - _ROUNDING) + extra if left > 0 else 0
    if head >= count:
        return Sequence((frame,) * length, count)
    if ending.frame is None or head >= length:
        return Sequence((frame,) * length, head)
    if not head:
        return Sequence((ending.frame,) * length, length)
    return Sequence((frame,) * head + (ending.frame,) * (length - head), length, head)
