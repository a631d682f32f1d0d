"""Emergency messages of one node: a history, and a limit on how often they are reported."""

from __future__ import annotations

import json
from collections import deque
from collections.abc import Callable
from typing import Final

from bridge.base.ratelimit import RateLimit
from bridge.canopen.emcy import Emergency

_HISTORY: Final = 8
"""Length of the history, that of 1003h in most devices."""
_BURST: Final = 16
_EVERY_S: Final = 0.1
"""Time per report beyond the burst, in seconds. A node has its own inhibit time (1015h); a babbling one
ignores it."""
_MOST_PENDING: Final = 16


class EmergencyLog:
    """The last eight emergency messages of one node, and which of them may be reported.

    ``number`` is the drive that an emergency is about, for nodes with several. Of messages that come too fast
    only the newest for each drive is kept and reported later, so that the last one always gets through.
    """

    def __init__(self) -> None:
        self.suppressed = 0
        self._limit = RateLimit(_BURST, _EVERY_S)
        self._history: deque[Emergency] = deque(maxlen=_HISTORY)
        self._pending: dict[int | None, tuple[Emergency, float]] = {}
        self._due: float | None = None
        self.changed = True
        """True if a message came since the last ``as_json``."""

    def add(self, emergency: Emergency, number: int | None, at: float) -> bool:
        """Record a message; True if it may be reported now."""
        self._history.appendleft(emergency)
        self.changed = True
        if not self._pending and self._limit.allows(at):
            return True
        is_known = number in self._pending
        if is_known or len(self._pending) >= _MOST_PENDING:
            self.suppressed += 1
        if is_known or len(self._pending) < _MOST_PENDING:
            self._pending[number] = (emergency, at)
        if self._due is None:
            self._due = at + _EVERY_S
        return False

    def next_deadline(self) -> float | None:
        return self._due

    def on_time(self, now: float) -> list[tuple[Emergency, int | None, float]]:
        """Messages that were held back and may be reported now, each with its drive and the time at which it
        came."""
        if self._due is None or now < self._due:
            return []
        told: list[tuple[Emergency, int | None, float]] = []
        while self._pending and self._limit.allows(now):
            number = next(iter(self._pending))
            told.append((self._pending[number][0], number, self._pending[number][1]))
            del self._pending[number]
        self._due = now + _EVERY_S if self._pending else None
        return told

    def as_json(self, text: Callable[[Emergency], str]) -> str:
        """History, newest first; ``text`` puts a message into the family's words."""
        self.changed = False
        return json.dumps(
            [
                {
                    "code": f"{entry.code:04X}h",
                    "register": f"{entry.register:02X}h",
                    "vendor": entry.vendor.hex().upper(),
                    "text": text(entry),
                }
                for entry in self._history
            ]
        )
