"""Connections: which are let in, for how long they may be without a session, and when their bytes came."""

# asyncua's OPCUAProtocol has few types:
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false, reportUnknownArgumentType=false

from __future__ import annotations

import asyncio
import socket
from typing import Any, Final

from asyncua.common.connection import TransportLimits
from asyncua.server.binary_server_asyncio import BinaryServer, OPCUAProtocol
from asyncua.ua.ua_binary import uatcp_to_binary

from bridge.base import clock
from bridge.base.admission import Admission, ConnectionStage, Visitor
from bridge.base.sources import source_of
from bridge.uaserver.application import NOBODY, UserIdentity
from bridge.uaserver.arrivals import Arrivals
from bridge.uaserver.client_notices import tell
from bridge.uaserver.connection_limits import limits as admission_limits
from bridge.uaserver.connections.inbox import Inbox
from bridge.uaserver.connections.transport import MOST_BEFORE_SESSION, Processor
from bridge.uaserver.inner_server import InnerServer
from bridge.uaserver.library import StatusCodes, make, status, ua
from bridge.uaserver.session import Session

_MOST_UNREAD: Final = 64
"""Messages that a client which waits for its answers has under way at most."""
_READ_MOST: Final = 64 * 1024
"""Bytes that are read at once from such a client."""
WINDOW: Final = 2 * _READ_MOST
"""Bytes that may wait in the kernel: more than that, so that who fills it is noticed."""
_UNWEIGHED: Final = 1024 * 1024
"""Bytes that a connection may hold before anybody adds up what all hold, at once."""
_LOOK_EVERY_S: Final = 1.0
_ERROR: Final[Any] = ua.MessageType.Error


class _UaProtocol(OPCUAProtocol):
    """Notes with each message when it can have come: it may wait here, or behind the application."""

    def __init__(self, arrivals: Arrivals, admission: Admission, **settings: Any) -> None:
        super().__init__(**settings)
        self._arrivals = arrivals
        self._admission = admission
        self._source = ""
        self._visitor: Visitor | None = None
        self.messages = self._inbox = Inbox(self.messages.maxsize, self._most_bytes)

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        peer = transport.get_extra_info("peername")
        self._source = source_of(str(peer[0]) if isinstance(peer, tuple) else str(peer))
        assert isinstance(transport, asyncio.Transport)
        now = clock.now()
        visitor = Visitor(
            self._source,
            now,
            self._stage,
            lambda: _end(transport),
            self._held,
            lambda: self._user.rank,
            lambda: "" if self._user.is_anonymous else self._user.name,
        )
        if not self._admission.admit(visitor, now):
            _end(transport, StatusCodes.BadTcpServerTooBusy)
            return
        self._visitor = visitor
        super().connection_made(transport)
        # Its task has not run yet, so no message has seen the other processor.
        if self.transport is not None and isinstance(self.iserver, InnerServer):
            self.processor = Processor(self.iserver, self.transport, self.limits)
            self.processor.set_policies([policy.of(self._source) for policy in self.policies])

    def connection_lost(self, ex: BaseException | None) -> None:
        if self._visitor:
            self._admission.leave(self._visitor)
        super().connection_lost(ex)

    def _stage(self) -> ConnectionStage:
        return self.processor.stage if isinstance(self.processor, Processor) else ConnectionStage.CONNECTED

    @property
    def _user(self) -> UserIdentity:
        session = self.processor.session if isinstance(self.processor, Processor) else None
        return session.identity if isinstance(session, Session) else NOBODY

    def _held(self) -> int:
        transport, processor = self.transport, self.processor
        unsent = transport.get_write_buffer_size() if transport else 0
        under_way = processor.held if isinstance(processor, Processor) else 0
        return len(self._buffer) + self._inbox.held_bytes + under_way + unsent

    def _most_bytes(self) -> int:
        return self.processor.most_bytes if isinstance(self.processor, Processor) else MOST_BEFORE_SESSION

    def data_received(self, data: bytes) -> None:
        transport, server = self.transport, self.iserver
        if transport is None or transport.is_closing() or not isinstance(server, InnerServer):
            return
        before = self.messages.qsize()
        super().data_received(data)
        waiting = self.messages.qsize()
        crowded = len(data) >= _READ_MOST or waiting > _MOST_UNREAD
        came_at = self._arrivals.arrive(crowded=crowded)
        if isinstance(self.processor, Processor):
            self.processor.arrivals += [came_at] * (waiting - before)
        if transport.is_closing():
            why = "too many requests at once" if self.messages.full() else "no header of a message"
            server.application.on_broken()
            tell("connections closed", self._source, why)
        # What is left is part of one chunk. asyncua would wait for the 4 GiB that a header may ask for.
        elif len(self._buffer) > self.limits.max_recv_buffer:
            server.application.on_broken()
            tell("connections closed", self._source, "a chunk without end")
            self._buffer = b""
            transport.close()
        elif self._held() > _UNWEIGHED:
            self._admission.weigh()

    async def _process_one_msg(self, header: Any, buf: Any) -> bool:
        goes_on = await super()._process_one_msg(header, buf)
        # A queue that is not empty does not let go, and many requests are carried out without a pause.
        await asyncio.sleep(0)
        return goes_on


def _end(transport: asyncio.Transport, code: int = StatusCodes.BadTimeout) -> None:
    """Close a connection, with the reason where the client reads."""
    if transport.get_write_buffer_size():
        transport.abort()
        return
    transport.write(uatcp_to_binary(_ERROR, make(ua.ErrorMessage, Error=status(code))))
    transport.close()


class TcpAcceptor(BinaryServer):
    """Takes connections on a socket that is bound already."""

    def __init__(self, server: InnerServer, bound: socket.socket, limits: TransportLimits) -> None:
        host, port = bound.getsockname()[:2]
        super().__init__(server, host, port, limits)
        self._socket = bound
        self._inner = server
        self._admission = Admission(
            admission_limits(server.application.highest_rank),
            tell,
            lambda: server.application.on_refused(),
            lambda: server.application.on_broken(),
        )
        self._timer: asyncio.TimerHandle | None = None

    def _make_protocol(self) -> OPCUAProtocol:
        return _UaProtocol(
            self._inner.application.arrivals(),
            self._admission,
            iserver=self.iserver,
            policies=self._policies,
            clients=self.clients,
            closing_tasks=self.closing_tasks,
            limits=self.limits,
        )

    async def start(self) -> None:
        loop = asyncio.get_running_loop()
        self._server = await loop.create_server(self._make_protocol, sock=self._socket)
        self.cleanup_task = asyncio.create_task(self._close_task_loop())
        self._look()

    async def stop(self) -> None:
        if self._timer:
            self._timer.cancel()
        await super().stop()

    def _look(self) -> None:
        self._timer = asyncio.get_running_loop().call_later(_LOOK_EVERY_S, self._look)
        self._admission.look(clock.now())
