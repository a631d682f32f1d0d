"""When the next of many timers is due, without asking all of them after every frame."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

_AT_ONCE_S: Final = 0.001
"""With so few timers that they may be looked at more often than this, they are looked at every time."""


class Deadlines:
    """Keeps the earliest of some deadlines that ``look`` finds. Times are monotonic seconds.

    ``on_change``: any timer may have become earlier. ``on_readings``: only timers that received data restart
    may have changed, and looking at them within ``look_every_s`` is enough.
    """

    def __init__(self, look: Callable[[float], float | None]) -> None:
        self.look_every_s = 0.0
        self._look = look
        self._deadline: float | None = None
        self._looked_at = float("-inf")
        self._changed = True
        self._readings = False

    def on_change(self) -> None:
        self._changed = True

    def on_readings(self) -> None:
        self._readings = True

    def is_due(self, now: float) -> bool:
        """Whether something may be due; what it does makes all deadlines uncertain."""
        if self._must_look(now):
            self._look_again(now)
        if self._deadline is None or now < self._deadline:
            return False
        self._changed = True
        return True

    def next(self, now: float) -> float | None:
        """When to ask ``is_due`` next."""
        # Whoever has just asked ``is_due`` has looked.
        if self._changed or (now != self._looked_at and self._must_look(now)):
            self._look_again(now)
        if not self._readings:
            return self._deadline
        again = self._looked_at + self.look_every_s
        return again if self._deadline is None else min(again, self._deadline)

    def _must_look(self, now: float) -> bool:
        if self._changed or self.look_every_s < _AT_ONCE_S:
            return True
        return self._readings and now >= self._looked_at + self.look_every_s

    def _look_again(self, now: float) -> None:
        self._deadline = self._look(now)
        self._looked_at = now
        self._changed = self._readings = False
