"""Pace of sending: soon after something has changed, and never too often."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from math import inf


class Pace:
    """Calls ``turn`` in the event loop after ``wake``: at once where the last call was ``period_s`` ago, else
    when it will be, or the next time that ``beat`` gives; with ``waits`` always ``period_s`` after it. Unless
    woken it rests, but for no longer than ``most_s``.

    Works from ``start`` until ``stop``; what woke it before counts.
    """

    def __init__(
        self,
        turn: Callable[[], None],
        period_s: float,
        most_s: float = inf,
        *,
        waits: bool = False,
        beat: Callable[[float], float] | None = None,
    ) -> None:
        self._waits = waits
        self._beat = beat
        self._turn = turn
        self._period_s = period_s
        self._most_s = most_s
        self._last = -inf
        self._is_woken = False
        self._timer: asyncio.TimerHandle | None = None
        self._loop: asyncio.AbstractEventLoop | None = None

    def start(self) -> None:
        self._loop = asyncio.get_running_loop()
        self._arm()

    def stop(self) -> None:
        self._loop = None
        if self._timer:
            self._timer.cancel()
            self._timer = None

    def wake(self) -> None:
        if not self._is_woken:
            self._is_woken = True
            self._arm()

    def _arm(self) -> None:
        if self._loop is None:
            return
        if self._timer:
            self._timer.cancel()
            self._timer = None
        pause_s = self._period_s if self._is_woken else self._most_s
        if pause_s < inf:
            now = self._loop.time()
            since = now if self._waits and self._is_woken else self._last
            at = max(since + pause_s, now)
            if self._beat and self._is_woken and at > now:
                at = self._beat(now)
            self._timer = self._loop.call_at(at, self._now)

    def _now(self) -> None:
        self._timer = None
        if self._loop is None:
            return
        self._last = self._loop.time()
        self._is_woken = False
        try:
            self._turn()
        finally:
            if self._timer is None:
                self._arm()
