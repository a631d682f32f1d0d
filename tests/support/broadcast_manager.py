"""A model of the kernel's broadcast manager (net/can/bcm.c) on a virtual clock: it goes on while the process
that told it what to send stands still."""

from __future__ import annotations

import errno
import os
import struct
from collections.abc import Callable
from dataclasses import dataclass

from bridge.canopen.frame import Frame

_HEAD = struct.Struct("@IIIllllII0q")
_FRAME = struct.Struct("=IB3x8s")
_SETUP, _DELETE = 1, 2
_SETTIMER, _STARTTIMER, _ANNOUNCE, _RESET_MULTI_IDX = 1, 2, 8, 0x200
_MOST_FRAMES = 256
LATE_S = 0.00006
"""Each timer is set anew when the last one has run, so a burst is a little slower than its period."""


@dataclass(slots=True)
class _Op:
    frames: list[Frame]
    number: int
    place: int = 0
    count: int = 0
    period_s: float = 0.0
    due: float | None = None


class BroadcastManager:
    """``put`` gets each frame at its time; ``now`` is the kernel's clock."""

    def __init__(self, now: Callable[[], float], put: Callable[[Frame], None]) -> None:
        self._now = now
        self._put = put
        self._ops: dict[int, _Op] = {}

    def send(self, message: bytes, /) -> int:
        kind, flags, count, seconds, microseconds, _, _, can_id, number = _HEAD.unpack_from(message)
        if kind == _DELETE:
            if self._ops.pop(can_id, None) is None:
                raise OSError(errno.EINVAL, os.strerror(errno.EINVAL))
            return len(message)
        assert kind == _SETUP
        if not 1 <= number <= _MOST_FRAMES:
            raise OSError(errno.EINVAL, os.strerror(errno.EINVAL))
        frames = [_frame(message, place) for place in range(number)]
        op = self._ops.get(can_id)
        if op is None:
            op = self._ops[can_id] = _Op(frames, number)
        elif number > op.number:
            raise OSError(errno.E2BIG, os.strerror(errno.E2BIG))
        op.frames[:number] = frames
        if op.number != number or flags & _RESET_MULTI_IDX:
            op.number, op.place = number, 0
        if flags & _SETTIMER:
            op.count, op.period_s = count, seconds + microseconds / 1e6
        if flags & (_STARTTIMER | _ANNOUNCE):
            self._transmit(op)
        if flags & _STARTTIMER:
            op.due = self._now() + op.period_s if op.count else None
        return len(message)

    def _transmit(self, op: _Op) -> None:
        self._put(op.frames[op.place])
        op.place = (op.place + 1) % op.number
        op.count = max(0, op.count - 1)

    def next_deadline(self) -> float | None:
        return min((op.due for op in self._ops.values() if op.due is not None), default=None)

    def on_time(self) -> None:
        """Send what is due now."""
        for op in self._ops.values():
            if op.due is None or op.due > self._now():
                continue
            if op.count:
                self._transmit(op)
            op.due = self._now() + op.period_s + LATE_S if op.count else None

    def close(self) -> None:
        self._ops.clear()


def _frame(message: bytes, place: int) -> Frame:
    can_id, length, data = _FRAME.unpack_from(message, _HEAD.size + place * _FRAME.size)
    return Frame(can_id, data[:length])
