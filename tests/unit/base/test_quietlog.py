"""The quiet log: the first of a kind and source is told, the others are counted, and nothing fills a disk."""

from __future__ import annotations

import io
import logging

import pytest

from bridge.base.quietlog import QuietHandler, log_source
from bridge.base.ratelimit import PAUSE_S


class Log:
    def __init__(self) -> None:
        self.now = 1000.0
        self.stream = io.StringIO()
        self.handler = QuietHandler(self.stream, clock=lambda: self.now)
        self.handler.setFormatter(logging.Formatter("%(message)s"))
        self.logger = logging.Logger("quiet", logging.DEBUG)
        self.logger.addHandler(self.handler)

    def lines(self) -> list[str]:
        found = self.stream.getvalue().splitlines()
        self.stream.seek(0)
        self.stream.truncate()
        return found

    def refuses(self, source: str, text: str = "refused", *, first: int = 1, kind: str | None = None) -> None:
        self.logger.warning("%s: %s", source, text, extra=log_source(source, kind, first=first))


@pytest.fixture
def log() -> Log:
    return Log()


def test_the_first_of_a_source_is_told_and_the_others_are_counted(log: Log) -> None:
    for number in range(5):
        log.refuses("10.0.0.1", str(number))
    assert log.lines() == ["10.0.0.1: 0"]
    log.now += PAUSE_S
    log.handler.sum_up()
    assert log.lines() == ["10.0.0.1: 4 (4 more of this kind)"]


def test_another_source_and_another_kind_have_lines_of_their_own(log: Log) -> None:
    log.refuses("10.0.0.1", kind="login")
    log.refuses("10.0.0.2", kind="login")
    log.refuses("10.0.0.1", kind="write")
    assert len(log.lines()) == 3


def test_as_many_are_told_as_were_asked_for(log: Log) -> None:
    for number in range(5):
        log.refuses("10.0.0.1", str(number), first=3)
    assert len(log.lines()) == 3


def test_a_count_that_is_due_comes_before_the_next_line(log: Log) -> None:
    log.refuses("10.0.0.1")
    log.refuses("10.0.0.1")
    log.now += PAUSE_S
    log.refuses("10.0.0.2")
    assert log.lines()[1:] == ["10.0.0.1: refused (1 more of this kind)", "10.0.0.2: refused"]


def test_before_it_is_due_no_count_is_written_and_at_the_end_each_is(log: Log) -> None:
    log.refuses("10.0.0.1")
    log.refuses("10.0.0.1")
    log.handler.sum_up()
    assert len(log.lines()) == 1
    log.handler.close()
    assert log.lines() == ["10.0.0.1: refused (1 more of this kind)"]


def test_lines_that_nobody_has_thought_of_are_counted_by_their_text(log: Log) -> None:
    for number in range(10):
        log.logger.error("the same")
        log.logger.debug("%d", number)
    lines = log.lines()
    assert lines.count("the same") == 3
    assert len(lines) == 13, "debug lines are nobody's flood"


def test_a_traceback_is_not_repeated_with_the_count(log: Log) -> None:
    for _ in range(2):
        try:
            raise ValueError("inside")
        except ValueError:
            log.logger.exception("failed", extra=log_source("x"))
    assert "ValueError: inside" in log.lines()
    log.handler.close()
    assert log.lines() == ["failed (1 more of this kind)"]


def test_what_cannot_be_put_into_words_raises_nothing(log: Log, capsys: pytest.CaptureFixture[str]) -> None:
    log.logger.error("%d", "no number")
    assert "Logging error" in capsys.readouterr().err
