"""Schedule of looks at an interface: once a second while it works, less and less often while it is gone."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Final

from bridge.can.netlink import Link

_LOOK_S: Final = 1.0
_REOPEN_S: Final = (0.2, 5.0)


class LinkWatch:
    """Asks the kernel in a thread: the answer waits while anybody changes a network interface of the machine
    (rtnl_lock), and no bus may wait for that. Times are monotonic seconds."""

    def __init__(self, look: Callable[[], Link]) -> None:
        self._look = look
        self._loop: asyncio.AbstractEventLoop | None = None
        self._wake: Callable[[], None] = lambda: None
        self._looking: asyncio.Future[Link] | None = None
        self._due: float | None = None
        self._is_gone = False
        self._pause_s = _REOPEN_S[0]

    def begin(self, loop: asyncio.AbstractEventLoop, wake: Callable[[], None]) -> None:
        """``wake`` is called when an answer is there."""
        self._loop, self._wake = loop, wake

    def opened(self, now: float) -> None:
        """The interface is in use."""
        self._is_gone = False
        self._pause_s = _REOPEN_S[0]
        self._due = now + _LOOK_S

    def lost(self, now: float) -> None:
        """The interface is gone. The answer to a pending question would be about its former state."""
        self._looking = None
        self._is_gone = True
        self._plan(now)

    def end(self) -> None:
        self._looking = self._due = None

    def take(self) -> asyncio.Future[Link] | None:
        """An answer that is there: a link, or the OSError that the kernel gave."""
        looking = self._looking
        if looking is None or not looking.done():
            return None
        self._looking = None
        return looking

    def next_deadline(self) -> float | None:
        return self._due

    def on_time(self, now: float) -> None:
        if self._due is None or now < self._due:
            return
        self._plan(now)
        if self._loop and self._looking is None:
            self._looking = self._loop.run_in_executor(None, self._look)
            self._looking.add_done_callback(lambda _: self._wake())

    def _plan(self, now: float) -> None:
        if self._is_gone:
            self._due = now + self._pause_s
            self._pause_s = min(self._pause_s * 2, _REOPEN_S[1])
        else:
            self._due = now + _LOOK_S
