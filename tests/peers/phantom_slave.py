"""Node 5 with a second SDO server, as a Lenze has it: asked on 645h, answering on 5C5h.

phantom_slave.py CHANNEL

It has no heartbeat and no guarding, so nothing but SDO answers tell that it is there.
"""

import sys

import can

from bridge.canopen.frame import Frame
from tests.support.sdo_device import SdoDevice, u32

OBJECTS = {
    (0x1000, 0): u32(0),
    (0x1018, 1): u32(0x3B),
    (0x1018, 2): u32(8400),
    (0x1018, 3): u32(1),
    (0x1018, 4): u32(77),
    (0x1008, 0): b"8400",
    (0x1200, 1): u32(0x605),
    (0x1201, 1): u32(0x645),
}


def main(channel: str) -> None:
    device = SdoDevice(5, OBJECTS, {0x645: 0x5C5})
    with can.Bus(interface="socketcan", channel=channel) as bus:
        print("the phantom is there", flush=True)
        for message in bus:
            if message.is_remote_frame or message.is_error_frame:
                continue
            for frame in device.on_frame(Frame(message.arbitration_id, bytes(message.data))):
                bus.send(can.Message(arbitration_id=frame.can_id, data=frame.data, is_extended_id=False))


if __name__ == "__main__":
    main(sys.argv[1])
