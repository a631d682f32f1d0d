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
"""Queries and samples of one share that may wait for the loop; further ones are refused."""
_MOST_SHARES: Final = 64
"""Shares beyond this number count as the first one."""
_AT_ONCE: Final = 32
"""Calls made before the loop gets its turn for other work."""


class Inbox:
    """Calls that other threads hand over to be made in the loop. Belongs to the loop it is created in.

    Calls of one share keep their order; shares take turns, so that a full one delays no other.
    """

    def __init__(self) -> None:
        self.refused = 0
        self.is_closed = False
        self._loop = asyncio.get_running_loop()
        self._shares: dict[str, deque[Callable[[], None]]] = {"": deque()}
        self._next = 0
        self._drain_is_due = False

    def take_in(self, call: Callable[[], None], share: str = "") -> bool:
        """From any thread. False: there is no room. One wake-up of the loop serves all waiting calls."""
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
        """From any thread, without a limit: for the completion of what the loop itself has begun."""
        try:
            self._loop.call_soon_threadsafe(call, *arguments)
        except RuntimeError:
            _log.debug("the event loop has ended; nobody is left to be told")

    def _drain(self) -> None:
        # Cleared before the queues are read: an append after that wakes the loop again.
        self._drain_is_due = False
        try:
            for call in islice(self._in_turn(), _AT_ONCE):
                call()
        finally:
            if any(tuple(self._shares.values())) and not self._drain_is_due:
                self._drain_is_due = True
                self._loop.call_soon(self._drain)

    def _in_turn(self) -> Iterator[Callable[[], None]]:
        """One call of each share in turn, continuing where it stopped."""
        while any(shares := tuple(self._shares.values())):
            for place in (*range(self._next, len(shares)), *range(self._next)):
                if shares[place]:
                    self._next = place + 1
                    yield shares[place].popleft()
