"""Tabs under clients that stall, leave or say nothing; the server runs in this process."""

from __future__ import annotations

import asyncio
import contextlib
import json
import socket
import struct
import time
from collections.abc import AsyncGenerator
from pathlib import Path

import pytest
from websockets.exceptions import ConnectionClosed

from bridge.command import Event, EventKind
from bridge.northbound.page import server as page_server
from tests.support.page import Served, Stalled, message, until
from tests.support.quiet import quiet_log

DRIVE = "conveyor/fu1"
_MOST = 40
"""Enough to fill what lies between server and client."""


@pytest.fixture
async def served() -> AsyncGenerator[Served]:
    page = Served()
    page.bound.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 4096)
    async with page.serving():
        yield page


async def fill(tab: Stalled) -> None:
    """Until everything is full for this tab: its connection, and what waits behind that."""
    with contextlib.suppress(OSError):  # it may be cut off meanwhile
        await tab.say({"ask": 1, "target": DRIVE, "action": "take_control", "fields": {"ttl_ms": 1000}})
        for _ in range(_MOST):
            await tab.say({"show": []})
            await tab.say({"show": ["plant", f"drive {DRIVE}", "bus can0"]})
            await asyncio.sleep(0.05)


def given_back(served: Served) -> bool:
    return "release_control" in [str(one.action) for one in served.view.requests]


@pytest.mark.landing(3)
@pytest.mark.parametrize("how", ["logout", "expiry"])
async def test_a_client_that_takes_nothing_holds_up_no_other_tab(served: Served, how: str) -> None:
    cookie, token = await served.login("operator")
    async with served.stalled(cookie, token) as tab:
        await fill(tab)
        if how == "logout":
            began = time.monotonic()
            answer = await served.ask("POST", "/api/logout", Cookie=cookie, X_Token=token)
            assert (answer.status, time.monotonic() - began < 1.0) == (200, True)
        else:
            served.later_s = 3600.0
            await asyncio.sleep(1.2)
        await until(lambda: given_back(served))
        assert await beat_s(served) < 1.0
        await until(lambda: not served.page.shown)


async def beat_s(served: Served) -> float:
    """How long another tab waits for what changes."""
    cookie, token = await served.login("engineer")
    async with served.live(cookie) as tab:
        await tab.send(token)
        await tab.send(json.dumps({"show": ["plant"]}))
        await message(tab, "state")
        began = time.monotonic()
        served.view.image.set(served.view.image.index["bridge/audit_lost"], 2, time.time())
        await message(tab, "changes")
        return time.monotonic() - began


