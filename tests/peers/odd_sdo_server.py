"""An SDO server, node 5, that answers late, for others, and with damaged blocks.

odd_sdo_server.py CHANNEL

2000h is answered only when something else is asked for, and then first. 2001h is answered behind a frame for
another object and an abort of another object. 2002h is 210 bytes by blocks, with a wrong CRC.
"""

import struct
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from tests.peers.can_end import FRAME, can_end

LATE, FOREIGN, BLOCKS = b"\x00\x20\x00", b"\x01\x20\x00", b"\x02\x20\x00"
LENGTH, SEGMENT = 210, 7


def number(mux: bytes, value: int) -> bytes:
    return b"\x43" + mux + struct.pack("<I", value)


def answers(request: bytes) -> list[bytes]:
    command, mux = request[0], request[1:4]
    if command == 0x40 and mux == FOREIGN:
        abort = b"\x80\x99\x29\x00" + struct.pack("<I", 0x0602_0000)
        return [number(LATE, 0xBAD), number(b"\x09\x20\x00", 0xBAD), abort, number(FOREIGN, 0xC0FFEE)]
    if command == 0x40 and mux == BLOCKS:
        return [b"\x41" + mux + struct.pack("<I", LENGTH)]
    if command & 0xE3 == 0xA0 and mux == BLOCKS:
        return [b"\xc6" + mux + struct.pack("<I", LENGTH)]
    if command == 0xA3:
        count = LENGTH // SEGMENT
        frames = [bytes((n,)) + bytes([n] * SEGMENT) for n in range(1, count + 1)]
        return [*frames[:-1], bytes((0x80 | count,)) + frames[-1][1:]]
    if command & 0xE3 == 0xA2:
        return [b"\xc1\x34\x12" + bytes(5)]  # the CRC is not 1234h
    return []


def main(channel: str) -> None:
    with can_end(channel, (0x605, 0xC000_07FF)) as bus:
        print("the odd server is there", flush=True)
        while True:
            _, _, request = FRAME.unpack(bus.recv(FRAME.size))
            for data in answers(request):
                bus.send(FRAME.pack(0x585, 8, data))


if __name__ == "__main__":
    main(sys.argv[1])
