"""One Modbus TCP connection: its stream of requests and answers, and its socket on the event loop.

Framing is MODBUS Messaging on TCP/IP V1.0b §3.1.3: transaction id, protocol id 0, length, unit id; the length
field alone says where a PDU ends, wherever TCP has cut the stream.
"""

from __future__ import annotations

import asyncio
import socket
import struct
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, Final, Protocol, cast

from bridge.base.admission import Visitor
from bridge.base.sources import source_of
from bridge.command import Identity
from bridge.command.messages.freshness import Inflow
from bridge.northbound.modbus.dispatch import WRITES, Answer, Dispatcher
from bridge.northbound.modbus.rounds import Rounds
from bridge.northbound.pulse import Pulse

STALL_LIMIT_S: Final = 5.0
"""Time in seconds for which a client may leave its answers unread; then it is disconnected."""

READ_MOST: Final = 16 * 1024
"""Bytes that are read at once, and that may wait here before reading stops: 64 requests of the longest
kind."""

_LAST: Final = 16  # requests of a client that has closed its side, which are handled all the same
_UNREAD_MOST: Final = 32 * 1024  # bytes of answers that may wait for a client; beyond that it is not served
_ESTABLISHED: Final = 1  # of TCP_INFO's first byte (linux/tcp.h)
_KEEPALIVE: Final = (("TCP_KEEPIDLE", 30), ("TCP_KEEPINTVL", 10), ("TCP_KEEPCNT", 3))
_HEADER: Final = struct.Struct(">HHHB")
_BEFORE_LENGTH_COUNTS: Final = 6
_LENGTHS: Final = range(2, 255)  # unit id and a PDU of 1 … 253 bytes
_MOST_UNANSWERED: Final = 64  # requests whose outcome is still to come, per connection

Handle = Callable[[int, bytes, Callable[[bytes], None], float], None]
"""(unit id, PDU, answer, received at): ``answer`` is to be called exactly once with the answer's PDU; the
time is when the end of the request was received."""


@dataclass(slots=True)
class _Exchange:
    """One request, and its answer once there is one."""

    transaction: int
    unit_id: int
    answer: bytes | None = None


