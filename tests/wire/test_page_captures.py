"""Captures by people who do not wait, or want more of them than there may be."""

from __future__ import annotations

import asyncio
import time
from pathlib import Path

import pytest

from bridge.canopen.frame import Frame
from bridge.northbound.page.bus_page import Captured, IsGone
from bridge.project import load_project
from bridge.service.page import buses as page_buses
from bridge.service.page.buses import Buses
from tests.support.page import Served, message, until

DEMO = Path("bridge/demo/site.toml")
PATH = "/api/bus/can0/capture?seconds=60"


class Bus:
    """Captures until it is told to end, or nobody waits."""

    def __init__(self) -> None:
        self.under_way = 0
        self.captured = Captured(b"(1.0) can0 080#\n")
        self.ends = asyncio.Event()

    async def capture(self, bus: str, seconds: float, form: str, is_gone: IsGone) -> Captured:
        self.under_way += 1
        for _ in range(600):
            if self.ends.is_set() or await is_gone():
                break
            await asyncio.sleep(0.02)
        self.under_way -= 1
        return self.captured


async def waits() -> bool:
    return False


def epoch_ns(at: float) -> int:
    return round(at * 1e9)


class Flood:
    """A bus on which a thousand frames come each time that somebody looks."""

    failure, lost, is_open = "", 0, False

    def open(self) -> None:
        self.is_open = True

    def take(self) -> list[Frame]:
        return [Frame(0x80, b"", 1.0)] * 1000

    def close(self) -> None:
        self.is_open = False


@pytest.fixture
def flood(monkeypatch: pytest.MonkeyPatch) -> Flood:
    made = Flood()
    monkeypatch.setattr(page_buses, "listener_of", lambda *_: made)
    return made


async def test_a_capture_keeps_no_more_than_it_may_and_says_so(
    flood: Flood, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(page_buses, "MOST_CAPTURED", 1500)
    captured = await Buses(load_project(DEMO), epoch_ns).capture("can0", 60.0, "candump", waits)
    assert (captured.content.count(b"\n"), captured.is_cut) == (1500, True)
    monkeypatch.setattr(page_buses, "MOST_CAPTURED", 10_000)
    whole = await Buses(load_project(DEMO), epoch_ns).capture("can0", 0.15, "candump", waits)
    assert (whole.content.count(b"\n") % 1000, whole.is_cut) == (0, False)
    assert not flood.is_open


async def test_a_capture_ends_when_nobody_waits_for_it(flood: Flood) -> None:
    asked = 0

    async def is_gone() -> bool:
        nonlocal asked
        asked += 1
        return asked > 2

    await Buses(load_project(DEMO), epoch_ns).capture("can0", 60.0, "asc", is_gone)
    assert not flood.is_open


async def test_a_session_captures_once_at_a_time() -> None:
    bus = Bus()
    async with Served(capture=bus.capture).serving() as served:
        cookie, _ = await served.login("observer")
        other, _ = await served.login("observer")
        first = asyncio.create_task(served.ask("GET", PATH, Cookie=cookie))
        await until(lambda: bus.under_way == 1)
        assert (await served.ask("GET", PATH, Cookie=cookie)).status == 429
        second = asyncio.create_task(served.ask("GET", PATH, Cookie=other))
        await until(lambda: bus.under_way == 2)
        bus.ends.set()
        assert [(await one).status for one in (first, second)] == [200, 200]
        assert (await served.ask("GET", PATH, Cookie=cookie)).status == 200


async def test_a_capture_ends_when_its_client_has_gone() -> None:
    bus = Bus()
    async with Served(capture=bus.capture).serving() as served:
        cookie, _ = await served.login("observer")
        asking = asyncio.create_task(served.ask("GET", PATH, Cookie=cookie))
        await until(lambda: bus.under_way == 1)
        asking.cancel()
        await until(lambda: bus.under_way == 0)


async def test_a_file_that_was_cut_says_so() -> None:
    bus = Bus()
    bus.captured = Captured(b"x", is_cut=True)
    bus.ends.set()
    async with Served(capture=bus.capture).serving() as served:
        cookie, _ = await served.login("observer")
        answer = await served.ask("GET", PATH, Cookie=cookie)
    assert answer.headers["x-cut"] == "yes"
    assert '-can0-cut.log"' in answer.headers["content-disposition"]


async def test_a_long_file_holds_up_no_tab() -> None:
    bus = Bus()
    line = b"(1700000000.123456) can0 205#7F04000000000000\n"
    bus.captured = Captured(line * 270_000)
    bus.ends.set()
    async with Served(capture=bus.capture).serving() as served:
        cookie, token = await served.login("observer")
        async with served.live(cookie) as tab:
            await tab.send(token)
            await message(tab, "you")
            await tab.send('{"trend": ["bridge/audit_lost"]}')
            asking = asyncio.create_task(served.ask("GET", PATH, Cookie=cookie, Accept_Encoding="gzip"))
            longest_s, last = 0.0, time.monotonic()
            while not asking.done():
                await message(tab, "trend")
                longest_s, last = max(longest_s, time.monotonic() - last), time.monotonic()
            answer = await asking
    assert answer.headers["content-encoding"] == "gzip"
    assert longest_s < 0.4
