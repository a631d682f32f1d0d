"""Sends one frame again and again from a process of its own.

can_sender.py CHANNEL IDENTIFIER DATA PERIOD_S COUNT

IDENTIFIER and DATA are hexadecimal.
"""

import struct
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from tests.peers.can_end import can_end

_FRAME = struct.Struct("=IB3x8s")


def main(channel: str, can_id: int, data: bytes, period_s: float, count: int) -> None:
    with can_end(channel) as bus:
        print("sending", flush=True)
        for _ in range(count):
            bus.send(_FRAME.pack(can_id, len(data), data.ljust(8, b"\0")))
            time.sleep(period_s)


if __name__ == "__main__":
    channel, can_id, data, period, count = sys.argv[1:]
    main(channel, int(can_id, 16), bytes.fromhex(data), float(period), int(count))
