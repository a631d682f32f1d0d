"""Listens to a whole bus and sends nothing, beside whoever drives it: for people who look at the traffic.

A SocketCAN interface has a socket for everybody who wants one. Any other bus is its process's own; that one
passes its frames on (``wiretap``).
"""

from __future__ import annotations

import asyncio
import socket
import struct
import time
from collections import deque
from pathlib import Path
from typing import Final, Protocol

from bridge.can.cansockets import CanSockets
from bridge.can.receiver import BATCH, Receiver, Stamps
from bridge.canopen.frame import Frame
from bridge.text import Text, Words

RECORD: Final = struct.Struct("=dIB3x8s")
"""A frame on the way from a wiretap: time in monotonic seconds, identifier with flags, length, data."""
LOST: Final = 0xFFFF_FFFF
"""Stands for an identifier where the time is the number of frames that were lost."""
_MOST_WAITING: Final = 1 << 15
_MOST_PER_READ: Final = 512
_READ_BYTES: Final = 1 << 16


class Listener(Protocol):
    """Gathers frames from ``open`` on, in the loop that runs then."""

    lost: int
    """Frames that came and were not taken in time, so far."""
    failure: Words
    """Reason why nothing comes any more; empty while something may."""

    def open(self) -> None:
        """Raises OSError."""
        ...

    def take(self) -> list[Frame]:
        """Frames received since the last call, in the order of the wire."""
        ...

    def close(self) -> None:
        """May be called again."""
        ...


class _BusProcessEnded(ConnectionResetError):
    """The end of the stream from the process that has the bus."""


class _Gathering:
    """Base of both kinds: frames in a queue that is read as the socket has some."""

    def __init__(self) -> None:
        self.lost = 0
        self.failure: Words = ""
        self._frames = deque[Frame]()
        self._socket: socket.socket | None = None

    def take(self) -> list[Frame]:
        taken = list(self._frames)
        self._frames.clear()
        return taken

    def close(self) -> None:
        opened, self._socket = self._socket, None
        if opened is not None:
            asyncio.get_running_loop().remove_reader(opened)
            opened.close()

    def _use(self, opened: socket.socket) -> None:
        self._socket = opened
        asyncio.get_running_loop().add_reader(opened, self._on_readable)

    def _on_readable(self) -> None:
        try:
            self._read()
        except OSError as error:
            has_ended = isinstance(error, _BusProcessEnded)
            self.failure = Text.of("can.bus_process_ended") if has_ended else error.strerror or str(error)
            self.close()

    def _read(self) -> None:
        """Raises OSError where nothing will come any more."""
        raise NotImplementedError

    def _gather(self, frames: list[Frame]) -> None:
        room = _MOST_WAITING - len(self._frames)
        self.lost += max(0, len(frames) - room)
        self._frames.extend(frames[:room])


class SocketCanListener(_Gathering):
    """Listener on the interface ``channel``; it hears the frames of its own machine, too."""

    def __init__(self, channel: str) -> None:
        super().__init__()
        self._sockets = CanSockets(channel)
        self._receiver: Receiver | None = None
        self._drops = 0

    def open(self) -> None:
        raw = self._sockets.raw()
        try:
            self._receiver = Receiver(raw)
        except OSError:
            raw.close()
            raise
        self._use(raw)

    def _read(self) -> None:
        receiver = self._receiver
        if receiver is None:
            return
        now = time.monotonic()
        stamps = Stamps(now - time.time(), now - 60.0, now)
        frames: list[Frame] = []
        count = BATCH
        while count == BATCH and len(frames) < _MOST_PER_READ:
            count, _ = receiver.receive(frames, stamps)
        dropped = (receiver.drops - self._drops) & 0xFFFF_FFFF
        self._drops = receiver.drops
        self.lost += dropped
        self._gather(frames)


class TapListener(_Gathering):
    """Listener at the wiretap ``path`` of another process of ours."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self._path = path
        self._rest = b""

    def open(self) -> None:
        tap = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            tap.setblocking(False)
            tap.connect(str(self._path))
        except OSError:
            tap.close()
            raise
        self._use(tap)

    def _read(self) -> None:
        if self._socket is None:
            return
        try:
            data = self._socket.recv(_READ_BYTES)
        except BlockingIOError:
            return
        if not data:
            raise _BusProcessEnded
        data = self._rest + data
        whole = len(data) - len(data) % RECORD.size
        self._rest = data[whole:]
        frames: list[Frame] = []
        for at, can_id, length, content in RECORD.iter_unpack(data[:whole]):
            if can_id == LOST:
                self.lost += int(at)
            else:
                frames.append(Frame(can_id, content[:length], at))
        self._gather(frames)


def listener_of(interface: str, channel: str, tap: Path) -> Listener:
    """Listener of a bus of a site file; ``tap`` is the socket where its process would pass frames on."""
    return SocketCanListener(channel) if interface == "socketcan" else TapListener(tap)
