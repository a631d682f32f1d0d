"""The gateway's sockets: a Unix socket in the runtime folder and, where the site says so, TCP on loopback."""

from __future__ import annotations

import asyncio
import logging
import os
import socket
from collections.abc import Callable
from pathlib import Path
from typing import Final, cast

from bridge.base.admission import Admission, ConnectionStage, Limits, Visitor
from bridge.base.errors import Unavailable
from bridge.base.notices import teller
from bridge.base.quietlog import log_source
from bridge.command import Identity, Role, Source
from bridge.northbound.gateway.gateway_session import GatewaySession, Net
from bridge.northbound.listening import ListeningSocket, listen, until_deaf
from bridge.northbound.view import View

_log = logging.getLogger(__name__)

MOST_CLIENTS: Final = 4
"""Most clients of one bus: with the requests that each may have at once they fill half of an SDO queue, and
leave the other half to others."""
_READ_MOST: Final = 512
"""Bytes that are handled before others get their turn: some thirty lines, less than a millisecond."""
_UNREAD_MOST: Final = 256 * 1024
_LONGEST_PATH: Final = 100
_BACKLOG: Final = 8
_KEY: Final = "bus.gateway"


class GatewayServer:
    """Serves one bus. ``endpoint`` is a TCP address, or None; ``clock`` gives monotonic seconds.

    Who reaches the Unix socket is an engineer: folder and socket belong to the service's own user. Whoever
    connects by TCP is an operator who sets no parameters.
    """

    def __init__(
        self, view: View, net: Net, path: Path, endpoint: str | None, clock: Callable[[], float]
    ) -> None:
        self._view = view
        self._net = net
        self._path = path
        self._endpoint = endpoint
        self._clock = clock
        self._servers: list[asyncio.Server] = []
        self._sockets: list[socket.socket] = []
        self._clients: set[_Client] = set()
        # Who has sent nothing yet makes room for who may; those at work do not.
        limits = Limits(MOST_CLIENTS, MOST_CLIENTS, MOST_CLIENTS)
        self._admission = Admission(limits, teller(f"gateway of {net.target}"))

    @property
    def port(self) -> int | None:
        """TCP port, None where it is not served by TCP."""
        return self._sockets[1].getsockname()[1] if len(self._sockets) > 1 else None

    async def start(self) -> None:
        """Listen, or listen again after ``failed``. Raises ``Unavailable`` with advice."""
        self._stop_listening()
        loop = asyncio.get_running_loop()
        self._sockets = [self._unix_socket()]
        if self._endpoint is not None:
            self._sockets.append(listen(self._endpoint, _KEY))
        for place, sock in enumerate(self._sockets):
            sock.setblocking(False)
            who = self._tcp_client if place else self._local_client
            serve = loop.create_server if place else loop.create_unix_server
            self._servers.append(await serve(lambda who=who: _Client(self, who()), sock=sock))
        _log.info("gateway on %s%s", self._path, f" and {self._endpoint}" if self._endpoint else "")

    def _unix_socket(self) -> socket.socket:
        if len(os.fsencode(str(self._path))) > _LONGEST_PATH:
            raise Unavailable(f"{self._path} is too long for a socket; choose a shorter runtime_dir")
        sock = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            self._path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
            self._path.unlink(missing_ok=True)
            sock.bind(str(self._path))
            self._path.chmod(0o600)
            sock.listen(_BACKLOG)
        except OSError as error:
            sock.close()
            raise Unavailable(f"{_KEY}: {self._path}: {error.strerror}") from error
        return ListeningSocket(sock.detach(), _KEY)

    async def failed(self) -> None:
        """Wait until nobody can connect any more, then raise ``OperationFailed``."""
        waits = [asyncio.create_task(until_deaf(sock, _KEY)) for sock in self._sockets]
        try:
            await asyncio.gather(*waits)
        finally:
            for wait in waits:
                wait.cancel()

    async def close(self) -> None:
        """Stop listening and end every connection."""
        self._stop_listening()
        for client in tuple(self._clients):
            client.abort()
        self._path.unlink(missing_ok=True)

    def _stop_listening(self) -> None:
        for server in self._servers:
            server.close()
        for sock in self._sockets:
            sock.close()
        self._servers, self._sockets = [], []

    @staticmethod
    def _local_client() -> Identity:
        return Identity(Source.LOCAL, "gateway", Role.ENGINEER)

    @staticmethod
    def _tcp_client() -> Identity:
        return Identity(Source.LOCAL, "gateway-tcp", Role.OPERATOR)

    # what clients ask

    def admit(self, client: _Client, on_lines: Callable[[], None]) -> GatewaySession | None:
        """None where there are clients enough."""
        visitor = Visitor(client.identity.user, self._clock(), client.stage, client.abort)
        if not self._admission.admit(visitor, visitor.since):
            return None
        client.visitor = visitor
        self._clients.add(client)
        return GatewaySession(self._net, client.identity, self._view.submit, on_lines)

    def leave(self, client: _Client) -> None:
        self._clients.discard(client)
        if client.visitor is not None:
            self._admission.leave(client.visitor)

    def now(self) -> float:
        return self._clock()


