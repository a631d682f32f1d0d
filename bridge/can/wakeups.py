"""Times at which frames are fetched from a socket: at once where the bus is quiet, some together where it is
busy."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from math import inf
from typing import Final

_CROWD_S: Final = 0.0006
"""Frames that come faster than this are fetched together."""
_HOLD_S: Final = 0.0005
"""Time for which the first of them waits; the event loop makes a whole millisecond of it."""


class Wakeups:
    """Calls ``wake`` in the event loop when a socket has something. Whoever fetches it tells ``fetched``.

    A wake-up costs more than ten frames. So on a busy bus the socket is not waited for but looked at, until
    a look finds less than two frames. A frame that comes after one of ours may be the answer to it: that
    makes no bus busy. What is due and what is asked for is done in rounds of its own, which
    fetch the frames that wait, too: only frames can be late, by a millisecond at most.
    """

    def __init__(self) -> None:
        self._wake: Callable[[], None] = lambda: None
        self._loop: asyncio.AbstractEventLoop | None = None
        self._file: int | None = None
        self._last = -inf
        self._fetched = 0
        self._has_asked = False
        self._timer: asyncio.TimerHandle | None = None

    def begin(self, loop: asyncio.AbstractEventLoop, wake: Callable[[], None]) -> None:
        """Before the first ``open``."""
        self._loop = loop
        self._wake = wake

    def open(self, file: int) -> None:
        self._file = file
        self._wait()

    def close(self) -> None:
        """Before the socket is closed. May be called again."""
        if self._timer:
            self._timer.cancel()
            self._timer = None
        if self._file is not None and self._loop:
            self._loop.remove_reader(self._file)
        self._file = None

    def fetched(self, count: int) -> None:
        self._fetched += count

    def sent(self) -> None:
        """A frame of ours, to which somebody may answer."""
        self._has_asked = True

    def _wait(self) -> None:
        if self._file is not None and self._loop:
            self._loop.add_reader(self._file, self._on_readable, self._loop, self._file)

    def _on_readable(self, loop: asyncio.AbstractEventLoop, file: int) -> None:
        now = loop.time()
        is_crowd, self._last = now - self._last < _CROWD_S and not self._has_asked, now
        self._has_asked = False
        if is_crowd:
            loop.remove_reader(file)
            self._look_soon(loop)
        self._wake()

    def _look_soon(self, loop: asyncio.AbstractEventLoop) -> None:
        self._fetched = 0
        self._timer = loop.call_later(_HOLD_S, self._look, loop)

    def _look(self, loop: asyncio.AbstractEventLoop) -> None:
        self._timer = None
        self._wake()
        if self._file is None:
            return  # the bus broke down
        if self._fetched > 1:
            self._look_soon(loop)
        else:
            self._last = loop.time()
            self._wait()
