"""asyncua's own log: one line for each place, then counts."""

from __future__ import annotations

import io
import logging
from collections.abc import Iterator

import pytest

from bridge.base.quietlog import QuietHandler
from bridge.uaserver.librarylog import quieten


class Log:
    """Output of the service on standard error."""

    def __init__(self) -> None:
        self.now = 0.0
        self._stream = io.StringIO()
        self.handler = QuietHandler(self._stream, clock=lambda: self.now)

    @property
    def lines(self) -> list[str]:
        self.handler.sum_up()
        return self._stream.getvalue().splitlines()


@pytest.fixture
def log() -> Iterator[Log]:
    log = Log()
    logging.getLogger().addHandler(log.handler)
    yield log
    logging.getLogger().removeHandler(log.handler)


def test_the_library_says_each_thing_once_a_minute_and_without_traceback(log: Log) -> None:
    library = logging.getLogger("asyncua.test")
    quieten()
    quieten()
    for second in range(100):
        log.now = float(second)
        try:
            raise ValueError(second)
        except ValueError:
            library.exception("while processing %s", "a message")
    assert log.lines == [
        "while processing a message: ValueError(0)",
        "while processing a message: ValueError(60) (60 more of this kind)",
    ]