class Conversation:
    """``handle`` gets the requests in order. ``on_late_answer`` is called when an answer comes after
    ``handle`` has returned, so that ``advance`` should be called again.

    A request has the time of its last byte, however long it waits here.

    ``backlog``: more requests can be handled now. ``is_full``: none is handled until an answer comes.
    ``handled``: requests so far. ``fault``: why the stream cannot be understood any more, or empty.
    """

    def __init__(self, handle: Handle, on_late_answer: Callable[[], None]) -> None:
        self._handle = handle
        self._on_late_answer = on_late_answer
        self._buffer = bytearray()
        self._offset = 0
        self._dropped = 0  # bytes of the stream before the buffer
        self._received_at = 0.0
        # Where the chunks before the last one end in the stream, with their times, as far as not handled.
        self._earlier: deque[tuple[int, float]] = deque()
        self._exchanges: deque[_Exchange] = deque()
        self._working = False
        self.backlog = False
        self.handled = 0
        self.fault = ""

    @property
    def is_full(self) -> bool:
        return len(self._exchanges) >= _MOST_UNANSWERED

    @property
    def waiting(self) -> int:
        """Bytes that have not been handled yet."""
        return len(self._buffer)

    def receive(self, data: bytes | bytearray | memoryview, received_at: float = 0.0) -> None:
        if self._buffer:
            self._earlier.append((self._dropped + len(self._buffer), self._received_at))
        self._buffer += data
        self._received_at = received_at

    def advance(self, most: int) -> bytes:
        """Handle up to ``most`` requests and return the answers that may be sent now, in the order of the
        requests."""
        self._working = True
        try:
            more = True
            while more and most > 0 and not self.is_full:
                more = self._handle_next()
                most -= 1
        finally:
            self._working = False
            del self._buffer[: self._offset]
            self._dropped += self._offset
            self._offset = 0
        answers = self._take()
        self.backlog = more and not self.is_full and len(self._buffer) >= _HEADER.size
        return answers

    def _take(self) -> bytes:
        ready: list[bytes] = []
        exchanges = self._exchanges
        while exchanges and (answer := exchanges[0].answer) is not None:
            exchange = exchanges.popleft()
            ready.append(_HEADER.pack(exchange.transaction, 0, len(answer) + 1, exchange.unit_id))
            ready.append(answer)
        return b"".join(ready)

    def _handle_next(self) -> bool:
        """Handle the next frame; False if there is none, or none that can be understood."""
        begin = self._offset
        if self.fault or len(self._buffer) - begin < _HEADER.size:
            return False
        transaction, protocol, length, unit_id = _HEADER.unpack_from(self._buffer, begin)
        if protocol != 0 or length not in _LENGTHS:
            self.fault = f"protocol id {protocol}" if protocol else f"length {length}"
            return False
        end = begin + _BEFORE_LENGTH_COUNTS + length
        if len(self._buffer) < end:
            return False
        pdu = bytes(self._buffer[begin + _HEADER.size : end])
        self._offset = end
        self.handled += 1
        exchange = _Exchange(transaction, unit_id)
        self._exchanges.append(exchange)
        received_at = self._arrival(self._dropped + end) if self._earlier else self._received_at
        self._handle(unit_id, pdu, partial(self._on_answer, exchange), received_at)
        return True

    def _arrival(self, place: int) -> float:
        """Time at which the frame that ends at this place in the stream was received. To be called in order
        of place."""
        earlier = self._earlier
        while earlier and earlier[0][0] < place:
            earlier.popleft()
        return earlier[0][1] if earlier else self._received_at

    def _on_answer(self, exchange: _Exchange, answer: bytes) -> None:
        exchange.answer = answer
        if not self._working:
            self._on_late_answer()


class Clients(Protocol):
    """Clients of the server: who may connect, and whose turn it is."""

    @property
    def rounds(self) -> Rounds: ...

    def admit(self, session: ModbusConnection, host: str, port: int) -> Identity | None: ...

    def leave(self, session: ModbusConnection) -> None: ...

    def on_write(self, session: ModbusConnection, identity: Identity) -> None: ...

    def on_fault(self, session: ModbusConnection, fault: str) -> None: ...


