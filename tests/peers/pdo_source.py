"""Sends TPDOs of node 5, by default as fast as a bus at 1 Mbit/s could.

pdo_source.py CHANNEL COUNT [PER_BURST PAUSE_US [same]]

Their four words change with every one, unless ``same`` is given.
"""

import struct
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from tests.peers.can_end import can_end

_FRAME = struct.Struct("=IB3x4H")


def main(channel: str, count: int, per_burst: int, pause_s: float, changing: bool) -> None:
    with can_end(channel) as bus:
        for number in range(count):
            value = number if changing else 1
            bus.send(_FRAME.pack(0x185, 8, 0x0B37, value & 0x3FFF, value & 0xFF, 0))
            if number % per_burst == per_burst - 1:
                time.sleep(pause_s)


if __name__ == "__main__":
    burst, pause_us = (int(argument) for argument in sys.argv[3:5] or ("100", "12000"))
    main(sys.argv[1], int(sys.argv[2]), burst, pause_us / 1e6, "same" not in sys.argv[5:])
