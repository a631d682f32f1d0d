"""TIME producer (CiA 301 §7.2.6): TIME_OF_DAY on COB-ID 100h.

Six bytes: milliseconds after midnight in the low 28 bits of the first four, days since 1984-01-01 in
the last two (CiA 301 §7.1.6.5). The time is UTC.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import Final

from bridge.canopen import cobid
from bridge.canopen.frame import Frame

_FORMAT: Final = struct.Struct("<IH")
_EPOCH_DAYS: Final = 5113
"""Days from 1970-01-01 to 1984-01-01."""
_DAY_MS: Final = 86_400_000
_MOST_DAYS: Final = 0xFFFF


def encode(epoch_ns: int) -> bytes:
    """Nanoseconds since 1970 as TIME_OF_DAY, clipped to the years 1984 to 2163."""
    days, ms = divmod(epoch_ns // 1_000_000, _DAY_MS)
    days -= _EPOCH_DAYS
    if days < 0:
        days, ms = 0, 0
    elif days > _MOST_DAYS:
        days, ms = _MOST_DAYS, _DAY_MS - 1
    return _FORMAT.pack(ms, days)


def decode(data: bytes) -> int | None:
    """Milliseconds since 1970 in a TIME message, or None if it is none."""
    if len(data) != _FORMAT.size:
        return None
    ms, days = _FORMAT.unpack(data)
    return (days + _EPOCH_DAYS) * _DAY_MS + (ms & 0x0FFF_FFFF)


class TimeProducer:
    """Sends TIME every ``period_s``; ``epoch_ns`` gives the wall clock at a monotonic time."""

    def __init__(self, period_s: float, epoch_ns: Callable[[float], int]) -> None:
        self._period_s = period_s
        self._epoch_ns = epoch_ns
        self._due: float | None = None

    def next_deadline(self) -> float | None:
        return self._due

    def on_time(self, now: float) -> Frame | None:
        """The frame that is due. After a pause one frame is sent at once, and missed ones are skipped."""
        if self._due is not None and now < self._due:
            return None
        late = self._due is None or now - self._due >= self._period_s
        self._due = (now if late or self._due is None else self._due) + self._period_s
        return Frame(cobid.TIME, encode(self._epoch_ns(now)))
