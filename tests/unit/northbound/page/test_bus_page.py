"""A bus for people who look at it: its layout, captures within bounds, and one of each session at a time."""

from __future__ import annotations

import asyncio
import json
from typing import Any, cast

import pytest
from starlette.requests import Request
from starlette.responses import Response, StreamingResponse

from bridge.base.errors import OperationFailed
from bridge.northbound.page.bus_page import BusPage, Captured, IsGone
from bridge.northbound.page.sessions import PageSession


class Case:
    def __init__(self) -> None:
        self.session: PageSession | None = cast("PageSession", object())
        self.asked: list[tuple[str, float, str]] = []
        self.gate = asyncio.Event()
        self.gate.set()
        self.captured: Captured | OperationFailed = Captured(b"frames")
        self.bus = BusPage("hall", {"can0": {"nodes": []}}, self._capture, lambda request: self.session)

    async def _capture(self, bus: str, seconds: float, form: str, is_gone: IsGone) -> Captured:
        self.asked.append((bus, seconds, form))
        await self.gate.wait()
        if isinstance(self.captured, OperationFailed):
            raise self.captured
        return self.captured

    async def get(self, path: str, bus: str = "can0", query: str = "") -> Response:
        (route,) = (route for route in self.bus.routes if route.path == path)
        scope: dict[str, Any] = {"type": "http", "method": "GET", "path": path, "headers": []}
        return await route.endpoint(
            Request({**scope, "path_params": {"bus": bus}, "query_string": query.encode()})
        )

    async def capture(self, query: str = "seconds=5", bus: str = "can0") -> Response:
        return await self.get("/api/bus/{bus}/capture", bus, query)


async def content(answer: Response) -> bytes:
    assert isinstance(answer, StreamingResponse)
    return b"".join([bytes(cast("bytes", part)) async for part in answer.body_iterator])


def told(answer: Response) -> str:
    return json.loads(bytes(answer.body))["error"]


async def test_who_is_not_logged_in_gets_nothing() -> None:
    case = Case()
    case.session = None
    assert (await case.get("/api/bus/{bus}")).status_code == 401
    assert (await case.capture()).status_code == 401
    assert case.asked == []


async def test_a_layout_is_that_of_its_bus() -> None:
    case = Case()
    assert json.loads(bytes((await case.get("/api/bus/{bus}")).body)) == {"nodes": []}
    answer = await case.get("/api/bus/{bus}", "can7")
    assert (answer.status_code, told(answer)) == (404, "there is can0")


async def test_a_capture_is_a_file_named_by_site_and_bus() -> None:
    case = Case()
    answer = await case.capture("seconds=60&format=asc")
    assert case.asked == [("can0", 60, "asc")]
    assert answer.headers["content-disposition"] == 'attachment; filename="hall-can0.asc"'
    assert "x-cut" not in answer.headers
    assert await content(answer) == b"frames"


async def test_one_that_ends_early_says_so() -> None:
    case = Case()
    case.captured = Captured(b"x" * 200_000, is_cut=True)
    answer = await case.capture()
    assert answer.headers["content-disposition"] == 'attachment; filename="hall-can0-cut.log"'
    assert answer.headers["x-cut"] == "yes"
    assert await content(answer) == b"x" * 200_000


@pytest.mark.parametrize(
    "query",
    ["", "seconds=0", "seconds=61", "seconds=-5", "seconds=5.5", "seconds=5&format=pcap"],
)
async def test_bounds_of_a_capture_are_told(query: str) -> None:
    case = Case()
    answer = await case.capture(query)
    assert answer.status_code == 422
    assert told(answer) == "seconds = 1…60, format = candump or asc"
    assert case.asked == []


async def test_a_session_captures_once_at_a_time_and_four_do_together() -> None:
    case = Case()
    case.gate.clear()
    tasks: list[asyncio.Task[Response]] = []
    for _ in range(4):
        case.session = cast("PageSession", object())
        tasks.append(asyncio.create_task(case.capture()))
        await asyncio.sleep(0)
    assert (await case.capture()).status_code == 429, "its own goes on"
    case.session = cast("PageSession", object())
    assert (await case.capture()).status_code == 429, "there are four"
    case.gate.set()
    assert [(await task).status_code for task in tasks] == [200] * 4
    assert (await case.capture()).status_code == 200


async def test_a_bus_that_cannot_be_heard_says_why_and_makes_room() -> None:
    case = Case()
    for _ in range(5):
        case.captured = OperationFailed("nobody drives can0")
        answer = await case.capture()
        assert (answer.status_code, told(answer)) == (503, "nobody drives can0")
