"""Messages to the kernel's broadcast manager (<linux/can/bcm.h>): bursts of one identifier."""

from __future__ import annotations

import struct
from typing import Final

from bridge.canopen.frame import Frame

_FRAME: Final = struct.Struct("=IB3x8s")
# Aligned as the C compiler aligns it; the frames begin on eight bytes.
_HEAD: Final = struct.Struct("@IIIllllII0q")
_TX_SETUP: Final = 1
_TX_DELETE: Final = 2
_SETTIMER: Final = 1
_STARTTIMER: Final = 2
_TX_ANNOUNCE: Final = 8
_TX_RESET_MULTI_IDX: Final = 0x200


def frame_bytes(frame: Frame) -> bytes:
    """``struct can_frame``. A remote frame has the length of what it asks for, and no data."""
    return _FRAME.pack(frame.can_id, len(frame.data), frame.data.ljust(8, b"\0"))


def setup(
    frames: tuple[Frame, ...], period_s: float, count: int, *, start: bool, at_once: bool, anew: bool = False
) -> bytes:
    """Send one of ``frames`` every period, in turn, ``count`` more times.

    ``start`` begins a new phase with a frame; without it a running burst keeps its phase, and unless ``anew``
    its place in ``frames``.
    """
    flags = _SETTIMER | (_STARTTIMER if start else 0) | (_TX_ANNOUNCE if at_once else 0)
    flags |= _TX_RESET_MULTI_IDX if anew else 0
    seconds, microseconds = divmod(round(period_s * 1e6), 1_000_000)
    can_id = frames[0].can_id
    head = _HEAD.pack(_TX_SETUP, flags, count, seconds, microseconds, 0, 0, can_id, len(frames))
    return head + b"".join(frame_bytes(frame) for frame in frames)


def delete(can_id: int) -> bytes:
    """End the burst of this identifier."""
    return _HEAD.pack(_TX_DELETE, 0, 0, 0, 0, 0, 0, can_id, 0)