class _Client(asyncio.BufferedProtocol):
    """One connection."""

    def __init__(self, server: GatewayServer, identity: Identity) -> None:
        self.identity = identity
        self.visitor: Visitor | None = None
        """Its place among the connections, while it has one."""
        self._has_spoken = False
        self._server = server
        self._buffer = bytearray(_READ_MOST)
        self._transport: asyncio.Transport | None = None
        self._session: GatewaySession | None = None
        self._timer: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._transport = cast("asyncio.Transport", transport)
        self._transport.set_write_buffer_limits(high=_UNREAD_MOST // 4)
        self._session = self._server.admit(self, self._flush)
        if self._session is None:
            self._transport.abort()

    def connection_lost(self, exc: Exception | None) -> None:
        self._server.leave(self)
        if self._timer:
            self._timer.cancel()
        if self._session:
            self._session.close()
        self._session = self._transport = None

    def stage(self) -> ConnectionStage:
        return ConnectionStage.SESSION if self._has_spoken else ConnectionStage.CONNECTED

    def abort(self) -> None:
        if self._transport:
            self._transport.abort()

    def get_buffer(self, sizehint: int) -> bytearray:
        return self._buffer

    def buffer_updated(self, nbytes: int) -> None:
        self._has_spoken = True
        session = self._session
        if session is not None:
            self._carry_on(lambda: session.receive(bytes(self._buffer[:nbytes]), self._server.now()))

    def pause_writing(self) -> None:
        """It does not read its answers: then nothing more is taken from it."""
        if self._transport:
            self._transport.pause_reading()

    def resume_writing(self) -> None:
        if self._transport:
            self._transport.resume_reading()

    def _on_time(self) -> None:
        self._timer = None
        session = self._session
        if session is not None:
            self._carry_on(lambda: session.on_time(self._server.now()))

    def _carry_on(self, step: Callable[[], None]) -> None:
        """A fault of ours costs this client its connection, and nobody else anything."""
        try:
            step()
        except Exception:  # noqa: BLE001 - nothing that a client sends may end the service
            _log.exception("gateway connection closed", extra=log_source("gateway"))
            self.abort()
            return
        self._flush()

    def _flush(self) -> None:
        transport, session = self._transport, self._session
        if transport is None or session is None:
            return
        lines = session.take_lines()
        if lines:
            transport.write(lines)
        if transport.get_write_buffer_size() > _UNREAD_MOST:
            transport.abort()
            return
        deadline = session.next_deadline()
        if self._timer:
            self._timer.cancel()
            self._timer = None
        if deadline is not None:
            delay = max(0.0, deadline - self._server.now())
            self._timer = asyncio.get_running_loop().call_later(delay, self._on_time)
