"""One connection without its socket: bytes in, answers out, in the order of the requests.

Framing is MODBUS Messaging on TCP/IP V1.0b §3.1.3: transaction id, protocol id 0, length, unit id; the length
field alone says where a PDU ends, wherever TCP has cut the stream.
"""

from __future__ import annotations

import struct
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Final

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
    ``fault``: why the stream cannot be understood any more, or empty.
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
        exchange = _Exchange(transaction, unit_id)
        self._exchanges.append(exchange)
        received_at = self._arrival(self._dropped + end) if self._earlier else self._received_at
        self._handle(unit_id, pdu, partial(self._on_answer, exchange), received_at)
        return True

    def _arrival(self, place: int) -> float:
        """When the frame that ends at this place in the stream was received. To be called in order of
        place."""
        earlier = self._earlier
        while earlier and earlier[0][0] < place:
            earlier.popleft()
        return earlier[0][1] if earlier else self._received_at

    def _on_answer(self, exchange: _Exchange, answer: bytes) -> None:
        exchange.answer = answer
        if not self._working:
            self._on_late_answer()
