"""From zenoh's threads to the event loop, in small portions."""

from __future__ import annotations

import asyncio
import logging
from collections import deque
from collections.abc import Callable, Iterator
from itertools import islice
from typing import Final, TypeVarTuple

Arguments = TypeVarTuple("Arguments")

_log = logging.getLogger(__name__)

_LIMIT: Final = 1000
"""Most queries and samples of one share that wait for the loop; what comes on top is refused."""
_MOST_SHARES: Final = 64
"""Further ones count as the first."""
_AT_ONCE: Final = 32
"""Calls between two looks of the loop at its other business."""


class Inbox:
    """Calls that other threads want to be made in the loop. Belongs to the loop it is created in.

    Those of one share keep their order; shares have their turns, so that who fills his holds up no other.
    """

    def __init__(self) -> None:
        self.refused = 0
        self.is_closed = False
        self._loop = asyncio.get_running_loop()
        self._shares: dict[str, deque[Callable[[], None]]] = {"": deque()}
        self._next = 0
        self._drain_is_due = False

    def take_in(self, call: Callable[[], None], share: str = "") -> bool:
        """From any thread. False: there is no room. One wake-up of the loop serves all that waits."""
        if share not in self._shares and len(self._shares) >= _MOST_SHARES:
            share = ""
        waiting = self._shares.setdefault(share, deque())
        if self.is_closed or len(waiting) >= _LIMIT:
            self.refused += 1
            return False
        waiting.append(call)
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
        # Cleared before the queues are looked at: whoever appends after that wakes the loop again.
        self._drain_is_due = False
        try:
            for call in islice(self._in_turn(), _AT_ONCE):
                call()
        finally:
            if any(tuple(self._shares.values())) and not self._drain_is_due:
                self._drain_is_due = True
                self._loop.call_soon(self._drain)

    def _in_turn(self) -> Iterator[Callable[[], None]]:
        """A call of each share after the other, going on where it was left."""
        while any(shares := tuple(self._shares.values())):
            for place in (*range(self._next, len(shares)), *range(self._next)):
                if shares[place]:
                    self._next = place + 1
                    yield shares[place].popleft()
