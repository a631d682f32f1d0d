"""One line for each kind and source, then counts."""

from __future__ import annotations

import logging

import pytest

from bridge.northbound.opcua.librarylog import Seldom
from bridge.northbound.opcua.notices import Notices

LOG = logging.getLogger("test.notices")


class Clock:
    now = 0.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def notices(clock: Clock, caplog: pytest.LogCaptureFixture) -> Notices:
    caplog.set_level(logging.WARNING)
    return Notices(LOG, clock)


def test_the_first_is_told_and_the_rest_counted(
    notices: Notices, clock: Clock, caplog: pytest.LogCaptureFixture
) -> None:
    for second in range(200):
        clock.now = float(second)
        notices.sum_up()
        notices.tell("malformed messages", "10.0.0.9", f"number {second}")
    assert caplog.messages == [
        "OPC UA: malformed messages from 10.0.0.9: number 0",
        "OPC UA: malformed messages from 10.0.0.9: 59 more",
        "OPC UA: malformed messages from 10.0.0.9: 60 more",
        "OPC UA: malformed messages from 10.0.0.9: 60 more",
    ]


def test_one_hides_no_other(notices: Notices, caplog: pytest.LogCaptureFixture) -> None:
    for kind in ("malformed messages", "refused logins"):
        for source in ("10.0.0.9", "10.0.0.8"):
            notices.tell(kind, source)
            notices.tell(kind, source)
    assert len(caplog.messages) == 4


def test_after_a_quiet_minute_it_is_told_anew(
    notices: Notices, clock: Clock, caplog: pytest.LogCaptureFixture
) -> None:
    for now in (0.0, 61.0):
        clock.now = now
        notices.sum_up()
        notices.tell("refused logins", "10.0.0.9")
    assert len(caplog.messages) == 2


def test_a_thousand_sources_cost_a_bounded_number_of_lines(
    notices: Notices, caplog: pytest.LogCaptureFixture
) -> None:
    for number in range(10_000):
        notices.tell("refused logins", f"10.0.{number >> 8}.{number & 255}", "x" * 10_000)
    assert len(caplog.messages) <= 501
    assert max(map(len, caplog.messages)) < 300


def test_a_library_says_each_thing_once_a_minute_and_without_traceback(
    clock: Clock, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.WARNING)
    library = logging.getLogger("test.library")
    seldom = Seldom(clock)
    library.addFilter(seldom)
    for second in range(100):
        clock.now = float(second)
        try:
            raise ValueError(second)
        except ValueError:
            library.exception("while processing %s", "a message")
    assert caplog.messages == [
        "while processing a message: ValueError(0)",
        "while processing a message: ValueError(60) (59 more since)",
    ]
    assert all(record.exc_info is None for record in caplog.records)
