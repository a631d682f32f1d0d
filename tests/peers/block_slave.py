"""A slave with block transfer on SocketCAN: object 1F20h:00 is a kilobyte that can be written.

It keeps the third segment of the first block it sends to itself, and does not hear the fifth of the first
block it is sent, as on a disturbed bus.
"""

from __future__ import annotations

import socket
import struct
import sys

from bridge.sim.core.dictionary import Dictionary, Domain
from bridge.sim.core.sdo_server import SimulatedSdoServer

FRAME = struct.Struct("=IB3x8s")
OBJECT = 0x1F20


class Value:
    def __init__(self) -> None:
        self.data = bytes(range(256)) * 4

    def get(self) -> bytes:
        return self.data

    def set(self, data: bytes) -> None:
        self.data = data


def main(channel: str, node_id: int) -> None:
    value = Value()
    objects = Dictionary()
    objects.add(OBJECT, 0, Domain(4096, value.get, value.set))
    server = SimulatedSdoServer(objects, block_segments=50)
    unheard, unsent = True, True
    with socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW) as bus:
        bus.setsockopt(
            socket.SOL_CAN_RAW, socket.CAN_RAW_FILTER, struct.pack("=II", 0x600 + node_id, 0xC00007FF)
        )
        bus.bind((channel,))
        print("the block server is there", flush=True)
        while True:
            request = bus.recv(16)[8:]
            if unheard and request[0] == 5:
                unheard = False
                continue
            for answer in server.on_request(request):
                if unsent and answer[0] == 3:
                    unsent = False
                    continue
                bus.send(FRAME.pack(0x580 + node_id, 8, answer))


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]))