async def test_a_connection_whose_client_takes_nothing_does_not_last(
    served: Served, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(page_server, "_STALLED_S", 0.5)
    cookie, token = await served.login("operator")
    async with served.stalled(cookie, token) as tab:
        await fill(tab)
        await until(lambda: not served.page.shown)
        await asyncio.sleep(0.1)
        assert await tab.is_gone()


async def test_a_tab_that_would_miss_an_outcome_is_closed_instead(served: Served) -> None:
    cookie, token = await served.login("observer")
    async with served.live(cookie) as tab:
        await tab.send(token)
        await message(tab, "you")
        for number in range(1100):
            served.view.happen(Event(0.0, EventKind.WATCHDOG, DRIVE, 500, f"event {number}"))
        with pytest.raises(ConnectionClosed) as closed:
            await message(tab, "nothing")
    assert closed.value.rcvd is not None
    assert closed.value.rcvd.code == 1013


async def closing_code(served: Served, cookie: str, token: str = "") -> int:
    async with served.live(cookie) as tab:
        if token:
            await tab.send(token)
        with pytest.raises(ConnectionClosed) as closed:
            await message(tab, "you")
    return closed.value.rcvd.code if closed.value.rcvd else 0


async def test_a_tab_that_is_refused_is_told_why(served: Served) -> None:
    """A browser shows no code of a connection that was never opened, and its page would try for ever."""
    assert await closing_code(served, "") == 4401
    assert await closing_code(served, "session-8480=nobodys") == 4401
    cookie, _ = await served.login("operator")
    assert await closing_code(served, cookie, "guessed") == 4403


async def test_the_tabs_of_one_session_leave_room_for_others(served: Served) -> None:
    cookie, token = await served.login("operator")
    own, own_token = await served.login("observer")
    async with contextlib.AsyncExitStack() as stack:
        for _ in range(16):
            tab = await stack.enter_async_context(served.live(cookie))
            await tab.send(token)
            await message(tab, "you")
        assert await closing_code(served, cookie, "guessed") == 4403, "its token comes first"
        assert await closing_code(served, cookie, token) == 4429
        other = await stack.enter_async_context(served.live(own))
        await other.send(own_token)
        await message(other, "you")


async def test_four_logins_of_an_observer_leave_room_for_the_engineer(served: Served) -> None:
    async with contextlib.AsyncExitStack() as stack:
        refused = 0
        for _ in range(4):
            cookie, token = await served.login("observer")
            for _ in range(16):
                tab = await stack.enter_async_context(served.live(cookie))
                await tab.send(token)
                try:
                    await message(tab, "you")
                except ConnectionClosed:
                    refused += 1
        assert refused == 48, "however often one user logs in"
        cookie, token = await served.login("engineer")
        tab = await stack.enter_async_context(served.live(cookie))
        await tab.send(token)
        await message(tab, "you")


@pytest.mark.landing(2)
@pytest.mark.parametrize("says", [b"", b"GET / HTTP/1.1\r\n", b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n"])
async def test_idle_connections_keep_nobody_out(served: Served, says: bytes) -> None:
    """Those that say nothing, half a head, or nothing more; the log has one line."""
    with quiet_log() as log:
        async with contextlib.AsyncExitStack() as stack:
            for _ in range(400):
                _, writer = await asyncio.open_connection("127.0.0.1", served.port)
                stack.callback(writer.close)
                writer.write(says)
            began = time.monotonic()
            statuses = [(await served.ask("GET", "/static/js/main.js")).status for _ in range(60)]
            assert set(statuses) == {200}
            cookie, token = await served.login("engineer")
            tab = await stack.enter_async_context(served.live(cookie))
            await tab.send(token)
            await message(tab, "you")
            assert time.monotonic() - began < 10.0
    told = [line for line in log.lines if "127.0.0.1" in line and "page:" in line and "logged in" not in line]
    assert told == ["page: connections that made room from 127.0.0.1: it was missed least"]


async def test_a_front_that_is_started_anew_knows_who_has_logged_in(tmp_path: Path) -> None:
    before = Served(kept=tmp_path / "page.sessions")
    async with before.serving():
        cookie, token = await before.login("engineer")
    after = Served(kept=tmp_path / "page.sessions")
    async with after.serving(), after.live(cookie) as tab:
        await tab.send(token)
        await message(tab, "you")
        answer = await after.ask("POST", "/api/logout", Cookie=cookie, X_Token=token)
        assert answer.status == 200


async def test_a_session_that_ends_before_its_token_comes_is_over(served: Served) -> None:
    cookie, token = await served.login("operator")
    async with served.live(cookie) as tab:
        await served.ask("POST", "/api/logout", Cookie=cookie, X_Token=token)
        await tab.send(token)
        with pytest.raises(ConnectionClosed) as closed:
            await message(tab, "you")
    assert closed.value.rcvd is not None
    assert closed.value.rcvd.code == 4401


async def test_a_tab_is_told_the_time_once_a_second(served: Served) -> None:
    cookie, token = await served.login("observer")
    async with served.live(cookie) as tab:
        await tab.send(token)
        await message(tab, "you")
        first, second = [(await message(tab, "now"))["now"] for _ in range(2)]
    assert second - first == pytest.approx(1000, abs=300)
    assert abs(time.time() * 1000 - second) < 1000


async def test_a_new_tab_gets_what_has_happened_in_one_message(served: Served) -> None:
    for number in range(250):
        served.view.happen(Event(0.0, EventKind.WATCHDOG, DRIVE, 500, f"event {number}"))
    cookie, token = await served.login("observer")
    async with served.live(cookie) as tab:
        await tab.send(token)
        told = (await message(tab, "events"))["events"]
        assert [one["message"] for one in told] == [f"event {number}" for number in range(50, 250)]
        served.view.happen(Event(0.0, EventKind.WATCHDOG, DRIVE, 500, "one more"))
        assert (await message(tab, "event"))["event"]["message"] == "one more"


async def test_rows_of_a_trend_have_the_number_of_their_choice(served: Served) -> None:
    cookie, token = await served.login("observer")
    async with served.live(cookie) as tab:
        await tab.send(token)
        names = ["bridge/audit_lost", f"{DRIVE}/supervision/trips", f"{DRIVE}/supervision/last_fault"]
        for number in range(1, 30):
            chosen = names[: number % 3 + 1]
            await tab.send(json.dumps({"trend": chosen, "number": number}))
            await asyncio.sleep(0.03)
        widths = [await message(tab, "trend") for _ in range(8)]
        assert all(len(row) == one["number"] % 3 + 2 for one in widths for row in one["trend"])
        await tab.send(json.dumps({"trend": names}))
        while (await message(tab, "trend"))["number"]:
            pass


async def test_a_trouble_that_the_bus_process_tells_is_told_soon(served: Served) -> None:
    image, place = served.view.image, served.view.image.index["bridge/troubles"]
    said = {"rank": "danger", "kind": "ignores_stop", "place": DRIVE, "since": 1000, "facts": {}}
    cookie, token = await served.login("observer")
    image.set(place, json.dumps([said]), 1.0)
    await asyncio.sleep(1.5)
    async with served.live(cookie) as tab:
        await tab.send(token)
        assert (await message(tab, "troubles"))["troubles"] == [said], "also when nobody has looked"
        image.set(place, "[]", 2.0)
        began = time.monotonic()
        told = await message(tab, "troubles")
        assert time.monotonic() - began < 0.6
        assert (told["troubles"], told["waiting"], told["recent"]) == ([], 0, [])


async def test_a_client_that_leaves_at_any_moment_is_no_failure(
    served: Served, caplog: pytest.LogCaptureFixture
) -> None:
    cookie, token = await served.login("operator")
    for first in ("guessed", token):
        async with served.stalled(cookie, first) as tab:
            tab.sock.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    async with served.live(cookie) as leaving:
        await leaving.send(token)
        await message(leaving, "you")
        leaving.transport.abort()
        answer = await served.ask("POST", "/api/logout", Cookie=cookie, X_Token=token)
    assert answer.status == 200
    await until(lambda: not served.page.shown)
    assert not [one for one in caplog.records if one.levelname == "ERROR"]


async def test_a_logout_closes_the_tabs_of_its_session_with_a_code(served: Served) -> None:
    cookie, token = await served.login("operator")
    async with served.live(cookie) as tab:
        await tab.send(token)
        await message(tab, "you")
        await served.ask("POST", "/api/logout", Cookie=cookie, X_Token=token)
        with pytest.raises(ConnectionClosed) as closed:
            await message(tab, "nothing")
    assert closed.value.rcvd is not None
    assert closed.value.rcvd.code == 4401
