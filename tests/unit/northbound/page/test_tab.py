"""One tab of the page: what waits for it, when it is behind, and how it is closed."""

from __future__ import annotations

import asyncio
from types import SimpleNamespace
from typing import Any, cast

import pytest
from starlette.websockets import WebSocket, WebSocketDisconnect

from bridge.command import Role
from bridge.northbound.page.sessions import PageSession
from bridge.northbound.page.tab import TOO_SLOW, Tab, close
from bridge.northbound.view import View
from tests.support import sites
from tests.support.views import view_of

SITE = sites.site(sites.bus(sites.node(sites.drive("fu1", "lease", 1000))))


class Socket:
    """A client that takes what it is sent while ``takes`` is set."""

    def __init__(self) -> None:
        self.client = SimpleNamespace(host="10.0.0.1")
        self.takes = asyncio.Event()
        self.takes.set()
        self.sent: list[str] = []
        self.closed: list[tuple[int, str]] = []
        self.says = asyncio.Queue[str | Exception]()

    async def send_text(self, text: str) -> None:
        await self.takes.wait()
        self.sent.append(text)

    async def receive_text(self) -> str:
        said = await self.says.get()
        if isinstance(said, Exception):
            raise said
        return said

    async def close(self, code: int, reason: str) -> None:
        self.closed.append((code, reason))


class Case:
    def __init__(self) -> None:
        self.socket = Socket()
        session = cast("PageSession", SimpleNamespace(user="ann", role=Role.OPERATOR))
        view: Any = view_of(sites.plant_of(SITE))
        self.tab = Tab(cast("WebSocket", self.socket), session, cast("View", view), 1234.4)
        self.heard: list[str] = []

    def begin(self) -> asyncio.Task[None]:
        return asyncio.create_task(self.tab.serve(self.heard.append))


async def turns(number: int = 20) -> None:
    for _ in range(number):
        await asyncio.sleep(0)


async def test_what_is_told_is_sent_in_its_order_and_what_is_said_is_heard() -> None:
    case = Case()
    serving = case.begin()
    for number in range(3):
        case.tab.tell(str(number).encode())
    await turns()
    assert case.socket.sent == ["0", "1", "2"]
    case.socket.says.put_nowait("hello")
    case.socket.says.put_nowait(WebSocketDisconnect())
    await asyncio.wait_for(serving, 5)
    assert case.heard == ["hello"]
    assert case.tab.since_ms == 1234


async def test_one_that_takes_nothing_is_behind_and_gets_the_state_when_it_has_caught_up() -> None:
    case = Case()
    for number in range(20):
        case.tab.show(str(number).encode())
    assert not case.tab.has_caught_up()
    serving = case.begin()
    await turns()
    assert case.socket.sent == [str(number) for number in range(8)]
    assert case.tab.has_caught_up()
    assert not case.tab.has_caught_up(), "once"
    case.socket.says.put_nowait(WebSocketDisconnect())
    await asyncio.wait_for(serving, 5)


async def test_an_outcome_is_never_left_out_and_one_that_takes_none_is_closed() -> None:
    case = Case()
    for number in range(1000):
        case.tab.tell(str(number).encode())
    assert not case.tab.is_closing
    case.tab.tell(b"one more")
    assert case.tab.is_closing
    await turns()
    assert case.socket.closed == [(TOO_SLOW, "too slow")]


async def test_it_is_closed_once_and_nothing_is_heard_after_that() -> None:
    case = Case()
    serving = case.begin()
    await turns()
    case.tab.close(4401, "over")
    case.tab.close(4429, "again")
    case.socket.says.put_nowait("late")
    await asyncio.wait_for(serving, 5)
    assert case.socket.closed == [(4401, "over")]
    assert case.heard == []


@pytest.mark.parametrize("error", [WebSocketDisconnect(), RuntimeError("closed"), OSError()])
async def test_who_has_gone_needs_no_goodbye(error: Exception) -> None:
    socket = Socket()

    async def gone(code: int, reason: str) -> None:
        socket.closed.append((code, reason))
        raise error

    socket.close = gone  # type: ignore[method-assign]
    await close(cast("WebSocket", socket), 4401)
    assert [code for code, _ in socket.closed] == [4401], "it was tried, once"
