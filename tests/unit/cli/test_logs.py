"""The log: what others can bring about is one line of each kind and source, then a count."""

from __future__ import annotations

import asyncio
import errno
import logging
import os
from collections.abc import Iterator

import pytest

from bridge.base.quietlog import A_FEW, log_source
from bridge.base.ratelimit import PAUSE_S
from bridge.cli.logs import _Formatter, log_fault, write_counts
from tests.support.quiet import QuietLog, quiet_log

_log = logging.getLogger("somebody")


@pytest.fixture
def log() -> Iterator[QuietLog]:
    with quiet_log() as log:
        yield log


def closed(host: str, number: int = 0) -> None:
    _log.warning("connection of %s closed: %d", host, number, extra=log_source(host))


def test_the_first_of_each_kind_and_source_is_a_line_and_the_others_a_count(log: QuietLog) -> None:
    for number in range(1000):
        closed("10.0.0.1", number)
    closed("10.0.0.2")
    assert log.lines == ["connection of 10.0.0.1 closed: 0", "connection of 10.0.0.2 closed: 0"]
    assert log.pass_minute() == ["connection of 10.0.0.1 closed: 999 (999 more of this kind)"]


def test_a_flood_that_goes_on_is_a_line_a_minute_and_then_it_begins_anew(log: QuietLog) -> None:
    for _ in range(12):
        for number in range(300):
            closed("10.0.0.1", number)
            log.now += PAUSE_S / 300
        log.handler.sum_up()
    assert len(log.lines) <= 1 + 12
    log.pass_minute()
    log.pass_minute()
    closed("10.0.0.1", 7)
    assert log.lines[-1] == "connection of 10.0.0.1 closed: 7"


def test_a_kind_hides_no_other_one(log: QuietLog) -> None:
    for kind in ("trip", "trip", "stop ignored"):
        _log.error("fu1: %s", kind, extra=log_source("fu1", kind))
    assert log.lines == ["fu1: trip", "fu1: stop ignored"]


def test_who_makes_sources_up_shares_one_count(log: QuietLog) -> None:
    for number in range(5000):
        closed(f"nobody{number}")
    assert len(log.lines) <= 201
    assert sum(int(line.split("(")[1].split()[0]) for line in log.pass_minute()) >= 4799


def test_a_line_that_nobody_has_thought_of_fills_no_disk(log: QuietLog) -> None:
    for number in range(5000):
        _log.warning("something with %d", number)
        _log.warning("and always the same")
    assert len(log.lines) <= 200 + A_FEW + A_FEW
    assert len(log.pass_minute()) <= 2


def test_what_is_said_at_the_start_is_said_whole(log: QuietLog) -> None:
    for number in range(90):
        _log.warning("finding %d", number)
    assert len(log.lines) == 90


def test_a_traceback_is_told_once(log: QuietLog) -> None:
    for _ in range(100):
        try:
            raise KeyError("x")
        except KeyError:
            _log.exception("unexpected", extra=log_source("part"))
    assert sum("Traceback" in line for line in log.lines) == 1
    assert log.pass_minute() == ["unexpected (99 more of this kind)"]


def test_counts_come_with_the_next_line_and_at_the_end_too(log: QuietLog) -> None:
    for number in range(10):
        closed("10.0.0.1", number)
    log.now += PAUSE_S
    _log.info("something else")
    assert log.lines[1:] == ["connection of 10.0.0.1 closed: 9 (9 more of this kind)", "something else"]
    closed("10.0.0.1", 10)
    log.handler.close()
    assert log.lines[-1] == "connection of 10.0.0.1 closed: 10 (1 more of this kind)"


async def test_where_an_event_loop_runs_nobody_has_to_say_anything(log: QuietLog) -> None:
    for number in range(10):
        closed("10.0.0.1", number)
    log.now += PAUSE_S
    write_counts(asyncio.get_running_loop())
    assert len(log.lines) == 2


def test_no_fault_of_the_caller_raises_through_the_log(
    log: QuietLog, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(logging, "raiseExceptions", False)
    _log.warning("%d", "no number")
    _log.warning("and on")
    assert log.lines == ["and on"]


def test_what_is_asked_for_with_verbose_is_all_there(log: QuietLog) -> None:
    logging.getLogger().setLevel(logging.DEBUG)
    for _ in range(10):
        _log.debug("frame")
    assert log.lines == ["frame"] * 10


# event loops


@pytest.fixture
def loop() -> Iterator[asyncio.AbstractEventLoop]:
    loop = asyncio.new_event_loop()
    yield loop
    loop.close()


def fault(number: int) -> BaseException:
    try:
        raise KeyError(number)
    except KeyError as error:
        return error


def other_fault() -> BaseException:
    try:
        return fault(int("x"))
    except ValueError as error:
        return error


def test_what_nobody_caught_is_told_with_its_traceback_once_for_each_place(
    loop: asyncio.AbstractEventLoop, log: QuietLog
) -> None:
    faults = log_fault
    for number in range(100):
        faults(loop, {"message": f"in callback {number}", "exception": fault(number)})
        faults(loop, {"message": f"in callback {number}", "exception": other_fault()})
    assert sum("Traceback" in line for line in log.lines) == 2
    assert any("KeyError(0)" in line for line in log.lines)
    assert len(log.pass_minute()) == 2


def test_what_has_no_exception_is_told_too(loop: asyncio.AbstractEventLoop, log: QuietLog) -> None:
    faults = log_fault
    for _ in range(3):
        faults(loop, {"message": "Task was destroyed but it is pending!"})
    assert log.lines == ["Task was destroyed but it is pending!"]


@pytest.mark.parametrize(
    ("number", "has_traceback"), [(errno.EMFILE, False), (errno.ENFILE, False), (errno.EIO, True)]
)
def test_no_descriptor_left_is_one_line_without_a_traceback(number: int, has_traceback: bool) -> None:
    """Any line of the code may be the one to meet it."""
    try:
        raise OSError(number, os.strerror(number))
    except OSError as error:
        about_it = (OSError, error, error.__traceback__)
    record = logging.LogRecord("x", logging.WARNING, "", 0, "zenoh: it failed", None, about_it)
    said = _Formatter("%(message)s").format(record)
    assert ("Traceback" in said) == has_traceback
    assert said.startswith("zenoh: it failed") and (has_traceback or "\n" not in said)
