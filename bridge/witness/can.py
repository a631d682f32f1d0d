"""Frames of a CAN interface with the kernel's time stamps, for the witness: a socket that only listens."""

from __future__ import annotations

import socket
import struct
import time
from collections.abc import Iterator, Sequence
from typing import Final

_FRAME: Final = struct.Struct("=IB3x8s")
_FILTER: Final = struct.Struct("=II")
_STAMP: Final = struct.Struct("@ll")
_SOL_CAN_RAW: Final = 101
_CAN_RAW_FILTER: Final = 1
_EXACT: Final = 0xC000_07FF  # 11-bit data frames with exactly this identifier
_SO_TIMESTAMPNS: Final = 35
_BUFFER: Final = 1 << 20
_AGE_MOST_S: Final = 1.0
"""Greatest age of a time stamp, seconds: stamps are wall clock, an older one shows that the clock was set
meanwhile."""


class CanSocket:
    """Frames with these identifiers on ``channel``. Raises OSError where there is no such interface."""

    def __init__(self, channel: str, can_ids: Sequence[int]) -> None:
        self._socket = socket.socket(socket.AF_CAN, socket.SOCK_RAW | socket.SOCK_NONBLOCK, socket.CAN_RAW)
        try:
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _BUFFER)
            self._socket.setsockopt(socket.SOL_SOCKET, _SO_TIMESTAMPNS, 1)
            filters = b"".join(_FILTER.pack(can_id, _EXACT) for can_id in can_ids)
            self._socket.setsockopt(_SOL_CAN_RAW, _CAN_RAW_FILTER, filters)
            self._socket.bind((channel,))
        except OSError:
            self._socket.close()
            raise

    def fileno(self) -> int:
        return self._socket.fileno()

    def close(self) -> None:
        self._socket.close()

    def frames(self) -> Iterator[tuple[int, bytes, float]]:
        """Frames received since the last call: identifier, data, time of reception on the monotonic clock. An
        interface that is down gives none."""
        while True:
            try:
                data, control, _, _ = self._socket.recvmsg(_FRAME.size, 64)
            except (BlockingIOError, InterruptedError):
                return
            except OSError:
                return
            can_id, length, payload = _FRAME.unpack(data)
            yield can_id & 0x7FF, payload[:length], _received(control)


def _received(control: list[tuple[int, int, bytes]]) -> float:
    now = time.monotonic()
    for level, kind, stamp in control:
        if level == socket.SOL_SOCKET and kind == _SO_TIMESTAMPNS:
            seconds, nanoseconds = _STAMP.unpack(stamp[: _STAMP.size])
            age_s = time.time() - seconds - nanoseconds * 1e-9
            if 0.0 <= age_s <= _AGE_MOST_S:
                return now - age_s
    return now
