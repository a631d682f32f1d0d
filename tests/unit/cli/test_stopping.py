"""Work that a signal ends: cancelled once, after what has to come first, with its own error bare."""

from __future__ import annotations

import asyncio
import signal

import pytest

from bridge.base.errors import OperationFailed
from bridge.cli.ending_signals import ending_signals
from bridge.cli.stopping import Shutdown, until_stopped


def test_work_that_ends_by_itself_has_ended() -> None:
    done: list[int] = []

    async def work() -> None:
        done.append(1)

    before = signal.getsignal(signal.SIGTERM)
    until_stopped(work())
    assert done == [1]
    assert signal.getsignal(signal.SIGTERM) is before
    assert not ending_signals.is_held


def test_a_signal_ends_it_after_what_has_to_come_first() -> None:
    order: list[str] = []

    async def work() -> None:
        signal.raise_signal(signal.SIGTERM)
        signal.raise_signal(signal.SIGINT)
        try:
            await asyncio.Event().wait()
        except asyncio.CancelledError:
            order.append("cancelled")
            raise

    until_stopped(work(), Shutdown(first=lambda: order.append("first")))
    assert order == ["first", "cancelled"]


def test_what_has_to_come_first_may_fail_and_the_work_ends_all_the_same() -> None:
    ended: list[bool] = []

    def fail() -> None:
        raise OperationFailed("no")

    async def work() -> None:
        asyncio.get_running_loop().set_exception_handler(lambda loop, context: None)
        signal.raise_signal(signal.SIGTERM)
        try:
            await asyncio.Event().wait()
        finally:
            ended.append(True)

    until_stopped(work(), Shutdown(first=fail))
    assert ended == [True]


def test_a_signal_before_the_work_leaves_it_undone() -> None:
    done: list[int] = []

    async def work() -> None:
        done.append(1)

    ending_signals.hold()
    try:
        signal.raise_signal(signal.SIGTERM)
        until_stopped(work())
    finally:
        ending_signals.release()
    assert done == []


def test_its_one_error_comes_bare() -> None:
    async def work() -> None:
        async with asyncio.TaskGroup() as group:
            group.create_task(fails())

    async def fails() -> None:
        raise OperationFailed("the node did not answer")

    with pytest.raises(OperationFailed, match="the node did not answer"):
        until_stopped(work())


def test_a_cancellation_that_no_signal_asked_for_is_an_error() -> None:
    async def work() -> None:
        raise asyncio.CancelledError

    with pytest.raises(asyncio.CancelledError):
        until_stopped(work())
