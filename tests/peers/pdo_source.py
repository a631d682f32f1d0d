"""Sends TPDOs of node 5 as fast as a bus at 1 Mbit/s could, whose four words change with every one.

pdo_source.py CHANNEL COUNT
"""

import socket
import struct
import sys
import time

_FRAME = struct.Struct("=IB3x4H")
PER_BURST = 100
PAUSE_S = 0.012


def main(channel: str, count: int) -> None:
    with socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW) as bus:
        bus.bind((channel,))
        for number in range(count):
            bus.send(_FRAME.pack(0x185, 8, 0x0B37, number & 0x3FFF, number & 0xFF, 0))
            if number % PER_BURST == PER_BURST - 1:
                time.sleep(PAUSE_S)


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]))
