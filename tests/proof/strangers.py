"""Modbus clients that own no drive, and what an owner's own machine does beside commanding."""

from __future__ import annotations

import socket
import struct
import threading
from contextlib import suppress
from typing import Final, Protocol

from tests.proof.drives import PORTS, SERVERS, Drive, drives_of
from tests.proof.settings import PLANT

_OWNERS_MACHINE: Final = "127.0.0.1"
_ELSEWHERE: Final = "127.0.0.20"
_HEAD: Final = struct.Struct(">HHHB")
_READ: Final = struct.Struct(">BHH")
_WRITE: Final = struct.Struct(">BHHB")
_READ_HOLDING, _WRITE_HOLDING = 3, 16
_TIMEOUT: Final = 12
"""Holding register (docs/reference/modbus.md): the owner's time-out."""
_EXCEPTION: Final = 0x80
_LONG_MS: Final = 5 * PLANT.fieldbus_timeout_ms
_MOST_BYTES: Final = 260
_PERIOD_S: Final = 0.1
_LIMIT_S: Final = 2.0


class Unit(Protocol):
    """What has a Modbus unit of its own: a drive, or a node with outputs."""

    @property
    def unit(self) -> int: ...


class Connection:
    """Modbus/TCP from this address."""

    def __init__(self, address: str) -> None:
        where = (SERVERS["modbus"], PORTS["modbus"])
        self._socket = socket.create_connection(where, _LIMIT_S, source_address=(address, 0))

    @classmethod
    def of_owner(cls) -> Connection:
        """From the machine of the Modbus drives' owner."""
        return cls(_OWNERS_MACHINE)

    def write_ahead(self, drive: Drive, times: int) -> None:
        """Write "run" so often, as far as there is room for it, and read no answer."""
        self._socket.setblocking(False)
        telegram = _WRITE.pack(_WRITE_HOLDING, 0, 2, 4) + struct.pack(
            ">HH", drive.family.run, drive.family.setpoint
        )
        frame = _HEAD.pack(1, 0, len(telegram) + 1, drive.unit) + telegram
        with suppress(BlockingIOError):
            self._socket.sendall(frame * times)

    def abandon(self) -> None:
        """The machine is switched off, and what it has sent is gone with it."""
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        self._socket.close()

    def read(self, drive: Drive) -> None:
        self._send(drive, _READ.pack(_READ_HOLDING, 0, 2))
        self._socket.recv(_MOST_BYTES)

    def write(self, to: Unit, start: int, *words: int) -> int:
        """Holding registers from ``start`` on. The exception code of the answer, 0 where it is none."""
        data = struct.pack(f">{len(words)}H", *words)
        self._send(to, _WRITE.pack(_WRITE_HOLDING, start, len(words), len(data)) + data)
        answer = self._socket.recv(_MOST_BYTES)
        return answer[_HEAD.size + 1] if answer[_HEAD.size] & _EXCEPTION else 0

    @property
    def port(self) -> int:
        """Our own, by which the bridge names the connection."""
        return int(self._socket.getsockname()[1])

    def _send(self, to: Unit, pdu: bytes) -> None:
        self._socket.sendall(_HEAD.pack(1, 0, len(pdu) + 1, to.unit) + pdu)

    def close(self) -> None:
        """What has been sent is carried out."""
        with suppress(OSError):
            self._socket.shutdown(socket.SHUT_WR)
            while self._socket.recv(_MOST_BYTES):
                pass
        self._socket.close()


class Strangers:
    """Nothing of what they do is a telegram of the owner: another machine, and another connection of its own,
    write "run" to its drives and read them. The other machine writes a longer time-out as well: what goes on
    for the owner is what its own machine sets once it is silent."""

    def __init__(self) -> None:
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True, name="strangers")
        self._thread.start()

    def _run(self) -> None:
        # A drive that is to hold may be taken over once it has tripped, and is stopped first then.
        drives = [drive for drive in drives_of("modbus") if drive.reaction != "hold"]
        with suppress(OSError):
            connections = [Connection(_OWNERS_MACHINE), Connection(_ELSEWHERE)]
            while not self._ended.wait(_PERIOD_S):
                for drive in drives:
                    for connection in connections:
                        connection.write(drive, 0, drive.family.run, drive.family.setpoint)
                    connections[0].read(drive)
                    connections[1].write(drive, _TIMEOUT, _LONG_MS)
            for connection in connections:
                connection.close()

    def end(self) -> None:
        self._ended.set()
        self._thread.join(_LIMIT_S)
