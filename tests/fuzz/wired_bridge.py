"""``drivebridge`` on a virtual wire that others can reach: ``wired_bridge.py FOLDER ARGUMENTS``.

Datagrams to the socket FOLDER/wire are frames that somebody else puts on the wire: the identifier with
SocketCAN's flags, big endian, and the data. FOLDER/words gets a line ``<monotonic time> <COB-ID> <data>`` for
each change of an RPDO; FOLDER/frames, where it is there, one for each frame.
"""

from __future__ import annotations

import asyncio
import contextlib
import os
import socket
import struct
import sys
import time
from pathlib import Path

from bridge.__main__ import main
from bridge.can import virtual
from bridge.canopen.frame import STANDARD_MASK, Frame

FOLDER = Path(sys.argv.pop(1))
RPDOS = (0x200, 0x300, 0x400, 0x500)
MOST_AT_ONCE = 50
HEAD = struct.Struct(">I")


class WiredWire(virtual.VirtualWire):
    """One end more, for strangers."""

    def __init__(self, seed: int = 0) -> None:
        super().__init__(seed)
        self._words: dict[int, bytes] = {}
        self._notes = os.open(FOLDER / "words", os.O_WRONLY | os.O_CREAT | os.O_APPEND)
        self._frames = None
        with contextlib.suppress(FileNotFoundError):
            self._frames = os.open(FOLDER / "frames", os.O_WRONLY | os.O_APPEND)
        self.listeners.append(self._note)
        self._stranger = self.end("stranger")
        self._stranger.accept([])
        self._stranger.open(lambda: None)
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._socket.bind(str(FOLDER / "wire"))
        asyncio.get_running_loop().add_reader(self._socket, self._inject)

    def _inject(self) -> None:
        with contextlib.suppress(BlockingIOError):
            for _ in range(MOST_AT_ONCE):
                raw = self._socket.recv(64)
                now = time.monotonic()
                can_id = HEAD.unpack_from(raw)[0]
                self._stranger.send(Frame(can_id, raw[HEAD.size : HEAD.size + 8]), now, now)

    def _note(self, frame: Frame) -> None:
        line = f"{time.monotonic():.6f} {frame.can_id:X} {frame.data.hex()}\n".encode()
        if self._frames is not None:
            os.write(self._frames, line)
        can_id = frame.can_id & STANDARD_MASK
        if can_id & 0x780 in RPDOS and self._words.get(can_id) != frame.data:
            self._words[can_id] = frame.data
            os.write(self._notes, line)


virtual.VirtualWire = WiredWire  # type: ignore[misc]
main()
