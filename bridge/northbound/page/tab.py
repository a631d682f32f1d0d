"""WebSocket of one tab, with a queue of its own: a client that takes nothing holds up nobody else."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from contextlib import suppress
from typing import Any, Final

from starlette.websockets import WebSocket, WebSocketDisconnect

from bridge.northbound.page.sessions import PageSession
from bridge.northbound.page.viewer import Viewer
from bridge.northbound.view import View

_MOST_WAITING: Final = 8
"""Most messages that a tab has not taken yet; with one more it gets the whole state instead."""
_MOST_OUTCOMES: Final = 1000
_CLOSE_S: Final = 2.0
"""Longest time for a client to take the reason of its closing, seconds."""
SESSION_OVER: Final = 4401
NO_TOKEN: Final = 4403
TOO_MANY: Final = 4429
BAD_MESSAGE: Final = 1008
TOO_SLOW: Final = 1013
GONE: Final = (WebSocketDisconnect, RuntimeError, OSError)
"""Errors that are raised where the client has gone, or is being closed already."""


async def close(socket: WebSocket, code: int, reason: str = "") -> None:
    """Close the socket, if the client is still there; one that takes nothing is given up after
    ``_CLOSE_S``."""
    with suppress(*GONE):
        async with asyncio.timeout(_CLOSE_S):
            await socket.close(code, reason)


class Tab:
    """One open tab. ``since_ms`` is when it was opened, in ms since 1970."""

    def __init__(self, socket: WebSocket, session: PageSession, view: View, since_ms: float) -> None:
        self.since_ms = round(since_ms)
        self.session = session
        address = socket.client.host if socket.client else ""
        self.viewer = Viewer(view, session.user, session.role, address, self.tell)
        self.rows: list[list[Any]] = []
        self._socket = socket
        self._queue = asyncio.Queue[bytes](_MOST_OUTCOMES)
        self._is_behind = False
        self._listening: asyncio.Task[None] | None = None
        self._closing: asyncio.Task[None] | None = None

    @property
    def is_closing(self) -> bool:
        return self._closing is not None

    def tell(self, data: bytes) -> None:
        """Queue a message. A tab for which ``_MOST_OUTCOMES`` messages wait already is closed: it would wait
        for ever for an outcome that is left out."""
        if self._closing:
            return
        if self._queue.full():
            self.close(TOO_SLOW, "too slow")
            return
        self._queue.put_nowait(data)

    def show(self, data: bytes) -> None:
        """Like ``tell``, but left out where much waits already: the whole state will follow instead."""
        if self._queue.qsize() >= _MOST_WAITING:
            self._is_behind = True
        elif not self._is_behind:
            self.tell(data)

    def has_caught_up(self) -> bool:
        """True once after it was behind and has taken everything."""
        if self._is_behind and self._queue.empty():
            self._is_behind = False
            return True
        return False

    def close(self, code: int, reason: str = "") -> None:
        """Give back the drives it controls, and close it soon, whether its client takes that or not."""
        if self._closing is None:
            self._closing = asyncio.create_task(self._close(code, reason), name="closing a tab")
            self.viewer.leave()

    async def serve(self, on_message: Callable[[str], None]) -> None:
        """Serve the tab until it is closed."""
        sending = asyncio.create_task(self._send_all(), name="messages to a tab")
        self._listening = asyncio.create_task(self._listen(on_message), name="messages of a tab")
        try:
            await asyncio.wait([self._listening])
            if self._closing:
                await asyncio.wait([self._closing])
        finally:
            self.viewer.leave()
            for task in (sending, self._listening, self._closing):
                if task:
                    task.cancel()
        if not self._listening.cancelled():
            self._listening.result()

    async def _listen(self, on_message: Callable[[str], None]) -> None:
        with suppress(*GONE, KeyError):  # KeyError: bytes where text is due
            while True:
                data = await self._socket.receive_text()
                if self._closing is None:
                    on_message(data)

    async def _send_all(self) -> None:
        with suppress(*GONE):
            while True:
                await self._socket.send_text((await self._queue.get()).decode())

    async def _close(self, code: int, reason: str) -> None:
        await close(self._socket, code, reason)
        if self._listening:
            self._listening.cancel()