class ModbusConnection(asyncio.BufferedProtocol):
    """Pumps bytes between a socket and a ``Conversation``. ``clock`` is the plant's.

    From a client that does not read its answers nothing is read either, and after a while it is disconnected.
    One that floods has its turn as all others, and its writes do not count as fresh.
    """

    def __init__(
        self, dispatcher: Dispatcher, server: Clients, clock: Callable[[], float], pulse: Pulse
    ) -> None:
        self._dispatcher = dispatcher
        self._server = server
        self._clock = clock
        self._pulse = pulse
        self._inflow = Inflow(clock(), pulse.look)
        self._room = bytearray(READ_MOST)
        self._conversation = Conversation(self._handle, self._wish)
        self.identity: Identity | None = None
        """The identity given by the server; None until the client is admitted."""
        self.visitor: Visitor | None = None
        """Place among the connections, while it has one."""
        self.has_spoken = False
        self._transport: asyncio.Transport | None = None
        self._stalled: asyncio.TimerHandle | None = None

    @property
    def address(self) -> str:
        return self.identity.address if self.identity else ""

    @property
    def source(self) -> str:
        """Name of the client for limits and lines of the log."""
        return source_of(self.identity.user) if self.identity else ""

    @property
    def has_been_closed(self) -> bool:
        """True if its client has closed the connection, whether that was read or not; as far as the kernel
        tells."""
        transport = self._transport
        if transport is None or transport.is_closing():
            return True
        info = getattr(socket, "TCP_INFO", None)
        if info is None:
            return False
        sock = transport.get_extra_info("socket")
        state: bytes = sock.getsockopt(socket.IPPROTO_TCP, info, 1)
        return state[0] != _ESTABLISHED

    def close(self) -> None:
        """End the connection; answers that the client has not read are lost."""
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
        peer: Any = stream.get_extra_info("peername")
        self.identity = self._server.admit(self, peer[0], peer[1]) if peer else None
        if self.identity is None:
            stream.abort()
            return
        stream.set_write_buffer_limits(high=_UNREAD_MOST)
        _keep_alive(stream.get_extra_info("socket"))

    def get_buffer(self, sizehint: int) -> bytearray:
        return self._room

    def buffer_updated(self, nbytes: int) -> None:
        now = self._clock()
        self.has_spoken = True
        if self.visitor is not None:
            self.visitor.since = now
        received_at = self._inflow.arrive(now, self._pulse.look, crowded=nbytes == READ_MOST)
        self._conversation.receive(memoryview(self._room)[:nbytes], received_at)
        self._wish()

    def eof_received(self) -> None:
        # The transport is closed when the answers are sent; the client has gone now. What it has asked in its
        # last message is answered first, whoever waits: nobody would know whether it was carried out.
        self._server.rounds.serve_now(self, _LAST)
        self._server.leave(self)

    def pause_writing(self) -> None:
        self._stalled = asyncio.get_running_loop().call_later(STALL_LIMIT_S, self._drop_stalled)

    def resume_writing(self) -> None:
        if self._stalled:
            self._stalled.cancel()
            self._stalled = None
            self._wish()

    def connection_lost(self, exc: Exception | None) -> None:
        self._transport = None
        if self._stalled:
            self._stalled.cancel()
            self._stalled = None
        if self.identity is not None:
            self._server.leave(self)

    # work

    def _handle(self, unit_id: int, pdu: bytes, answer: Answer, received_at: float) -> None:
        identity = self.identity
        if identity is None:
            return
        if pdu[0] in WRITES:
            self._server.on_write(self, identity)
        self._dispatcher.handle(unit_id, pdu, identity, answer, received_at)

    def _wish(self) -> None:
        """There are requests, or answers."""
        self._server.rounds.wish(self)

    def serve(self, most: int) -> int:
        """Handle up to ``most`` requests, send the answers that are due, and see whether more can be read.
        How many were handled."""
        transport = self._transport
        if transport is None or self.identity is None or self._stalled or transport.is_closing():
            return 0
        conversation = self._conversation
        before = conversation.handled
        try:
            answers = conversation.advance(most)
        except Exception:
            transport.abort()  # a bug of ours: better no connection than one that is out of step
            raise
        if answers:
            transport.write(answers)  # may call pause_writing
        if conversation.fault:
            self._server.on_fault(self, conversation.fault)
            self.close()
            return conversation.handled - before
        self._read_on(transport)
        if conversation.backlog and not self._stalled:
            self._wish()
        return conversation.handled - before

    def _read_on(self, transport: asyncio.Transport) -> None:
        """Keep reading as long as possible: bytes that wait here have a time of arrival, those in the kernel
        have none."""
        conversation, inflow = self._conversation, self._inflow
        if conversation.is_full or self._stalled or conversation.waiting >= READ_MOST:
            transport.pause_reading()
            inflow.shut(self._clock())
        elif not (inflow.is_open or conversation.backlog):
            inflow.reopen(self._clock())
            transport.resume_reading()

    def _drop_stalled(self) -> None:
        self._stalled = None
        if self._transport is not None:
            self._server.on_fault(self, "does not read its answers")
            self._transport.abort()


def _keep_alive(sock: socket.socket) -> None:
    """Let the kernel notice within about a minute that a peer has vanished."""
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    for name, value in _KEEPALIVE:
        option = getattr(socket, name, None)
        if option is not None:
            sock.setsockopt(socket.IPPROTO_TCP, option, value)
