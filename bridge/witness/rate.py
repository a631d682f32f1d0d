"""Rates of frames: one that comes more often than the bridge repeats it has another sender. Sans-IO."""

from __future__ import annotations

from collections import deque
from typing import Final

WINDOW_S: Final = 2.0
_LOAD: Final = 1.5
SPARE: Final = 5
"""Frames that may come beside the period, when the content changes."""


class Rate:
    """Rate of one frame. The bridge sends it each ``period_ms``; 0 where that is not known."""

    def __init__(self, period_ms: float) -> None:
        self._period_ms = period_ms
        self._times: deque[float] = deque()

    def is_too_often(self, at: float) -> bool:
        """Count a frame at ``at``. True if that is more than one sender would send; the count then begins
        again."""
        if not self._period_ms:
            return False
        times = self._times
        times.append(at)
        while times[0] < at - WINDOW_S:
            times.popleft()
        if len(times) <= _LOAD * WINDOW_S * 1000 / self._period_ms + SPARE:
            return False
        times.clear()
        return True
