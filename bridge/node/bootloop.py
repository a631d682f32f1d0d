"""Boot loops: a node that keeps restarting is booted less and less often, and reported once a minute."""

from __future__ import annotations

from collections import deque
from typing import Final

from bridge.base.ratelimit import Pauses
from bridge.text import Text

_MANY: Final = 4
_WITHIN_S: Final = 20.0
_ROW_GAP_S: Final = 0.2
"""Gap within which boot-up messages mean one start, in seconds: some devices send several, none starts twice
so soon."""
_LONGEST_ROW_S: Final = 1.0
"""Longest series of such messages, in seconds; beyond it the device is reset faster than it can start."""
_FIRST_PAUSE_S: Final = 2.0
_LAST_PAUSE_S: Final = 60.0


class BootLoop:
    """Restarts of one node, counted by its boot-up messages."""

    def __init__(self) -> None:
        self._times: deque[float] = deque(maxlen=_MANY)
        self._last = float("-inf")
        self._pause_s = 0.0
        self._pauses = Pauses()
        self._since_told = 0

    def on_boot_up(self, now: float) -> float:
        """Take a boot-up message; returns the seconds to wait before the node is booted, 0 if all is well. A
        series counts as one restart."""
        self._since_told += 1
        gap_s, self._last = now - self._last, now
        if self._times and gap_s < _ROW_GAP_S and now - self._times[-1] < _LONGEST_ROW_S:
            return self._pause_s
        if self._times and now - self._times[-1] > max(_WITHIN_S, 2 * self._pause_s):
            self._pause_s = 0.0
            self._times.clear()
        self._times.append(now)
        if len(self._times) < _MANY or now - self._times[0] > max(_WITHIN_S, _MANY * self._pause_s):
            return self._pause_s
        self._times.clear()
        self._times.append(now)
        self._pause_s = min(max(_FIRST_PAUSE_S, 2 * self._pause_s), _LAST_PAUSE_S)
        return self._pause_s

    @property
    def is_looping(self) -> bool:
        return self._pause_s > 0

    def report(self, now: float) -> Text | None:
        """Report of the restarts, at most once a minute while they go on; None if there is none."""
        if not self.is_looping or self._pauses.take(now) is None:
            return None
        since, self._since_told = self._since_told, 0
        return Text.of("node.starts_again", starts=since, pause_s=self._pause_s)
