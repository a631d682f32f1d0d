"""A second socket on the bus, with the kernel's time stamps: the witness of every lab test."""

from __future__ import annotations

import contextlib
import select
import socket
import struct
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

_FRAME = struct.Struct("=IB3x8s")
_SO_TIMESTAMPNS = 35


@dataclass(frozen=True, slots=True)
class Seen:
    """One frame; ``time`` is the kernel's, in seconds since 1970."""

    time: float
    can_id: int
    data: bytes

    @property
    def word(self) -> int:
        """The control or status word of an RPDO or TPDO."""
        return int.from_bytes(self.data[:2], "little")


class Sniffer:
    """Everything on one interface, oldest first."""

    def __init__(self, channel: str) -> None:
        self._frames: list[Seen] = []
        self._socket = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
        self._socket.setsockopt(socket.SOL_SOCKET, _SO_TIMESTAMPNS, 1)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 21)
        self._socket.bind((channel,))
        self._taking = threading.Lock()
        self._running = True
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self) -> None:
        while self._running:
            select.select([self._socket], [], [], 0.2)
            if not self._take_what_waits():  # the interface is down for a while
                threading.Event().wait(0.02)

    def _take_what_waits(self) -> bool:
        with self._taking:
            try:
                while True:
                    raw, ancillary, _, _ = self._socket.recvmsg(_FRAME.size, 64, socket.MSG_DONTWAIT)
                    seconds, nanoseconds = struct.unpack("@qq", ancillary[0][2])
                    can_id, length, data = _FRAME.unpack(raw)
                    self._frames.append(Seen(seconds + nanoseconds * 1e-9, can_id, data[:length]))
            except BlockingIOError:
                return True
            except OSError:
                return False

    @property
    def frames(self) -> list[Seen]:
        """Frames on the bus until now, also on a machine on which the thread has to wait for a CPU."""
        self._take_what_waits()
        return list(self._frames)

    def of(self, can_id: int, since: float = 0.0) -> list[Seen]:
        return [frame for frame in self.frames if frame.can_id == can_id and frame.time >= since]

    def send(self, can_id: int, data: bytes) -> None:
        self._socket.send(_FRAME.pack(can_id, len(data), data.ljust(8, b"\0")))

    def close(self) -> None:
        self._running = False
        self._thread.join(1.0)
        self._socket.close()


@contextmanager
def sniffing(channel: str = "vcan0") -> Iterator[Sniffer]:
    with contextlib.closing(Sniffer(channel)) as sniffer:
        yield sniffer


def words_of(frames: list[Seen]) -> list[tuple[int, ...]]:
    """The four words of each frame, repetitions left out."""
    found: list[tuple[int, ...]] = []
    for frame in frames:
        words = struct.unpack("<4H", frame.data)
        if not found or found[-1] != words:
            found.append(words)
    return found
