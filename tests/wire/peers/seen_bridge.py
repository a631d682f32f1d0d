"""``drivebridge`` on virtual buses, and the control words it sends: ``seen_bridge FILE ARGUMENTS``.

FILE gets a line ``<monotonic time> <COB-ID> <control word>`` for each change.
"""

from __future__ import annotations

import os
import sys
import time

from bridge.__main__ import main
from bridge.can import virtual
from bridge.canopen.frame import Frame

FILE = os.open(sys.argv.pop(1), os.O_WRONLY | os.O_CREAT | os.O_APPEND)
RPDOS = (0x200, 0x300, 0x400, 0x500)
_words: dict[int, int] = {}


class SeenWire(virtual.VirtualWire):
    def __init__(self, seed: int = 0) -> None:
        super().__init__(seed)
        self.listeners.append(note)


def note(frame: Frame) -> None:
    if frame.can_id & 0x780 in RPDOS:
        word = int.from_bytes(frame.data[:2], "little")
        if _words.get(frame.can_id) != word:
            _words[frame.can_id] = word
            os.write(FILE, f"{time.monotonic()} {frame.can_id:X} {word:04X}\n".encode())


virtual.VirtualWire = SeenWire  # type: ignore[misc]
main()
