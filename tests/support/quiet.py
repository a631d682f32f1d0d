"""The log as it is written: the handler of the program on a string, a clock by hand."""

from __future__ import annotations

import io
import logging
from collections.abc import Iterator
from contextlib import contextmanager

from bridge.base.quietlog import QuietHandler
from bridge.base.ratelimit import PAUSE_S


class QuietLog:
    def __init__(self) -> None:
        self.now = 1000.0
        self._text = io.StringIO()
        self.handler = QuietHandler(self._text, clock=lambda: self.now)

    @property
    def lines(self) -> list[str]:
        return self._text.getvalue().splitlines()

    def pass_minute(self) -> list[str]:
        """The lines that come with the end of the minute."""
        before = len(self.lines)
        self.now += PAUSE_S
        self.handler.sum_up()
        return self.lines[before:]


@contextmanager
def quiet_log() -> Iterator[QuietLog]:
    """The root logger writes there, and there alone."""
    root = logging.getLogger()
    log, handlers, level = QuietLog(), root.handlers[:], root.level
    root.handlers[:] = [log.handler]
    root.setLevel(logging.INFO)
    try:
        yield log
    finally:
        root.handlers[:] = handlers
        root.setLevel(level)
