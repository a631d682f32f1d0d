"""Messages to the kernel's broadcast manager, byte by byte (<linux/can/bcm.h>)."""

from __future__ import annotations

import struct

from bridge.can import bcm
from bridge.canopen.frame import Frame


def test_the_message_to_the_broadcast_manager() -> None:
    """<linux/can/bcm.h>, as a 64-bit kernel aligns it."""
    frames = (Frame(0x80, b"\1"), Frame(0x80, b"\2"))
    message = bcm.setup(frames, 0.0105, 9, start=False, at_once=False)
    head = struct.unpack_from("@IIIllllII", message)
    assert head == (1, 1, 9, 0, 10_500, 0, 0, 0x80, 2)
    assert message[-32:] == struct.pack("=IB3x8sIB3x8s", 0x80, 1, b"\1", 0x80, 1, b"\2")
