"""The owners' telegrams, asked of the bridge by Modbus TCP: a client for this alone.

MODBUS Messaging on TCP/IP V1.0b §3.1.3, functions 3 and 4 of MODBUS Application Protocol V1.1b3 §6.3, §6.4.
Input register 24 of a drive's unit is the number of the last telegram, holding register 12 the time-out in
force (docs/reference/modbus.md).
"""

from __future__ import annotations

import socket
import struct
from collections.abc import Sequence
from typing import Final, NamedTuple

NUMBER_REGISTER: Final = 24
TIMEOUT_REGISTER: Final = 12
_PERIOD_S: Final = 0.05
_LIMIT_S: Final = 1.0
_AGAIN_S: Final = 2.0
_REQUEST: Final = struct.Struct(">HHHBBHH")
_HEADER: Final = struct.Struct(">HHHB")
_READ_HOLDING: Final = 3
_READ_INPUTS: Final = 4
_QUESTIONS: Final = ((_READ_HOLDING, TIMEOUT_REGISTER), (_READ_INPUTS, NUMBER_REGISTER))
"""Questions, that for the number last: its answer completes the reading."""


class UnitReading(NamedTuple):
    """Reading of one drive's unit. ``timeout_ms`` is None where it was not answered."""

    unit: int
    number: int
    timeout_ms: int | None
    asked_at: float
    answered_at: float


class Numbers:
    """Modbus client that asks for all units every 50 ms; those of ``outputs`` have no register for the
    time-out. Non-blocking: the shell waits for ``fileno``.

    ``take_lost`` is true after each time that the bridge was not there or has stopped answering, ``why``
    says what was wrong then; it is called again every two seconds.
    """

    def __init__(self, host: str, port: int, units: Sequence[int], outputs: Sequence[int] = ()) -> None:
        self._address = (host, port)
        self._questions = [(unit, *question) for unit in units for question in _QUESTIONS]
        self._questions += [(unit, _READ_INPUTS, NUMBER_REGISTER) for unit in outputs]
        self._socket: socket.socket | None = None
        self.why = "no answer yet"
        self._buffer = bytearray()
        self._asked: dict[tuple[int, int], float] = {}
        """Times of the questions without an answer yet, by function and unit."""
        self._timeouts_ms: dict[int, int] = {}
        self._asked_at = float("-inf")
        self._next = 0.0
        self._lost = False

    def fileno(self) -> int | None:
        return self._socket.fileno() if self._socket else None

    def close(self) -> None:
        if self._socket:
            self._socket.close()
        self._socket = None
        self._buffer.clear()
        self._asked.clear()
        self._timeouts_ms.clear()

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
            self._give_up(now, "it does not answer")
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
        except OSError as error:
            self._give_up(now, _text(error))

    def _give_up(self, now: float, why: str) -> None:
        self._lost, self.why = True, why
        self.close()
        self._next = now + _AGAIN_S

    def _ask(self, now: float) -> None:
        assert self._socket is not None
        request = b"".join(
            _REQUEST.pack(unit, 0, 6, unit, function, register, 1)
            for unit, function, register in self._questions
        )
        try:
            self._socket.sendall(request)
        except BlockingIOError:
            if now > self._asked_at + _LIMIT_S:
                self._give_up(now, "no connection")
            return
        except OSError as error:
            self._give_up(now, _text(error))
            return
        self._asked = {(function, unit): now for unit, function, _ in self._questions}
        self._asked_at = now

    def receive(self, now: float) -> list[UnitReading]:
        """Readings completed by the answers received since the last call."""
        if self._socket is None:
            return []
        ended = "it ends the connection: this address has to be among its [modbus] allow"
        try:
            data = self._socket.recv(65536)
        except (BlockingIOError, InterruptedError):
            return []
        except ConnectionResetError:
            data = b""
        except OSError as error:
            data, ended = b"", _text(error)
        if not data:
            self._give_up(now, ended)
            return []
        self._buffer += data
        readings: list[UnitReading] = []
        while len(self._buffer) >= _HEADER.size:
            _, _, length, unit = _HEADER.unpack_from(self._buffer)
            end = 6 + length
            if len(self._buffer) < end:
                break
            pdu = bytes(self._buffer[_HEADER.size : end])
            del self._buffer[:end]
            reading = self._reading(unit, pdu, now)
            if reading is not None:
                readings.append(reading)
        return readings

    def _reading(self, unit: int, pdu: bytes, now: float) -> UnitReading | None:
        function = pdu[0] & 0x7F if pdu else 0
        asked = self._asked.pop((function, unit), None)
        if asked is None:
            return None
        if len(pdu) != 4 or pdu[0] & 0x80:
            # An exception (a unit that is not there) is no answer.
            self.why = f"unit {unit} answers exception {pdu[1]:02X}h" if len(pdu) == 2 else "no Modbus"
            self._timeouts_ms.pop(unit, None)
            return None
        value = int.from_bytes(pdu[2:], "big")
        if function == _READ_HOLDING:
            self._timeouts_ms[unit] = value
            return None
        return UnitReading(unit, value, self._timeouts_ms.get(unit), asked, now)


def _text(error: OSError) -> str:
    return error.strerror or str(error)
