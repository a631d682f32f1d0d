"""The precise timer: wakes once for each time it was armed, whichever it was."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable

import pytest

from bridge.master.timer import LoopTimer


def woken(use: Callable[[LoopTimer, list[float]], None], seconds: float = 0.08) -> list[float]:
    """When a timer woke that ``use`` was given, in ms from then."""

    async def run() -> list[float]:
        begin = time.monotonic()
        times: list[float] = []
        timer = LoopTimer(
            asyncio.get_running_loop(),
            time.monotonic,
            lambda: times.append((time.monotonic() - begin) * 1000),
        )
        try:
            use(timer, times)
            await asyncio.sleep(seconds)
        finally:
            timer.close()
        return times

    return asyncio.run(run())


def test_it_wakes_once_and_not_before() -> None:
    (at_ms,) = woken(lambda timer, _: timer.arm(time.monotonic() + 0.02))
    assert at_ms >= 20


def test_the_newest_time_counts() -> None:
    def use(timer: LoopTimer, _: list[float]) -> None:
        now = time.monotonic()
        timer.arm(now + 0.01)
        timer.arm(now + 0.03)

    (at_ms,) = woken(use)
    assert at_ms >= 30


def test_the_same_time_again_is_one_wake() -> None:
    def use(timer: LoopTimer, _: list[float]) -> None:
        at = time.monotonic() + 0.02
        timer.arm(at)
        timer.arm(at)

    assert len(woken(use)) == 1


def test_a_time_that_has_come_can_be_armed_again() -> None:
    def use(timer: LoopTimer, _: list[float]) -> None:
        at = time.monotonic() + 0.01
        timer.arm(at)
        asyncio.get_running_loop().call_later(0.04, timer.arm, at)

    assert len(woken(use)) == 2


@pytest.mark.parametrize("at", [0.0, 1.0])
def test_a_time_that_is_past_wakes_at_once(at: float) -> None:
    assert len(woken(lambda timer, _: timer.arm(at))) == 1


def test_it_goes_on_after_a_time_that_had_come_was_replaced_unseen() -> None:
    """The loop has seen that the time has come, and somebody arms another before the timer is asked."""

    def use(timer: LoopTimer, _: list[float]) -> None:
        timer.arm(time.monotonic())
        time.sleep(0.002)
        timer.arm(time.monotonic() + 0.02)

    (at_ms,) = woken(use)
    assert at_ms >= 20
