"""A bus for people who look at it: its nodes with the layout of their PDOs, and a capture as a file."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final

import msgspec
from starlette.requests import Request
from starlette.responses import JSONResponse, Response, StreamingResponse
from starlette.routing import Route

from bridge.base.errors import OperationFailed
from bridge.northbound.page.refused import refused
from bridge.northbound.page.sessions import PageSession
from bridge.text import Text

LONGEST_S: Final = 60
_MOST_AT_ONCE: Final = 4
_MEDIA: Final = {"candump": "log", "asc": "asc"}
_PART: Final = 65_536
_encode = msgspec.json.Encoder().encode


@dataclass(frozen=True, slots=True)
class Captured:
    """Content of a captured file. ``is_cut`` is true where more came than is kept: the file ends before its
    time."""

    content: bytes
    is_cut: bool = False


IsGone = Callable[[], Awaitable[bool]]
"""True once nobody waits for the capture any more."""
Capture = Callable[[str, float, str, IsGone], Awaitable[Captured]]
"""Captures a bus for so many seconds into a file of this format. Raises ``OperationFailed``."""


class BusPage:
    """``layouts`` has for each bus what ``layout`` of the page draws; ``session_of`` says who asks."""

    def __init__(
        self,
        site: str,
        layouts: Mapping[str, Any],
        capture: Capture,
        session_of: Callable[[Request], PageSession | None],
    ) -> None:
        self._site = site
        self._layouts = layouts
        self._capture = capture
        self._session_of = session_of
        self._capturing: list[PageSession] = []
        self.routes = [
            Route("/api/bus/{bus}", self._layout),
            Route("/api/bus/{bus}/capture", self._captured),
        ]

    def _refusal(self, request: Request) -> Response | None:
        if self._session_of(request) is None:
            return JSONResponse({"error": "login"}, 401)
        if request.path_params["bus"] not in self._layouts:
            return refused(404, Text.of("page.there_is", known=tuple(self._layouts)))
        return None

    async def _layout(self, request: Request) -> Response:
        if refusal := self._refusal(request):
            return refusal
        layout = _encode(self._layouts[request.path_params["bus"]])
        return Response(layout, headers={"cache-control": "no-cache"}, media_type="application/json")

    async def _captured(self, request: Request) -> Response:
        """``seconds`` of the bus, 1 … 60, as a file in ``format``: candump or asc. One of each session at a
        time. ``-cut`` in the file's name, and ``x-cut``, say that it ends early, being too long."""
        session = self._session_of(request)
        refusal = self._refusal(request)
        if session is None or refusal:
            return refusal or JSONResponse({"error": "login"}, 401)
        form = request.query_params.get("format", "candump")
        seconds = _seconds(request.query_params.get("seconds", ""))
        if form not in _MEDIA or not 1 <= seconds <= LONGEST_S:
            allowed = Text.of("page.capture_bounds", longest_s=LONGEST_S, formats=tuple(_MEDIA))
            return refused(422, allowed)
        if len(self._capturing) >= _MOST_AT_ONCE or session in self._capturing:
            return refused(429, Text.of("page.capture_busy"))
        bus = request.path_params["bus"]
        self._capturing.append(session)
        try:
            captured = await self._capture(bus, seconds, form, request.is_disconnected)
        except OperationFailed as error:
            return refused(503, error.said)
        finally:
            self._capturing.remove(session)
        return self._file(captured, bus, _MEDIA[form])

    def _file(self, captured: Captured, bus: str, suffix: str) -> Response:
        name = f"{self._site}-{bus}{'-cut' if captured.is_cut else ''}.{suffix}"
        headers = {"content-disposition": f'attachment; filename="{name}"', "cache-control": "no-store"}
        if captured.is_cut:
            headers["x-cut"] = "yes"
        return StreamingResponse(_parts(captured.content), headers=headers, media_type="text/plain")


def _seconds(text: str) -> int:
    """Seconds of a capture as the request gives them; 0 where that is no such number."""
    return int(text) if text.isdecimal() and len(text) <= len(str(LONGEST_S)) else 0


async def _parts(content: bytes) -> AsyncIterator[bytes]:
    """The file in parts: compressed as a whole, a long one would hold up every tab."""
    for begin in range(0, len(content), _PART):
        yield content[begin : begin + _PART]
        await asyncio.sleep(0)
