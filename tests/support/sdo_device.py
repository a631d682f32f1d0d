"""A small CANopen device for tests of those who ask: an object dictionary behind any SDO channels."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from dataclasses import dataclass, field

from bridge.canopen.frame import REMOTE, Frame

_MUX = struct.Struct("<BHB")


@dataclass
class SdoDevice:
    """Objects by (index, sub), up to four bytes each. ``channels`` are request and answer COB-IDs.

    With ``state`` it answers to node guarding.
    """

    node_id: int
    objects: Mapping[tuple[int, int], bytes]
    channels: Mapping[int, int] = field(default_factory=dict)
    state: int | None = None
    asked: list[Frame] = field(default_factory=list)

    def on_frame(self, frame: Frame) -> list[Frame]:
        channels = {0x600 + self.node_id: 0x580 + self.node_id, **self.channels}
        if frame.can_id == (0x700 + self.node_id) | REMOTE:
            self.asked.append(frame)
            return [] if self.state is None else [Frame(0x700 + self.node_id, bytes((self.state,)))]
        if frame.can_id not in channels or frame.data[0] == 0x80:
            return []
        self.asked.append(frame)
        command, index, sub = _MUX.unpack_from(frame.data)
        value = self.objects.get((index, sub))
        if command != 0x40 or value is None:
            data = _MUX.pack(0x80, index, sub) + struct.pack("<I", 0x06020000)
        else:
            data = _MUX.pack(0x43 | (4 - len(value)) << 2, index, sub) + value.ljust(4, b"\0")
        return [Frame(channels[frame.can_id], data)]


def u32(value: int) -> bytes:
    return value.to_bytes(4, "little")
