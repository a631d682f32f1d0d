"""The witness: what the drives are told, and what they say, with the kernel's time stamps.

It sits on both sides of the gateway (``tests.proof.machine``): what the bridge sends counts where the bridge
sends it, what a drive says where the drive says it. Times are seconds of the monotonic clock.
"""

from __future__ import annotations

import socket
import struct
import threading
import time
from collections import deque
from dataclasses import dataclass
from typing import Final

_FRAME: Final = struct.Struct("=IB3x8s")
_FILTER: Final = struct.Struct("=II")
_SO_TIMESTAMPNS: Final = 35
_SOL_CAN_RAW: Final = 101
_FILTERS: Final = 1
_EXACT: Final = 0xC000_07FF
_OLDEST_S: Final = 10.0
_MOST_RUNS: Final = 20_000


@dataclass(slots=True)
class Run:
    """The same frame again and again."""

    first: float
    last: float
    data: bytes


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
        self._offsets[0] = self._offset() if abs(self._offset() - self._offsets[0]) < 1.0 else self._offsets[0]
        for offset in list(self._offsets):
            if now - _OLDEST_S <= stamp + offset <= now + 0.01:
                return stamp + offset
        return now


class Witness:
    """The identifiers ``can_ids`` on ``channel``."""

    def __init__(self, channel: str, can_ids: list[int], clock: Clock) -> None:
        self._tracks: dict[int, deque[Run]] = {can_id: deque(maxlen=_MOST_RUNS) for can_id in can_ids}
        self._clock = clock
        self._channel = channel
        self._socket = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
        self._socket.setsockopt(socket.SOL_SOCKET, _SO_TIMESTAMPNS, 1)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 22)
        filters = b"".join(_FILTER.pack(can_id, _EXACT) for can_id in can_ids)
        self._socket.setsockopt(_SOL_CAN_RAW, _FILTERS, filters)
        self._socket.bind((channel,))
        self._socket.settimeout(0.2)
        self._running = True
        self._thread = threading.Thread(target=self._run, daemon=True, name=f"witness {channel}")
        self._thread.start()

    def _run(self) -> None:
        while self._running:
            try:
                raw, ancillary, _, _ = self._socket.recvmsg(_FRAME.size, 64)
            except TimeoutError:
                continue
            except OSError:  # the interface is down for a while
                time.sleep(0.005)
                continue
            seconds, nanoseconds = struct.unpack("@qq", ancillary[0][2])
            can_id, length, data = _FRAME.unpack(raw)
            self._note(can_id, data[:length], self._clock.monotonic(seconds + nanoseconds * 1e-9))

    def _note(self, can_id: int, data: bytes, at: float) -> None:
        track = self._tracks[can_id & 0x7FF]
        if track and track[-1].data == data:
            track[-1].last = at
        else:
            track.append(Run(at, at, data))

    def runs(self, can_id: int, since: float) -> list[Run]:
        """Everything that was seen after ``since``, oldest first, begun or still going on then."""
        return [run for run in list(self._tracks[can_id]) if run.last >= since]

    def last(self, can_id: int) -> Run | None:
        track = self._tracks[can_id]
        return track[-1] if track else None

    def close(self) -> None:
        self._running = False
        self._thread.join(1.0)
        self._socket.close()
