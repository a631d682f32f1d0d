"""Publisher of changes: at each look the newest value of every variable that a client watches."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from typing import Final, Protocol

from bridge.base import clock
from bridge.base.guard import Guard
from bridge.base.publishing_clock import next_publish
from bridge.image import Image
from bridge.northbound.opcua.events.events import EventSender
from bridge.northbound.opcua.service_level import ServiceLevel
from bridge.northbound.opcua.space.point_values import AllWatched, WatchedVariable

_TAKE: Final = 500
_TURN_S: Final = 0.001
"""Time in seconds after which others have their turn."""


class Past(Protocol):
    """History that is fed with changes."""

    def record(self, places: Sequence[int]) -> None:
        """These points have changed."""
        ...

    def look(self) -> None:
        """Do what is due; called at each look."""
        ...


class Publisher:
    """Follows the image for the variables in ``watched``, and for the history."""

    def __init__(
        self,
        image: Image,
        watched: AllWatched,
        events: EventSender,
        past: Past,
        level: ServiceLevel,
    ) -> None:
        self._image = image
        self._watched = watched
        self._events = events
        self._past = past
        self._level = level
        self._guard = Guard("OPC UA publisher")
        self._turn_ends = 0.0

    async def run(self) -> None:
        feed = self._image.feed()
        try:
            while True:
                with self._guard:
                    await self._level.look()
                with self._guard:
                    await self._events.send_waiting()
                # What changes meanwhile waits for the next look, or a busy image would never let go.
                left = len(feed)
                while left > 0:
                    taken = feed.take(min(left, _TAKE))
                    left -= len(taken)
                    with self._guard:
                        self._past.record(taken)
                    await self._publish(taken)
                with self._guard:
                    self._past.look()
                now = asyncio.get_running_loop().time()
                await asyncio.sleep(next_publish(now) - now)
        finally:
            self._image.drop_feed(feed)

    async def _publish(self, indices: Sequence[int]) -> None:
        self._begin_turn()
        for index in indices:
            for _, variable in sorted(self._watched.get(index, {}).items()):
                if variable.watchers:
                    try:
                        await self._tell(variable)
                    except Exception as error:  # noqa: BLE001 - as the guard's, which takes time for each
                        self._guard.note(error)
        await asyncio.sleep(0)

    async def _tell(self, variable: WatchedVariable) -> None:
        watchers = variable.watchers
        value = variable.read()
        for handle, watcher in list(watchers.items()):
            if handle not in watchers:  # deleted while others had their turn
                continue
            now = clock.now()
            if now >= self._turn_ends:
                await asyncio.sleep(0)
                now = self._begin_turn()
                # Who was told a newer one meanwhile must not be told an older one now.
                value = variable.read()
            try:
                watcher.told(value, now)
            except Exception as error:  # noqa: BLE001 - as above
                self._guard.note(error)

    def _begin_turn(self) -> float:
        now = clock.now()
        self._turn_ends = now + _TURN_S
        return now
