"""Publishing to clients that watch a point, without holding up others; no server."""

from __future__ import annotations

import asyncio
import time
from collections import Counter
from typing import Any

from asyncua import ua

from bridge.northbound.opcua.change_publisher import Publisher
from bridge.northbound.opcua.space.point_values import WatchedVariable
from tests.support.zenoh_peer import until

WATCHERS = 1_000
TELLING_S = 0.0001
TURN_S = 0.001


class Image:
    """One point, which has changed once."""

    def __init__(self) -> None:
        self.changed = [0]

    def feed(self) -> Image:
        return self

    def drop_feed(self, feed: Image) -> None: ...

    def __len__(self) -> int:
        return len(self.changed)

    def take(self, count: int) -> list[int]:
        taken, self.changed = self.changed[:count], self.changed[count:]
        return taken


class Events:
    async def send_waiting(self) -> None: ...


class Level:
    async def look(self) -> None: ...


class Past:
    def record(self, places: list[int]) -> None: ...

    def look(self) -> None: ...


async def test_many_that_watch_one_point_are_told_in_turns_and_of_the_newest_value() -> None:
    turn, number = 0, 1
    told: list[tuple[int, int, int]] = []

    async def count_turns() -> None:
        nonlocal turn
        while True:
            turn += 1
            await asyncio.sleep(0)

    class Watcher:
        def __init__(self, handle: int) -> None:
            self.handle = handle

        def told(self, value: ua.DataValue, now: float) -> None:
            nonlocal number
            told.append((turn, self.handle, value.Value.Value))
            if len(told) == 100:
                number = 2
                del watchers[WATCHERS - 1]
            done = time.monotonic() + TELLING_S
            while time.monotonic() < done:
                pass

    watchers: dict[int, Any] = {handle: Watcher(handle) for handle in range(WATCHERS)}
    variable = WatchedVariable(watchers, lambda: ua.DataValue(ua.Variant(number, ua.VariantType.UInt16)))
    image: Any = Image()
    events: Any = Events()
    past: Any = Past()
    level: Any = Level()
    running = [
        asyncio.create_task(count_turns()),
        asyncio.create_task(Publisher(image, {0: {-1: variable}}, events, past, level).run()),
    ]
    await until(lambda: len(told) >= WATCHERS - 1, "the last one to be told")
    for task in running:
        task.cancel()
    await asyncio.gather(*running, return_exceptions=True)
    assert max(Counter(turn for turn, _, _ in told).values()) <= TURN_S / TELLING_S + 1
    assert [handle for _, handle, _ in told] == list(range(WATCHERS - 1)), "but not who has gone"
    changed = told[99][0]
    assert {value for turn, _, value in told if turn > changed} == {2}
