"""Garbage of the process: looked for when sessions have ended, never in the midst of a request.

A full collection looks at everything that is alive: 0.2 s for a hundred thousand monitored items. Left alone,
CPython begins one in whatever request makes objects, and all others wait for it.
"""

from __future__ import annotations

import asyncio
import gc
from typing import Final

_NEVER: Final = 1_000_000_000
_ENDED_SESSIONS: Final = 100
"""Sessions, of some ten kilobytes each, whose garbage may wait."""


class GarbageCollector:
    """Full collections of a process. What is young is still looked at by CPython itself, in milliseconds."""

    def __init__(self) -> None:
        self._before = gc.get_threshold()
        self._ended = 0

    def begin(self) -> None:
        """What is there now lives as long as the process: no collection need look at it again."""
        gc.freeze()
        gc.set_threshold(*self._before[:2], _NEVER)

    def note_end(self) -> None:
        """A session has ended."""
        self._ended += 1
        if self._ended >= _ENDED_SESSIONS:
            self._ended = 0
            asyncio.get_running_loop().call_soon(gc.collect)

    def end(self) -> None:
        gc.set_threshold(*self._before)
