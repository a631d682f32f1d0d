"""LSS slaves on a real bus, each said by its identity in hexadecimal; prints what became of them.

lss_slave.py CHANNEL [talks=]VENDOR:PRODUCT:REVISION:SERIAL …

One that talks answers every question of a fastscan once it was found, as CANopenNode 4 does.
"""

import select
import socket
import struct
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from tests.support.lss_slave import LssSlave

_FRAME = struct.Struct("=IB3x8s")


def slave_of(text: str) -> LssSlave:
    kind, _, identity = text.rpartition("=")
    vendor, product, revision, serial = (int(part, 16) for part in identity.split(":"))
    return LssSlave((vendor, product, revision, serial), talks_when_found=kind == "talks")


def main(channel: str, *identities: str) -> None:
    slaves = [slave_of(text) for text in identities]
    with socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW) as bus:
        bus.bind((channel,))
        print("the slaves are there", flush=True)
        while True:
            select.select([bus], [], [])
            can_id, _, data = _FRAME.unpack(bus.recv(_FRAME.size))
            if can_id != 0x7E5:
                continue
            for slave in slaves:
                before = slave.node_id, slave.stored
                answer = slave.on_request(data)
                if answer is not None:
                    bus.send(_FRAME.pack(0x7E4, 8, answer))
                if (slave.node_id, slave.stored) != before:
                    print(f"{slave.identity[3]:X}: id {slave.node_id}, stored {slave.stored}", flush=True)


if __name__ == "__main__":
    main(sys.argv[1], *sys.argv[2:])
