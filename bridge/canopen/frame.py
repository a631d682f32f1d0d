"""A CAN frame as the wire has it."""

from __future__ import annotations

from typing import Final, NamedTuple

# Flags above the identifier, as in <linux/can.h>, so that a frame from the kernel needs no translation.
EXTENDED: Final = 0x8000_0000
REMOTE: Final = 0x4000_0000
ERROR: Final = 0x2000_0000
STANDARD_MASK: Final = 0x7FF


class Frame(NamedTuple):
    """One classic CAN frame.

    ``can_id`` is the identifier with SocketCAN's flag bits (``EXTENDED``, ``REMOTE``, ``ERROR``), so a plain
    data frame with an 11-bit identifier compares equal to its COB-ID. ``time`` is the moment of reception in
    seconds of the monotonic clock, 0.0 in frames that have not been sent yet.
    """

    can_id: int
    data: bytes = b""
    time: float = 0.0

    def __repr__(self) -> str:
        remote = "R" if self.can_id & REMOTE else ""
        return f"{self.can_id & 0x1FFF_FFFF:03X}#{remote}{self.data.hex().upper()}"
