"""One Modbus TCP connection on the event loop."""

from __future__ import annotations

import asyncio
import socket
from typing import Any, Final, Protocol, cast

from bridge.command import Identity
from bridge.northbound.modbus.conversation import Conversation
from bridge.northbound.modbus.dispatch import Answer, Dispatcher

TURN: Final = 16
"""Requests of one connection that are handled before everything else gets its turn: about 0.3 ms."""

STALL_LIMIT_S: Final = 5.0
"""How long a client may leave its answers unread before it is dropped."""

_UNREAD_MOST: Final = 32 * 1024  # bytes of answers that wait for a client before it is not served further
_KEEPALIVE: Final = (("TCP_KEEPIDLE", 30), ("TCP_KEEPINTVL", 10), ("TCP_KEEPCNT", 3))


class Hall(Protocol):
    """Who keeps the list of sessions."""

    def admit(self, session: Session, host: str, port: int) -> Identity | None:
        """The identity of a client from this address, or None where it may not connect."""
        ...

    def leave(self, session: Session) -> None: ...

    def on_fault(self, session: Session, fault: str) -> None:
        """The session is being closed by us for this reason."""
        ...


class Session(asyncio.Protocol):
    """Pumps bytes between a socket and a ``Conversation``.

    A client that does not read its answers is not read from either, and dropped after a while; one that
    floods is handled ``TURN`` requests at a time.
    """

    def __init__(self, dispatcher: Dispatcher, hall: Hall) -> None:
        self._dispatcher = dispatcher
        self._hall = hall
        self._conversation = Conversation(self._handle, self._go_on)
        self.identity: Identity | None = None
        """Who the hall says it is; None until it is admitted."""
        self.heard_at = float("-inf")
        """When the client last sent something, or connected; in the event loop's time."""
        self._transport: asyncio.Transport | None = None
        self._stalled: asyncio.TimerHandle | None = None
        self._scheduled = False

    @property
    def address(self) -> str:
        return self.identity.address if self.identity else ""

    def close(self) -> None:
        """End the connection; answers that the client does not take are lost."""
        transport = self._transport
        if transport is None:
            return
        if transport.get_write_buffer_size():
            transport.abort()
        else:
            transport.close()

    # asyncio

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        stream = cast(asyncio.Transport, transport)
        self._transport = stream
        self.heard_at = asyncio.get_running_loop().time()
        peer: Any = stream.get_extra_info("peername")
        self.identity = self._hall.admit(self, peer[0], peer[1]) if peer else None
        if self.identity is None:
            stream.abort()
            return
        stream.set_write_buffer_limits(high=_UNREAD_MOST)
        _keep_alive(stream.get_extra_info("socket"))

    def data_received(self, data: bytes) -> None:
        self.heard_at = asyncio.get_running_loop().time()
        self._conversation.receive(data)
        self._go_on()

    def pause_writing(self) -> None:
        self._stalled = asyncio.get_running_loop().call_later(STALL_LIMIT_S, self._drop_stalled)

    def resume_writing(self) -> None:
        if self._stalled:
            self._stalled.cancel()
            self._stalled = None
            self._go_on()

    def connection_lost(self, exc: Exception | None) -> None:
        self._transport = None
        if self._stalled:
            self._stalled.cancel()
            self._stalled = None
        if self.identity is not None:
            self._hall.leave(self)

    # work

    def _handle(self, unit_id: int, pdu: bytes, answer: Answer) -> None:
        if self.identity is not None:
            self._dispatcher.handle(unit_id, pdu, self.identity, answer)

    def _go_on(self) -> None:
        """There is something to do: now, unless a turn is coming anyway."""
        if not self._scheduled:
            self._advance()

    def _advance(self) -> None:
        """Handle some requests, send what may be sent, and see whether more can be taken in."""
        self._scheduled = False
        transport = self._transport
        if transport is None or self.identity is None or self._stalled or transport.is_closing():
            return
        conversation = self._conversation
        try:
            answers = conversation.advance(TURN)
        except Exception:
            transport.abort()  # a fault of ours: better no connection than one that has lost its place
            raise
        if answers:
            transport.write(answers)  # may call pause_writing
        if conversation.fault:
            self._hall.on_fault(self, conversation.fault)
            self.close()
            return
        if conversation.backlog or conversation.is_full or self._stalled:
            transport.pause_reading()
        else:
            transport.resume_reading()
        if conversation.backlog and not self._stalled:
            self._scheduled = True
            asyncio.get_running_loop().call_soon(self._advance)

    def _drop_stalled(self) -> None:
        self._stalled = None
        if self._transport is not None:
            self._hall.on_fault(self, "does not read its answers")
            self._transport.abort()


def _keep_alive(sock: socket.socket) -> None:
    """Let the kernel find a peer that is gone without a word, within about a minute."""
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    for name, value in _KEEPALIVE:
        option = getattr(socket, name, None)
        if option is not None:
            sock.setsockopt(socket.IPPROTO_TCP, option, value)
