"""The witness: what the drives are told, and what they say, with the kernel's time stamps.

It sits on both sides of the gateway (``tests.proof.machine``): what the bridge sends counts where the bridge
sends it, what a drive says where the drive says it. Times are seconds of the monotonic clock.
"""

from __future__ import annotations

import socket
import struct
import threading
import time
from bisect import bisect_left
from collections import deque
from contextlib import suppress
from dataclasses import dataclass
from typing import Final

_FRAME: Final = struct.Struct("=IB3x8s")
"""struct can_frame of <linux/can.h>: identifier with flags, length, data."""
_ERROR_FRAME: Final = 0x2000_0000
_FILTER: Final = struct.Struct("=II")
_SOL_CAN_RAW: Final = 101
_FILTERS: Final = 1
_EXACT: Final = 0xC000_07FF
_OLDEST_S: Final = 10.0
_MOST_RUNS: Final = 2_000
_MOST_TIMES: Final = 500
_PAUSE_S: Final = 1.0
"""The same frame after such a pause is another one: an emergency that comes again, say."""
_LOOK_S: Final = 0.03
"""The kernel has stamped and kept the frames: they are fetched together, which costs the machine less."""
_TIMESTAMPNS, _OVERFLOW = 35, 40
"""SO_TIMESTAMPNS and SO_RXQ_OVFL of <asm-generic/socket.h>; their control messages have the same numbers."""
_STAMP: Final = struct.Struct("@ll")
_COUNT: Final = struct.Struct("@I")
_CONTROL_BYTES: Final = socket.CMSG_SPACE(_STAMP.size) + socket.CMSG_SPACE(_COUNT.size)


@dataclass(slots=True)
class Run:
    """The same frame again and again, without a long pause."""

    first: float
    last: float
    data: bytes


def add_to(track: deque[Run], data: bytes, at: float) -> None:
    """A frame of this identifier was seen."""
    if track and track[-1].data == data and at - track[-1].last < _PAUSE_S:
        track[-1].last = at
    else:
        track.append(Run(at, at, data))


class Clock:
    """The kernel stamps frames by the wall clock, which may be stepped in the middle of it."""

    def __init__(self) -> None:
        self._offsets: deque[float] = deque([self._offset()], maxlen=4)

    def _offset(self) -> float:
        return time.monotonic() - time.time()

    def stepped(self) -> None:
        """The wall clock has been set."""
        self._offsets.appendleft(self._offset())

    def monotonic(self, stamp: float) -> float:
        now = time.monotonic()
        for offset in list(self._offsets):
            if now - _OLDEST_S <= stamp + offset <= now + 0.01:
                return stamp + offset
        return now


class Witness:
    """The identifiers ``can_ids`` on ``channel``."""

    def __init__(self, channel: str, can_ids: list[int], clock: Clock) -> None:
        self._tracks: dict[int, deque[Run]] = {can_id: deque(maxlen=_MOST_RUNS) for can_id in can_ids}
        self._times: dict[int, deque[float]] = {can_id: deque(maxlen=_MOST_TIMES) for can_id in can_ids}
        self._clock = clock
        self._channel = channel
        self._socket = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 22)
        filters = b"".join(_FILTER.pack(can_id, _EXACT) for can_id in can_ids)
        self._socket.setsockopt(_SOL_CAN_RAW, _FILTERS, filters)
        self._socket.setsockopt(socket.SOL_SOCKET, _TIMESTAMPNS, 1)
        self._socket.setsockopt(socket.SOL_SOCKET, _OVERFLOW, 1)
        self._socket.bind((channel,))
        self._socket.setblocking(False)
        self.lost = 0
        """Frames that the kernel could not keep."""
        self._running = True
        self._thread = threading.Thread(target=self._run, daemon=True, name=f"witness {channel}")
        self._thread.start()

    def _run(self) -> None:
        while self._running:
            with suppress(OSError):  # nothing more is there, or the interface is down for a while
                while True:
                    self._receive()
            time.sleep(_LOOK_S)

    def _receive(self) -> None:
        frame, control, _, _ = self._socket.recvmsg(_FRAME.size, _CONTROL_BYTES)
        can_id, length, data = _FRAME.unpack(frame)
        if can_id & _ERROR_FRAME:
            return
        stamp = 0.0
        for _, kind, message in control:
            if kind == _TIMESTAMPNS:
                seconds, nanoseconds = _STAMP.unpack(message)
                stamp = seconds + nanoseconds * 1e-9
            elif kind == _OVERFLOW:
                (self.lost,) = _COUNT.unpack(message)
        self._note(can_id, data[:length], self._clock.monotonic(stamp))

    def _note(self, can_id: int, data: bytes, at: float) -> None:
        self._times[can_id].append(at)
        add_to(self._tracks[can_id], data, at)

    def runs(self, can_id: int, since: float) -> list[Run]:
        """Everything that was seen after ``since``, oldest first, begun or still going on then."""
        seen = list(self._tracks[can_id])
        return seen[bisect_left(seen, since, key=lambda run: run.last) :]

    def times(self, can_id: int, since: float) -> list[float]:
        """When this identifier was seen after ``since``, as far as it is kept."""
        return [at for at in list(self._times[can_id]) if at > since]

    def last_before(self, can_id: int, moment: float) -> float | None:
        """When this identifier was seen last before ``moment``, within the last seconds."""
        return max((at for at in list(self._times[can_id]) if at <= moment), default=None)

    def last(self, can_id: int) -> Run | None:
        track = self._tracks[can_id]
        return track[-1] if track else None

    def close(self) -> None:
        self._running = False
        self._thread.join(1.0)
        self._socket.close()
