"""The last time at which the event loop has certainly looked at its sockets, and its last hang."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Final

from bridge.command.messages.freshness import HANG_MS, LoopPulse

PERIOD_S: Final = 0.01


class Pulse:
    """Beats in the event loop until it is stopped. ``clock`` is the plant's."""

    def __init__(self, clock: Callable[[], float]) -> None:
        self._clock = clock
        self._beat_at = clock()
        self._timer: asyncio.TimerHandle | None = None
        self.look = LoopPulse(self._beat_at, float("-inf"))

    def start(self) -> None:
        self._beat_at = self._clock()
        self.look = LoopPulse(self._beat_at, float("-inf"))
        self._timer = asyncio.get_running_loop().call_later(PERIOD_S, self._beat)

    def stop(self) -> None:
        if self._timer:
            self._timer.cancel()
            self._timer = None

    def _beat(self) -> None:
        """The loop polls its sockets between two beats, and reads what it finds before the second: what is
        read later arrived after the first."""
        before, self._beat_at = self._beat_at, self._clock()
        has_hung = (self._beat_at - before) * 1000 > HANG_MS
        self.look = LoopPulse(before, self._beat_at if has_hung else self.look.steady_since)
        self._timer = asyncio.get_running_loop().call_later(PERIOD_S, self._beat)
