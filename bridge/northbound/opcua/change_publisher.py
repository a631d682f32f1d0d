"""Publisher of changes: at each look the newest value of every variable that a client watches."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from typing import Final

from bridge.base.guard import Guard
from bridge.base.publishing_clock import next_publish
from bridge.image import Image
from bridge.northbound.opcua.events import EventSender
from bridge.northbound.opcua.point_values import AllWatched
from bridge.northbound.opcua.service_level import ServiceLevel

_TAKE: Final = 500
_BEFORE_YIELD: Final = 20


class Publisher:
    """Follows the image for the variables in ``watched``."""

    def __init__(self, image: Image, watched: AllWatched, events: EventSender, level: ServiceLevel) -> None:
        self._image = image
        self._watched = watched
        self._events = events
        self._level = level
        self._guard = Guard("OPC UA publisher")

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
                    await self._publish(taken)
                now = asyncio.get_running_loop().time()
                await asyncio.sleep(next_publish(now) - now)
        finally:
            self._image.drop_feed(feed)

    async def _publish(self, indices: Sequence[int]) -> None:
        sent = 0
        for index in indices:
            for _, variable in sorted(self._watched.get(index, {}).items()):
                watchers = variable.callbacks
                if not watchers:
                    continue
                with self._guard:
                    value = variable.read()
                    for handle, tell in list(watchers.items()):
                        if handle not in watchers:  # deleted while others had their turn
                            continue
                        with self._guard:
                            await tell(handle, value)
                        sent += 1
                        if sent >= _BEFORE_YIELD:
                            sent = 0
                            await asyncio.sleep(0)
                            # Who was told a newer one meanwhile must not be told an older one now.
                            value = variable.read()
        await asyncio.sleep(0)
