"""Keeps one bad item from ending the task that works through all of them."""

from __future__ import annotations

import logging
from types import TracebackType
from typing import Final

_log = logging.getLogger(__name__)

_LONGEST: Final = 300


class Guard:
    """``with guard:`` around the work on one item: what it raises is counted and logged, and goes no further.

    ``work`` is part of the message. The first fault is logged with its traceback, then the 10th, the 100th
    and so on with their number. Cancellation passes through.
    """

    def __init__(self, work: str) -> None:
        self.faults = 0
        self._work = work
        self._next = 1

    def __enter__(self) -> None:
        pass

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> bool:
        if not isinstance(error, Exception):
            return False
        self.note(error)
        return True

    def note(self, error: Exception) -> None:
        """Count and log ``error``, which was caught elsewhere."""
        self.faults += 1
        if self.faults < self._next:
            return
        self._next *= 10
        if self.faults == 1:
            _log.error("%s: unexpected: %s", self._work, repr(error)[:_LONGEST], exc_info=error)
        else:
            _log.error("%s: unexpected: %s (%d so far)", self._work, repr(error)[:_LONGEST], self.faults)
