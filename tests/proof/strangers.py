"""Modbus clients that own no drive, and what an owner's own machine does beside commanding."""

from __future__ import annotations

import socket
import struct
import threading
import time
from contextlib import suppress
from typing import Final

from tests.proof.drives import PORTS, SERVERS, Drive, drives_of
from tests.proof.families import NORD
from tests.proof.settings import PLANT

_OWNERS_MACHINE: Final = "127.0.0.1"
_ELSEWHERE: Final = "127.0.0.20"
_HEAD: Final = struct.Struct(">HHHB")
_READ: Final = struct.Struct(">BHH")
_WRITE: Final = struct.Struct(">BHHB")
_READ_HOLDING, _WRITE_HOLDING = 3, 16
_KEEP_ALIVE, _TIMEOUT = 10, 12
"""Holding registers (docs/reference/modbus.md): 0 releases the drive; the owner's time-out."""
_LONG_MS: Final = 5 * PLANT.fieldbus_timeout_ms
_INVALID: Final = 0x007F
"""NORD: "run" without bit 10, "control data valid" (BU 2500 §6.5.1)."""
_MOST_BYTES: Final = 260
_PERIOD_S: Final = 0.1
_LIMIT_S: Final = 2.0


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
        frame = _HEAD.pack(1, 0, len(telegram) + 1, drive.place + 1) + telegram
        with suppress(BlockingIOError):
            self._socket.sendall(frame * times)

    def abandon(self) -> None:
        """The machine is switched off, and what it has sent is gone with it."""
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        self._socket.close()

    def read(self, drive: Drive) -> None:
        self._send(drive, _READ.pack(_READ_HOLDING, 0, 2))
        self._socket.recv(_MOST_BYTES)

    def write(self, drive: Drive, start: int, *words: int) -> None:
        self.send_write(drive, start, *words)
        self._socket.recv(_MOST_BYTES)

    def send_write(self, drive: Drive, start: int, *words: int) -> None:
        data = struct.pack(f">{len(words)}H", *words)
        self._send(drive, _WRITE.pack(_WRITE_HOLDING, start, len(words), len(data)) + data)

    def _send(self, drive: Drive, pdu: bytes) -> None:
        self._socket.sendall(_HEAD.pack(1, 0, len(pdu) + 1, drive.place + 1) + pdu)

    def close(self) -> None:
        """What has been sent is carried out."""
        with suppress(OSError):
            self._socket.shutdown(socket.SHUT_WR)
            while self._socket.recv(_MOST_BYTES):
                pass
        self._socket.close()


def release(drives: list[Drive]) -> float:
    """By the machine of their owner. Gives the time before it."""
    connections = [Connection(_OWNERS_MACHINE) for _ in drives]
    now = time.monotonic()
    for connection, drive in zip(connections, drives, strict=True):
        connection.send_write(drive, _KEEP_ALIVE, 0)
    for connection in connections:
        connection.close()
    return now


class Strangers:
    """Nothing of what they do is a telegram of the owner: another machine writes "run" to its drives and a
    longer time-out, its own machine reads them, and writes what is no valid telegram."""

    def __init__(self) -> None:
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True, name="strangers")
        self._thread.start()

    def _run(self) -> None:
        # A drive that is to hold may be taken over once it has tripped, and is stopped first then.
        drives = [drive for drive in drives_of("modbus") if drive.reaction != "hold"]
        with suppress(OSError):
            own, other = Connection(_OWNERS_MACHINE), Connection(_ELSEWHERE)
            while not self._ended.wait(_PERIOD_S):
                for drive in drives:
                    other.write(drive, 0, drive.family.run, drive.family.setpoint)
                    other.write(drive, _TIMEOUT, _LONG_MS)
                    own.read(drive)
                    if drive.family is NORD:
                        own.write(drive, 0, _INVALID)
            own.close()
            other.close()

    def end(self) -> None:
        self._ended.set()
        self._thread.join(_LIMIT_S)
