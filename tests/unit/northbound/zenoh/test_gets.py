"""Gets with wildcards have so many places, which nobody keeps for ever."""

from __future__ import annotations

import asyncio
import json
from typing import Any, cast

import pytest

from bridge.config import ZenohTable
from bridge.northbound.zenoh import ZenohServer
from tests.support.views import view_of
from tests.support.zenoh_site import make_plant

PLACES = 16


class Get:
    """Is read by nobody until it is told to be."""

    def __init__(self, key: str = "drives/demo/**", source: str = "") -> None:
        self.key = key
        self.source = source
        self.payload = self.attachment = None
        self.parameters = ""
        self.received_at = 100.0
        self.said: list[str] = []
        self.is_read = asyncio.Event()

    def apart(self) -> Get:
        return self

    def send(self, messages: object) -> None:
        self.said.append("values")

    async def settle(self) -> None:
        await self.is_read.wait()

    def finish(self) -> None:
        self.said.append("end")

    def fail(self, payload: bytes, encoding: str) -> None:
        self.said.append(json.loads(payload)["code"])


async def turns() -> None:
    """Let running tasks go on as far as they can without waiting for anybody."""
    for _ in range(5):
        await asyncio.sleep(0)


class Hall:
    def __init__(self) -> None:
        self.now = 100.0
        self._asked: list[Get] = []
        self._server = ZenohServer(view_of(make_plant()), ZenohTable(), "demo", lambda: self.now)

    async def end(self) -> None:
        """Everything is read."""
        for get in self._asked:
            get.is_read.set()
        await turns()

    async def ask(self, *what: str) -> Get:
        get = Get(*what)
        self._asked.append(get)
        self._server._on_query(cast(Any, get))
        await turns()
        return get


@pytest.mark.landing
async def test_a_get_that_is_read_slowly_makes_room_and_says_so() -> None:
    hall = Hall()
    slow = [await hall.ask() for _ in range(PLACES)]
    assert (await hall.ask()).said == ["busy"], "all of them are young"
    hall.now += 10.0
    newcomers = [await hall.ask() for _ in range(2)]
    for get in newcomers:
        assert get.said == ["values"]
    for get in slow[:2]:
        assert get.said == ["values", "busy"], "part of the values must not look like all"
    assert all(get.said == ["values"] for get in slow[2:])
    for get in (*slow[2:], *newcomers):
        get.is_read.set()
    await turns()
    assert all(get.said[-1] == "end" for get in (*slow[2:], *newcomers))


async def test_a_slow_get_is_answered_in_whole_where_nobody_else_wants_its_place() -> None:
    hall = Hall()
    slow = [await hall.ask() for _ in range(PLACES)]
    hall.now += 1000.0
    for get in slow:
        get.is_read.set()
    await turns()
    assert all(get.said[-1] == "end" for get in slow)


async def test_a_get_of_one_drive_is_answered_whatever_the_others_do() -> None:
    hall = Hall()
    for asker in range(PLACES):
        await hall.ask("drives/demo/**", f"session {asker}")
    for key in ("drives/demo/conveyor/fu3/**", "drives/demo/conveyor/fu3/*/value_1", "drives/demo/bridge/*"):
        assert (await hall.ask(key)).said == ["values", "end"]
    await hall.end()


async def test_whoever_has_most_gets_makes_room_for_who_has_few() -> None:
    """Twelve of one session must not keep another from its only one."""
    hall = Hall()
    greedy = [await hall.ask("drives/demo/**", "greedy") for _ in range(PLACES)]
    honest = [await hall.ask("drives/demo/**", "honest") for _ in range(PLACES // 2)]
    assert all(get.said == ["values"] for get in honest)
    assert [get.said for get in greedy] == [["values", "busy"]] * 8 + [["values"]] * 8
    assert (await hall.ask("drives/demo/**", "honest")).said == ["busy"], "each has its share"
    assert (await hall.ask("drives/demo/**", "greedy")).said == ["busy"]
    assert (await hall.ask("drives/demo/**", "third")).said == ["values"]
    await hall.end()
