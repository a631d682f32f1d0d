"""A bus for people who look at it: its nodes with the layout of their PDOs, and a capture as a file."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping
from typing import Any, Final

import msgspec
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route

from bridge.errors import OperationFailed

LONGEST_S: Final = 60
_MOST_AT_ONCE: Final = 4
_MEDIA: Final = {"candump": "log", "asc": "asc"}
_encode = msgspec.json.Encoder().encode

Capture = Callable[[str, float, str], Awaitable[str]]
"""Listens to this bus for so many seconds; the text of a file in this format. Raises ``OperationFailed``."""


class Bus:
    """``layouts`` has for each bus what ``layout`` of the page draws; ``is_inside`` says who may read."""

    def __init__(
        self,
        site: str,
        layouts: Mapping[str, Any],
        capture: Capture,
        is_inside: Callable[[Request], bool],
    ) -> None:
        self._site = site
        self._layouts = layouts
        self._capture = capture
        self._is_inside = is_inside
        self._captures = 0
        self.routes = [
            Route("/api/bus/{bus}", self._layout),
            Route("/api/bus/{bus}/capture", self._captured),
        ]

    def _refusal(self, request: Request) -> Response | None:
        if not self._is_inside(request):
            return JSONResponse({"error": "login"}, 401)
        if request.path_params["bus"] not in self._layouts:
            return JSONResponse({"error": f"there is {', '.join(self._layouts)}"}, 404)
        return None

    async def _layout(self, request: Request) -> Response:
        if refusal := self._refusal(request):
            return refusal
        layout = _encode(self._layouts[request.path_params["bus"]])
        return Response(layout, headers={"cache-control": "no-cache"}, media_type="application/json")

    async def _captured(self, request: Request) -> Response:
        """``seconds`` of the bus, 1 … 60, as a file in ``format``: candump or asc."""
        if refusal := self._refusal(request):
            return refusal
        form = request.query_params.get("format", "candump")
        seconds = request.query_params.get("seconds", "")
        if form not in _MEDIA or not seconds.isdecimal() or not 1 <= int(seconds) <= LONGEST_S:
            allowed = f"seconds = 1…{LONGEST_S}, format = {' or '.join(_MEDIA)}"
            return JSONResponse({"error": allowed}, 422)
        if self._captures >= _MOST_AT_ONCE:
            return JSONResponse({"error": "too many captures at a time"}, 429)
        bus = request.path_params["bus"]
        self._captures += 1
        try:
            text = await self._capture(bus, float(seconds), form)
        except OperationFailed as error:
            return JSONResponse({"error": str(error)}, 503)
        finally:
            self._captures -= 1
        name = f"{self._site}-{bus}.{_MEDIA[form]}"
        headers = {"content-disposition": f'attachment; filename="{name}"', "cache-control": "no-store"}
        return Response(text, headers=headers, media_type="text/plain")
