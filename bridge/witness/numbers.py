"""The numbers of the owners' telegrams, asked of the bridge by Modbus TCP: a client that has no other use.

MODBUS Messaging on TCP/IP V1.0b §3.1.3, function 4 of MODBUS Application Protocol V1.1b3 §6.4. Input
register 24 of a drive's unit is the number (docs/reference/modbus.md).
"""

from __future__ import annotations

import socket
import struct
from collections.abc import Sequence
from typing import Final

NUMBER_REGISTER: Final = 24
_PERIOD_S: Final = 0.05
_LIMIT_S: Final = 1.0
_AGAIN_S: Final = 2.0
_REQUEST: Final = struct.Struct(">HHHBBHH")
_HEADER: Final = struct.Struct(">HHHB")
_READ_INPUTS: Final = 4


class Numbers:
    """Asks for all units every 50 ms. Non-blocking: the shell waits for ``fileno``.

    A reading is (unit id, number, asked at, answered at). ``is_lost`` is true once after the bridge has
    stopped answering; then it is called again every two seconds.
    """

    def __init__(self, host: str, port: int, units: Sequence[int]) -> None:
        self._address = (host, port)
        self._units = tuple(units)
        self._socket: socket.socket | None = None
        self._connected = False
        self._buffer = bytearray()
        self._asked: dict[int, float] = {}
        self._asked_at = float("-inf")
        self._next = 0.0
        self._lost = False

    def fileno(self) -> int | None:
        return self._socket.fileno() if self._socket else None

    def close(self) -> None:
        if self._socket:
            self._socket.close()
        self._socket = None
        self._connected = False
        self._buffer.clear()
        self._asked.clear()

    def take_lost(self) -> bool:
        lost, self._lost = self._lost, False
        return lost

    def next_deadline(self) -> float:
        return self._next

    def on_time(self, now: float) -> None:
        """Connect, ask again, or give an unanswered question up."""
        if now < self._next:
            return
        if self._socket is None:
            self._connect(now)
        elif self._asked and now > self._asked_at + _LIMIT_S:
            self._give_up(now)
        else:
            self._next = now + _PERIOD_S
            if not self._asked:
                self._ask(now)

    def _connect(self, now: float) -> None:
        self._next = now + _PERIOD_S
        family = socket.AF_INET6 if ":" in self._address[0] else socket.AF_INET
        self._socket = socket.socket(family, socket.SOCK_STREAM)
        self._socket.setblocking(False)
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._asked_at = now
        try:
            self._socket.connect(self._address)
        except BlockingIOError:
            pass  # it goes on in the background; asking fails until it is there
        except OSError:
            self._give_up(now)

    def _give_up(self, now: float) -> None:
        self._lost |= self._connected
        self.close()
        self._next = now + _AGAIN_S

    def _ask(self, now: float) -> None:
        assert self._socket is not None
        request = b"".join(
            _REQUEST.pack(unit, 0, 6, unit, _READ_INPUTS, NUMBER_REGISTER, 1) for unit in self._units
        )
        try:
            self._socket.sendall(request)
        except BlockingIOError:
            if now > self._asked_at + _LIMIT_S:
                self._give_up(now)
            return
        except OSError:
            self._give_up(now)
            return
        self._connected = True
        self._asked = dict.fromkeys(self._units, now)
        self._asked_at = now

    def receive(self, now: float) -> list[tuple[int, int, float, float]]:
        """The answers that have come."""
        if self._socket is None:
            return []
        try:
            data = self._socket.recv(65536)
        except (BlockingIOError, InterruptedError):
            return []
        except OSError:
            data = b""
        if not data:
            self._give_up(now)
            return []
        self._buffer += data
        readings: list[tuple[int, int, float, float]] = []
        while len(self._buffer) >= _HEADER.size:
            _, _, length, unit = _HEADER.unpack_from(self._buffer)
            end = 6 + length
            if len(self._buffer) < end:
                break
            pdu = bytes(self._buffer[_HEADER.size : end])
            del self._buffer[:end]
            asked = self._asked.pop(unit, None)
            # An exception (a unit that is not there) is no number.
            if asked is not None and len(pdu) == 4 and pdu[0] == _READ_INPUTS:
                readings.append((unit, int.from_bytes(pdu[2:], "big"), asked, now))
        return readings
