"""The fastest SDO server that Python can be: answers every expedited read at once with four bytes.

sdo_slave.py CHANNEL NODE_ID …

For measuring clients: what it needs itself is the same for each of them.
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from tests.peers.can_end import FRAME, can_end


def main(channel: str, node_ids: list[int]) -> None:
    with can_end(channel, *((0x600 + node_id, 0xC00007FF) for node_id in node_ids)) as bus:
        frames = {
            0x600 + node_id: bytearray(FRAME.pack(0x580 + node_id, 8, b"\x43\0\0\0\x2a\0\0\0"))
            for node_id in node_ids
        }
        print("the SDO server is there", flush=True)
        asked = bytearray(FRAME.size)
        while True:
            bus.recv_into(asked)
            frame = frames.get(asked[0] | asked[1] << 8)
            if frame and asked[8] == 0x40:
                frame[9:12] = asked[9:12]
                bus.send(frame)


if __name__ == "__main__":
    main(sys.argv[1], [int(argument) for argument in sys.argv[2:]])
