"""The precise timer of a loop: the newest time counts, a past one is at once, and its end is one."""

from __future__ import annotations

import asyncio

import pytest

from bridge.master import timer as module
from bridge.master.timer import LoopTimer


class Woken:
    def __init__(self) -> None:
        self.times: list[float] = []
        self.loop = asyncio.get_running_loop()
        self.event = asyncio.Event()
        self.timer = LoopTimer(self.loop, self.loop.time, self._wake)

    def _wake(self) -> None:
        self.times.append(self.loop.time())
        self.event.set()

    async def waits(self) -> None:
        async with asyncio.timeout(5):
            await self.event.wait()
        self.event.clear()


@pytest.fixture(params=["timerfd", "loop"])
def kind(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    if request.param == "loop":
        monkeypatch.setattr(module, "_library_with_timerfd", lambda: None)
    return request.param


@pytest.mark.usefixtures("kind")
async def test_a_time_that_is_past_wakes_at_once_and_once() -> None:
    woken = Woken()
    woken.timer.arm(0.0)
    await woken.waits()
    woken.timer.arm(woken.loop.time() - 1.0)
    await woken.waits()
    assert len(woken.times) == 2
    woken.timer.close()


@pytest.mark.usefixtures("kind")
async def test_it_never_wakes_early_and_the_newest_time_counts() -> None:
    woken = Woken()
    woken.timer.arm(woken.loop.time() + 60.0)
    at = woken.loop.time() + 0.003
    woken.timer.arm(at)
    await woken.waits()
    assert woken.times[0] >= at - 1e-6
    assert len(woken.times) == 1
    woken.timer.close()


async def test_the_same_time_may_be_armed_again_after_it_has_come() -> None:
    woken = Woken()
    for _ in range(2):
        woken.timer.arm(1.0)
        await woken.waits()
    assert len(woken.times) == 2
    woken.timer.close()


@pytest.mark.usefixtures("kind")
async def test_nothing_wakes_after_the_end() -> None:
    woken = Woken()
    woken.timer.arm(0.0)
    woken.timer.close()
    woken.timer.close()
    for _ in range(3):
        await asyncio.sleep(0)
    assert woken.times == []
