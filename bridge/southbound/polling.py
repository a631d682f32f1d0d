"""Reads objects of a node again and again, behind everything else that wants its SDO channel."""

from __future__ import annotations

import heapq
from collections.abc import Callable

from bridge.mapping.model import Poll
from bridge.southbound.boot import number_from
from bridge.southbound.canopen.sdo import Result, SdoChannel, SdoError


class Polling:
    """The polls of one mapping file. ``show`` gets name, value and the time of the answer."""

    def __init__(self, polls: list[Poll], sdo: SdoChannel, show: Callable[[str, int, float], None]) -> None:
        self._polls = polls
        self._sdo = sdo
        self._show = show
        self._due: list[tuple[float, int]] = []
        self._now = 0.0

    def start(self, now: float) -> None:
        self._due = [(now, number) for number in range(len(self._polls))]

    def stop(self) -> None:
        self._due = []

    def next_deadline(self) -> float | None:
        return self._due[0][0] if self._due else None

    def on_time(self, now: float) -> None:
        self._now = now
        while self._due and self._due[0][0] <= now:
            _, number = heapq.heappop(self._due)
            poll = self._polls[number]
            heapq.heappush(self._due, (now + poll.every_ms / 1000, number))
            done = self._done(number)
            self._sdo.read(poll.object.index, poll.object.sub, now, done, urgent=False)

    def _done(self, number: int) -> Callable[[Result], None]:
        poll = self._polls[number]

        def done(result: Result) -> None:
            if not isinstance(result, SdoError):
                self._show(poll.name, number_from(poll.data_type, result), self._now)
            elif result.by_server:
                # The node does not have it: asking again changes nothing.
                self._due = [item for item in self._due if item[1] != number]
                heapq.heapify(self._due)

        return done
