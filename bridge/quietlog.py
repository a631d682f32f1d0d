"""Lines of the log that others can bring about: the first of each kind and source, then how many.

All of them go through one handler, so that a line that nobody has thought of fills no disk either.
"""

from __future__ import annotations

import copy
import logging
import threading
import time
from collections.abc import Callable, Hashable
from math import inf
from typing import Any, Final, Protocol

from bridge.ratelimit import PAUSE_S, Repeats

_KIND: Final = "line_kind"
_SOURCE: Final = "line_source"


def about(source: str, kind: Hashable = None) -> dict[str, Hashable]:
    """For ``extra`` of a call that others bring about: who or what it is about. Lines of one call are of one
    kind unless ``kind`` tells them apart."""
    return {_SOURCE: source, _KIND: kind}


class Timer(Protocol):
    def start(self) -> None: ...

    def cancel(self) -> None: ...


def _timer(delay_s: float, call: Callable[[], None]) -> Timer:
    timer = threading.Timer(delay_s, call)
    timer.daemon = True
    timer.name = "log counts"
    return timer


class QuietHandler(logging.StreamHandler[Any]):
    """Writes to ``stream``, standard error where there is none. ``clock`` is monotonic; ``make_timer`` gives
    one that has a call made after some seconds."""

    def __init__(
        self,
        stream: Any = None,
        *,
        clock: Callable[[], float] = time.monotonic,
        make_timer: Callable[[float, Callable[[], None]], Timer] = _timer,
    ) -> None:
        super().__init__(stream)
        self._clock = clock
        self._make_timer = make_timer
        self._repeats = Repeats[logging.LogRecord]()
        self._waiting: Timer | None = None

    def emit(self, record: logging.LogRecord) -> None:
        """Called with the handler's lock held. Raises nothing, whatever is to be logged."""
        try:
            is_told = record.levelno <= logging.DEBUG or self._admits(record)
        except Exception:  # noqa: BLE001 - such as arguments that do not fit the text
            self.handleError(record)
            return
        if is_told:
            super().emit(record)
        elif self._waiting is None:
            self._wait(PAUSE_S)

    def _admits(self, record: logging.LogRecord) -> bool:
        now = self._clock()
        place = record.pathname, record.lineno
        if hasattr(record, _SOURCE):
            kind = place, getattr(record, _KIND)
            return self._repeats.admits(kind, getattr(record, _SOURCE), record, now)
        # Nobody says what it is about: the text does, which may be different each time.
        return self._repeats.admits(place, record.getMessage(), record, now)

    def _wait(self, delay_s: float) -> None:
        self._waiting = self._make_timer(delay_s, self.sum_up)
        try:
            self._waiting.start()
        except RuntimeError:  # no thread to be had: the next line that is left out tries again
            self._waiting = None

    def sum_up(self) -> None:
        """Write the counts that are due; from any thread."""
        self.acquire()
        try:
            self._waiting = None
            now = self._clock()
            self._write(self._repeats.due(now))
            next_due = self._repeats.next_due()
            if next_due is not None:
                self._wait(max(next_due - now, 1.0))
        finally:
            self.release()

    def _write(self, counts: list[tuple[logging.LogRecord, int]]) -> None:
        for record, left_out in counts:
            super().emit(_counted(record, left_out))

    def close(self) -> None:
        """The counts that were still to come; called when the process ends."""
        self.acquire()
        try:
            waiting, self._waiting = self._waiting, None
            if waiting:
                waiting.cancel()
            self._write(self._repeats.due(inf))
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
