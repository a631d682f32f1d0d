"""What nobody caught in the event loop: told once in full, then seldom."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Iterator

import pytest

from bridge.cli.logs import LoopFaults


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


def test_the_same_fault_is_told_once_a_minute_and_with_its_traceback_once(
    loop: asyncio.AbstractEventLoop, caplog: pytest.LogCaptureFixture
) -> None:
    now = [0.0]
    faults = LoopFaults(lambda: now[0])
    for number in range(100):
        faults(loop, {"message": f"in callback {number}", "exception": fault(number)})
        now[0] += 1.0
    first, second = caplog.records
    assert first.levelno == logging.ERROR and first.exc_info and "KeyError(0)" in first.message
    assert not second.exc_info and "59 more since" in second.message


def test_another_place_is_told_too(loop: asyncio.AbstractEventLoop, caplog: pytest.LogCaptureFixture) -> None:
    faults = LoopFaults(lambda: 0.0)
    for error in (fault(1), other_fault(), fault(2), other_fault()):
        faults(loop, {"message": "in callback", "exception": error})
    assert len(caplog.records) == 2


def test_what_has_no_exception_is_told_too(
    loop: asyncio.AbstractEventLoop, caplog: pytest.LogCaptureFixture
) -> None:
    faults = LoopFaults(lambda: 0.0)
    for _ in range(3):
        faults(loop, {"message": "Task was destroyed but it is pending!"})
    assert [record.message for record in caplog.records] == ["Task was destroyed but it is pending!"]
