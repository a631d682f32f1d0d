"""One line for each kind and source, then counts; of asyncua's own, too."""

from __future__ import annotations

import io
import logging
from collections.abc import Iterator

import pytest

from bridge.base.quietlog import QuietHandler
from bridge.uaserver.client_notices import tell


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


def test_the_first_is_told_and_the_rest_counted(log: Log) -> None:
    for second in range(120):
        log.now = float(second)
        tell("malformed messages", "10.0.0.9", f"number {second}")
    log.now = 130.0
    assert log.lines == [
        "OPC UA: malformed messages from 10.0.0.9: number 0",
        "OPC UA: malformed messages from 10.0.0.9: number 60 (60 more of this kind)",
        "OPC UA: malformed messages from 10.0.0.9: number 119 (59 more of this kind)",
    ]


def test_one_hides_no_other(log: Log) -> None:
    for kind in ("malformed messages", "refused logins"):
        for source in ("10.0.0.9", "10.0.0.8"):
            tell(kind, source)
            tell(kind, source)
    assert len(log.lines) == 4


def test_a_thousand_sources_cost_a_bounded_number_of_lines(log: Log) -> None:
    for number in range(10_000):
        tell("refused logins", f"10.0.{number >> 8}.{number & 255}", "x" * 10_000)
    assert len(log.lines) <= 501
    assert max(map(len, log.lines)) < 300
