"""A frame that comes more often than the bridge repeats it has another sender. Sans-IO."""

from __future__ import annotations

from collections import deque
from typing import Final

WINDOW_S: Final = 2.0
_LOAD: Final = 1.5
SPARE: Final = 5
"""What comes beside the beat when it changes."""


class Rate:
    """One frame. The bridge sends it each ``period_ms``; 0: nobody knows."""

    def __init__(self, period_ms: float) -> None:
        self._period_ms = period_ms
        self._times: deque[float] = deque()

    def is_too_often(self, at: float) -> bool:
        """It came at ``at``: whether that is more than one sender would send. Then it is counted anew."""
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
