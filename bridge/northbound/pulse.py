"""Since when the event loop has certainly looked at its sockets, and since when it has not hung."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Final

from bridge.command.freshness import Look

PERIOD_S: Final = 0.01
HANG_S: Final = 0.1
"""So long without a turn, what waits outside of the event loop may have grown old."""


class Pulse:
    """Beats in the event loop until it is stopped. ``clock`` is the plant's."""

    def __init__(self, clock: Callable[[], float]) -> None:
        self._clock = clock
        self._beat_at = clock()
        self._timer: asyncio.TimerHandle | None = None
        self.look = Look(self._beat_at, self._beat_at)

    def start(self) -> None:
        self._beat_at = self._clock()
        self.look = Look(self._beat_at, self._beat_at)
        self._timer = asyncio.get_running_loop().call_later(PERIOD_S, self._beat)

    def stop(self) -> None:
        if self._timer:
            self._timer.cancel()
            self._timer = None

    def _beat(self) -> None:
        """Between two beats the loop looks at its sockets, after the first and before what it calls on the
        second; what it finds is read before the second beat."""
        before, self._beat_at = self._beat_at, self._clock()
        has_hung = self._beat_at - before > HANG_S
        self.look = Look(before, self._beat_at if has_hung else self.look.steady_since)
        self._timer = asyncio.get_running_loop().call_later(PERIOD_S, self._beat)
