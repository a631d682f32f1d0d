"""Log lines that others can cause at will: the first of each kind and source, then how many. Of events of the
plant the first few, so that a node that is lost and comes back twice is logged twice.

All lines go through one handler, so that a kind that nobody has thought of cannot fill a disk either.
"""

from __future__ import annotations

import copy
import logging
import time
from collections.abc import Callable, Hashable
from math import inf
from typing import Any, Final

from bridge.base.ratelimit import PAUSE_S, Repeats

_KIND: Final = "line_kind"
_SOURCE: Final = "line_source"
_FIRST: Final = "line_first"
A_FEW: Final = 3


def log_source(source: str, kind: Hashable = None, *, first: int = 1) -> dict[str, Hashable]:
    """Source of a log line, for ``extra`` of a call that others can cause: who or what it is about, and how
    many lines are written before they are counted. Lines of one call are of one kind unless ``kind`` tells
    them apart."""
    return {_SOURCE: source, _KIND: kind, _FIRST: first}


class QuietHandler(logging.StreamHandler[Any]):
    """Writes to ``stream``, or standard error. ``clock`` is monotonic.

    Due counts are written before the next line, and by ``sum_up``, which has to be called now and then: there
    is no thread for it, because starting one takes long on a slow machine.
    """

    def __init__(self, stream: Any = None, *, clock: Callable[[], float] = time.monotonic) -> None:
        super().__init__(stream)
        self._clock = clock
        self._repeats = Repeats[logging.LogRecord]()
        self._sum_up_at = inf

    def emit(self, record: logging.LogRecord) -> None:
        """Called with the handler's lock held. Raises nothing, whatever is to be logged."""
        now = self._clock()
        if now >= self._sum_up_at:
            self._sum_up(now)
        try:
            is_told = record.levelno <= logging.DEBUG or self._admits(record, now)
        except Exception:  # noqa: BLE001 - such as arguments that do not fit the text
            self.handleError(record)
            return
        if is_told:
            super().emit(record)
        else:
            self._sum_up_at = min(self._sum_up_at, now + PAUSE_S)

    def _admits(self, record: logging.LogRecord, now: float) -> bool:
        place = record.pathname, record.lineno
        if hasattr(record, _SOURCE):
            kind = place, getattr(record, _KIND)
            return self._repeats.admits(kind, getattr(record, _SOURCE), record, now, getattr(record, _FIRST))
        # Nobody says what it is about: the text does, which may be different each time.
        return self._repeats.admits(place, record.getMessage(), record, now, A_FEW)

    def sum_up(self) -> None:
        """Write the counts that are due; from any thread."""
        self.acquire()
        try:
            now = self._clock()
            if now >= self._sum_up_at:
                self._sum_up(now)
        finally:
            self.release()

    def _sum_up(self, now: float) -> None:
        for record, left_out in self._repeats.due(now):
            super().emit(_counted(record, left_out))
        next_due = self._repeats.next_due()
        self._sum_up_at = inf if next_due is None else next_due

    def close(self) -> None:
        """The counts that were still to come; called when the process ends."""
        self.acquire()
        try:
            self._sum_up(inf)
        finally:
            self.release()
        super().close()


def _counted(record: logging.LogRecord, left_out: int) -> logging.LogRecord:
    """The last of those that were left out, with how many there were and without its traceback."""
    counted = copy.copy(record)
    counted.msg = f"{record.getMessage()} ({left_out} more of this kind)"
    counted.args = None
    counted.exc_info = counted.exc_text = counted.stack_info = None
    return counted
