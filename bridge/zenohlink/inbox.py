"""From zenoh's threads to the event loop, in small portions."""

from __future__ import annotations

import asyncio
import logging
from collections import deque
from collections.abc import Callable
from typing import Final, TypeVarTuple

Arguments = TypeVarTuple("Arguments")

_log = logging.getLogger(__name__)

_LIMIT: Final = 1000
"""Most queries and samples that wait for the loop; what comes on top is refused."""
_AT_ONCE: Final = 32
"""Calls between two looks of the loop at its other business."""


class Inbox:
    """Calls that other threads want to be made in the loop. Belongs to the loop it is created in."""

    def __init__(self) -> None:
        self.refused = 0
        self.is_closed = False
        self._loop = asyncio.get_running_loop()
        self._waiting: deque[Callable[[], None]] = deque()
        self._drain_is_due = False

    def take_in(self, call: Callable[[], None]) -> bool:
        """From any thread. False: there is no room. One wake-up of the loop serves all that waits."""
        if self.is_closed or len(self._waiting) >= _LIMIT:
            self.refused += 1
            return False
        self._waiting.append(call)
        if not self._drain_is_due:
            self._drain_is_due = True
            self.tell(self._drain)
        return True

    def tell(self, call: Callable[[*Arguments], object], *arguments: *Arguments) -> None:
        """From any thread, without a limit: for the ends of what the loop itself has begun."""
        try:
            self._loop.call_soon_threadsafe(call, *arguments)
        except RuntimeError:
            _log.debug("the event loop has ended; nobody is left to be told")

    def _drain(self) -> None:
        # Cleared before the queue is looked at: whoever appends after that wakes the loop again.
        self._drain_is_due = False
        try:
            for _ in range(min(len(self._waiting), _AT_ONCE)):
                self._waiting.popleft()()
        finally:
            if self._waiting and not self._drain_is_due:
                self._drain_is_due = True
                self._loop.call_soon(self._drain)
