"""Garbage of the process: looked for between requests, never in the midst of one.

A full collection looks at everything that is alive: 7 ms for ten thousand monitored items. Left alone,
CPython begins one in whatever request makes objects, and looks at all that this request has made, too.
"""

from __future__ import annotations

import asyncio
import gc
from typing import Final

_NEVER: Final = 1_000_000_000
_ENDED_SESSIONS: Final = 100
"""Sessions, of some ten kilobytes each, whose garbage may wait."""
_PERIOD_S: Final = 600.0
"""Time for which all other garbage may wait: requests that were given up, and little else."""


class GarbageCollector:
    """Full collections of a process. What is young is still looked at by CPython itself, in milliseconds."""

    def __init__(self) -> None:
        self._before = gc.get_threshold()
        self._ended = 0
        self._timer: asyncio.TimerHandle | None = None

    def begin(self) -> None:
        """Leave out of all collections what is there now: it lives as long as the process."""
        gc.freeze()
        gc.set_threshold(*self._before[:2], _NEVER)
        self._arm()

    def note_end(self) -> None:
        """Count a session that has ended."""
        self._ended += 1
        if self._ended >= _ENDED_SESSIONS:
            self._ended = 0
            asyncio.get_running_loop().call_soon(gc.collect)

    def end(self) -> None:
        if self._timer:
            self._timer.cancel()
            gc.set_threshold(*self._before)

    def _arm(self) -> None:
        self._timer = asyncio.get_running_loop().call_later(_PERIOD_S, self._on_time)

    def _on_time(self) -> None:
        self._arm()
        gc.collect()
