"""One precise timer in an asyncio loop.

``call_at`` wakes up to a millisecond or two late, because the loop rounds its time-outs up; a timerfd
that the loop polls like a socket does not.
"""

from __future__ import annotations

import asyncio
import ctypes
import os
import struct
from collections.abc import Callable
from typing import Final

_CLOCK_MONOTONIC: Final = 1
_TFD_NONBLOCK: Final = 0o4000
_TFD_CLOEXEC: Final = 0o2000000
_TFD_TIMER_ABSTIME: Final = 1
_ITIMERSPEC: Final = struct.Struct("@qqqq")  # interval s, ns, value s, ns
_FLOOR_S: Final = 1e-6


class LoopTimer:
    """Timer that calls ``wake`` at the armed time; one time is armed at a time, the newest counts."""

    def __init__(
        self, loop: asyncio.AbstractEventLoop, clock: Callable[[], float], wake: Callable[[], None]
    ) -> None:
        self._loop = loop
        self._clock = clock
        self._wake = wake
        self._handle: asyncio.TimerHandle | None = None
        self._armed_ns = 0
        """Time that the timerfd is set to and that has not come yet, in ns; 0 if there is none."""
        self._libc = _library_with_timerfd()
        self._fd = -1
        if self._libc:
            self._fd = self._libc.timerfd_create(_CLOCK_MONOTONIC, _TFD_NONBLOCK | _TFD_CLOEXEC)
        if self._fd >= 0:
            loop.add_reader(self._fd, self._on_readable)

    def arm(self, at: float) -> None:
        """Wake at ``at`` (monotonic seconds), or at once if that is past."""
        if self._fd < 0 or self._libc is None:
            if self._handle:
                self._handle.cancel()
            delay = max(0.0, at - self._clock())
            self._handle = self._loop.call_later(delay, self._wake)
            return
        # 0 would disarm the timer; a time in the past expires at once.
        nanoseconds = round(max(at, _FLOOR_S) * 1e9)
        if nanoseconds == self._armed_ns:
            return
        self._armed_ns = nanoseconds
        spec = _ITIMERSPEC.pack(0, 0, nanoseconds // 1_000_000_000, nanoseconds % 1_000_000_000)
        self._libc.timerfd_settime(self._fd, _TFD_TIMER_ABSTIME, spec, None)

    def _on_readable(self) -> None:
        try:
            os.read(self._fd, 8)
        except BlockingIOError:
            return  # re-armed between the poll and this call
        self._armed_ns = 0
        self._wake()

    def close(self) -> None:
        if self._handle:
            self._handle.cancel()
        if self._fd >= 0:
            self._loop.remove_reader(self._fd)
            os.close(self._fd)
            self._fd = -1


def _library_with_timerfd() -> ctypes.CDLL | None:
    """The C library; None where the system has no timerfd (it is Linux's own)."""
    try:
        library = ctypes.CDLL(None)
    except (OSError, TypeError):
        return None
    return library if hasattr(library, "timerfd_create") else None
