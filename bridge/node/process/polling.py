"""Polling of a node: objects, after everything else that wants the SDO channel, and TPDOs that come only on a
remote frame."""

from __future__ import annotations

import heapq
from collections.abc import Callable, Iterable

from bridge.canopen.datatypes import INTEGERS
from bridge.canopen.frame import Frame
from bridge.canopen.sdo import Priority, Result, SdoChannel, SdoError
from bridge.image import Image
from bridge.mapping.model import Poll
from bridge.node.process.process_data import DrivePdos
from bridge.node.process.remote_polling import RemotePolling


class Polling:
    """Polls of one mapping file, each with its point ``place``/NAME in the image."""

    def __init__(self, polls: list[Poll], sdo: SdoChannel, image: Image, place: str) -> None:
        self._polls = polls
        self._sdo = sdo
        self._image, self._place = image, place
        self._due: list[tuple[float, int]] = []
        self._asked: set[int] = set()
        """Polls that wait for their answer: those of a slow node do not pile up."""
        self._now = 0.0
        self._spared: dict[str, float] = {}
        self._remote = RemotePolling()

    def start(self, drives: Iterable[DrivePdos], now: float) -> None:
        """Begin; TPDOs of ``drives`` that come on request only are requested."""
        self._due = [(now, number) for number in range(len(self._polls))]
        self._asked.clear()
        self._remote.start(drives, now)

    def on_pdo(self, name: str, value: int, now: float, until: float) -> None:
        """Show a value that a PDO has brought: it is not asked for before ``until``."""
        self._spared[name] = until
        self._show(name, value, now)

    def _show(self, name: str, value: int, now: float) -> None:
        self._image.put(f"{self._place}/{name}", value, now)

    def stop(self) -> None:
        self._due = []
        self._spared.clear()
        self._remote.stop()

    def next_deadline(self) -> float | None:
        times = (self._due[0][0] if self._due else None, self._remote.next_deadline())
        return min((time for time in times if time is not None), default=None)

    def take_frames(self) -> list[Frame]:
        return self._remote.take_frames()

    def on_time(self, now: float) -> None:
        self._now = now
        self._remote.on_time(now)
        while self._due and self._due[0][0] <= now:
            _, number = heapq.heappop(self._due)
            poll = self._polls[number]
            spared = self._spared.get(poll.name, now)
            if spared > now:
                heapq.heappush(self._due, (spared, number))
                continue
            heapq.heappush(self._due, (now + poll.every_ms / 1000, number))
            if number in self._asked:
                continue
            self._asked.add(number)
            done = self._done(number)
            self._sdo.read(poll.object.index, poll.object.sub, now, done, priority=Priority.POLL)

    def _done(self, number: int) -> Callable[[Result], None]:
        poll = self._polls[number]

        def done(result: Result) -> None:
            self._asked.discard(number)
            if not isinstance(result, SdoError):
                self._show(poll.name, INTEGERS[poll.data_type].decode(result), self._now)
            elif result.by_server:
                # The node does not have it: asking again changes nothing.
                self._due = [item for item in self._due if item[1] != number]
                heapq.heapify(self._due)

        return done
