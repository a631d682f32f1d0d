"""Times at which the kernel is asked about an interface. Its answers come from a thread; time is given."""

from __future__ import annotations

import asyncio

from bridge.can.linkwatch import LinkWatch
from bridge.can.netlink import Link


class Watched:
    """A watch, how often it has looked, and its answers."""

    def __init__(self) -> None:
        self.looks = 0
        self.answered = asyncio.Event()
        self.watch = LinkWatch(self._look)
        self.watch.begin(asyncio.get_running_loop(), self.answered.set)

    def _look(self) -> Link:
        self.looks += 1
        return Link(is_up=True)

    async def answer(self) -> Link:
        await asyncio.wait_for(self.answered.wait(), 5)
        self.answered.clear()
        future = self.watch.take()
        assert future is not None
        return future.result()


async def test_an_open_interface_is_looked_at_once_a_second() -> None:
    watched = Watched()
    watched.watch.opened(10.0)
    watched.watch.on_time(10.9)
    assert (watched.looks, watched.watch.next_deadline()) == (0, 11.0)
    watched.watch.on_time(11.0)
    assert (await watched.answer()).is_up
    assert watched.watch.next_deadline() == 12.0
    assert watched.watch.take() is None


async def test_a_gone_one_less_and_less_often_until_it_is_back() -> None:
    watched = Watched()
    watched.watch.opened(0.0)
    now, pauses = 0.0, list[float]()
    watched.watch.lost(now)
    for _ in range(7):
        due = watched.watch.next_deadline()
        assert due is not None
        pauses.append(round(due - now, 3))
        now = due
        watched.watch.on_time(now)
        await watched.answer()
    assert pauses == [0.2, 0.4, 0.8, 1.6, 3.2, 5.0, 5.0]
    watched.watch.opened(now)
    watched.watch.lost(now)
    assert watched.watch.next_deadline() == now + 0.2


async def test_what_was_asked_before_it_went_does_not_count() -> None:
    watched = Watched()
    watched.watch.opened(0.0)
    watched.watch.on_time(1.0)
    await asyncio.wait_for(watched.answered.wait(), 5)
    watched.watch.lost(1.1)
    assert watched.watch.take() is None


async def test_a_closed_bus_looks_no_more() -> None:
    watched = Watched()
    watched.watch.opened(0.0)
    watched.watch.end()
    watched.watch.on_time(60.0)
    assert (watched.looks, watched.watch.next_deadline()) == (0, None)
