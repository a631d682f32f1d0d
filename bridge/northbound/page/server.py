"""The page's HTTP server: uvicorn on a socket that is bound already, with the limits that it lacks."""

from __future__ import annotations

import asyncio
import contextlib
import socket
import ssl
import time
from collections.abc import Generator
from typing import Any, Final

import uvicorn
from uvicorn.protocols.http.h11_impl import H11Protocol, RequestResponseCycle
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol

from bridge.base.errors import OperationFailed
from bridge.base.notices import teller
from bridge.base.sources import source_of
from bridge.northbound.listening import until_deaf
from bridge.northbound.page.guards import MOST_HEAD
from bridge.northbound.page.shares import MOST_CONNECTIONS, Connections, Doing
from bridge.northbound.page.viewer import MOST_BYTES
from bridge.northbound.page.web import Page

_HEADERS_S: Final = 10.0
"""Longest time for the head of a request to come, the first of a connection included, seconds."""
_IDLE_S: Final = 30
_STALLED_S: Final = 20.0
"""Longest time in which a tab takes nothing while its connection's buffers are full, seconds."""
_CLOSING_S: Final = 12.0
"""Longest time that a tab's connection lasts once nothing is served on it any more, seconds: uvicorn waits 10
s for the client's part of closing it."""


class _HttpProtocol(H11Protocol):
    """HTTP/1.1 with limits: uvicorn waits for ever for the head of a request, begun or not, and serves
    connections first come, first served."""

    _shares: Connections[asyncio.Transport]
    """Connections of this server: each server has a subclass of its own, which holds them."""
    _deadline: asyncio.TimerHandle | None = None

    def connection_made(self, transport: Any) -> None:
        super().connection_made(transport)
        self._expect_head()
        address = source_of(self.client[0] if self.client else "")
        if not self._shares.opened(transport, address):
            transport.abort()

    def data_received(self, data: bytes) -> None:
        before = self._request
        super().data_received(data)
        if self._request is not before or self.transport.get_protocol() is not self:
            self._forget()  # its head is here, or that of a WebSocket, which another protocol serves
            is_live = self.transport.get_protocol() is not self
            self._does(Doing.UNPROVED if is_live else Doing.BUSY)

    def on_response_complete(self) -> None:
        super().on_response_complete()
        if not self.transport.is_closing() and (self._request is None or self._request.response_complete):
            self._expect_head(_IDLE_S + _HEADERS_S)
            self._does(Doing.KEPT)

    def _does(self, doing: Doing) -> None:
        self._shares.does(self.transport, doing)

    def connection_lost(self, exc: Exception | None) -> None:
        self._forget()
        self._shares.closed(self.transport)
        super().connection_lost(exc)

    @property
    def _request(self) -> RequestResponseCycle | None:
        """Newest request, None before the first."""
        return self.cycle

    def _expect_head(self, limit_s: float = _HEADERS_S) -> None:
        self._forget()
        self._deadline = asyncio.get_running_loop().call_later(limit_s, self.transport.close)

    def _forget(self) -> None:
        deadline, self._deadline = self._deadline, None
        if deadline:
            deadline.cancel()


class _LiveProtocol(WebSocketsSansIOProtocol):
    """WebSocket with limits: uvicorn waits for ever for a client that takes nothing, even to close its
    connection."""

    _shares: Connections[asyncio.Transport]
    _deadline: asyncio.TimerHandle | None = None
    _is_ending = False

    def pause_writing(self) -> None:
        super().pause_writing()
        if not self._is_ending:
            self._abort_in(_STALLED_S)

    def resume_writing(self) -> None:
        super().resume_writing()
        if not self._is_ending:
            self._forget()

    def connection_lost(self, exc: Exception | None) -> None:
        self._forget()
        self._shares.closed(self.transport)
        super().connection_lost(exc)

    async def run_asgi(self) -> None:
        await super().run_asgi()
        self._is_ending = True
        if self in self.connections:
            self._abort_in(_CLOSING_S)

    def _abort_in(self, limit_s: float) -> None:
        self._forget()
        self._deadline = asyncio.get_running_loop().call_later(limit_s, self.transport.abort)

    def _forget(self) -> None:
        deadline, self._deadline = self._deadline, None
        if deadline:
            deadline.cancel()


class _HttpServer(uvicorn.Server):
    @contextlib.contextmanager
    def capture_signals(self) -> Generator[None]:
        """Leave signals alone: they are our process's own."""
        yield


class PageServer:
    """Serves ``page`` on ``bound``. ``certificate`` and ``private_key`` are files; without them in clear."""

    def __init__(
        self, page: Page, bound: socket.socket, certificate: str | None = None, private_key: str | None = None
    ) -> None:
        self._bound = bound
        shares = {
            "_shares": Connections[asyncio.Transport](
                lambda transport: transport.abort(), teller("page"), time.monotonic
            )
        }
        config = uvicorn.Config(
            page.app,
            http=type("_Shared", (_HttpProtocol,), shares),
            ws=type("_SharedLive", (_LiveProtocol,), shares),
            ws_max_size=MOST_BYTES,
            ws_ping_interval=20.0,
            ws_ping_timeout=20.0,
            lifespan="on",
            log_config=None,
            log_level="warning",
            access_log=False,
            server_header=False,
            date_header=False,
            proxy_headers=False,
            # Beyond our own limit, which closes those that do least: connections end a moment later.
            limit_concurrency=4 * MOST_CONNECTIONS,
            timeout_keep_alive=_IDLE_S,
            timeout_graceful_shutdown=2,
            h11_max_incomplete_event_size=MOST_HEAD,
            ssl_certfile=certificate,
            ssl_keyfile=private_key,
            ssl_version=ssl.PROTOCOL_TLS_SERVER,
        )
        self._server = _HttpServer(config)
        self._serving: asyncio.Task[None] | None = None

    @property
    def port(self) -> int:
        return self._bound.getsockname()[1]

    async def start(self) -> None:
        """Begin to serve. Raises ``OperationFailed`` where that fails."""
        serving = self._serving = asyncio.create_task(
            self._server.serve(sockets=[self._bound]), name="page server"
        )
        while not self._server.started:
            if serving.done():
                raise OperationFailed("the page cannot be served")
            await asyncio.sleep(0.02)

    async def close(self) -> None:
        self._server.should_exit = True
        if self._serving:
            with contextlib.suppress(asyncio.CancelledError):
                await self._serving

    async def failed(self) -> None:
        """Wait until closed, or raise ``OperationFailed`` where it serves no more."""
        await until_deaf(self._bound, "page.listen")
