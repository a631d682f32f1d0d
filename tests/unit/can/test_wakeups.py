"""Wake-ups of the event loop by a bus, and the wait of a frame."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import Sequence
from itertools import accumulate

from hypothesis import given
from hypothesis import strategies as st

from bridge.can.wakeups import Wakeups
from tests.support.virtual_loop import VirtualLoop

LATEST_S = 0.0005
"""On the virtual clock, which rounds no pause up."""


class End:
    """Fetches frames as a bus does, and notes when."""

    def __init__(self, *, breaks: bool = False, asks: bool = False) -> None:
        self.wakeups = Wakeups()
        self.waits_s: list[float] = []
        self.wakes = 0
        self._breaks = breaks
        self._asks = asks

    def wake(self) -> None:
        self.wakes += 1
        if self._breaks and self.wakes == 3:
            self.wakeups.close()
            return
        self.fetch()

    def fetch(self) -> None:
        now, count = asyncio.get_running_loop().time(), 0
        while True:
            try:
                sent = float(self._near.recv(64))
            except BlockingIOError:
                break
            count += 1
            self.waits_s.append(now - sent)
        self.wakeups.fetched(count)
        if self._asks:
            self.wakeups.sent()

    async def receive(self, times: Sequence[float]) -> None:
        loop = asyncio.get_running_loop()
        self._near, far = socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM)
        with self._near, far:
            self._near.setblocking(False)
            self.wakeups.begin(loop, self.wake)
            self.wakeups.open(self._near.fileno())
            for time in times:
                loop.call_at(time, far.send, repr(time).encode())
            await asyncio.sleep(max(times) + 0.1)
            self.wakeups.close()
            self.wakeups.close()


def received(times: Sequence[float], **settings: bool) -> End:
    end = End(**settings)
    with asyncio.Runner(loop_factory=VirtualLoop) as runner:
        runner.run(end.receive(times))
    return end


@given(st.lists(st.floats(0.0, 0.003), min_size=1, max_size=60))
def test_each_frame_comes_and_none_is_late(pauses: list[float]) -> None:
    times = list(accumulate(pauses))
    end = received(times)
    assert len(end.waits_s) == len(times)
    assert max(end.waits_s) <= LATEST_S + 1e-9


def test_on_a_quiet_bus_no_frame_waits() -> None:
    end = received([0.001 * n for n in range(1, 200)])
    assert max(end.waits_s) < 1e-9
    assert end.wakes == 199


def test_on_a_busy_bus_frames_are_fetched_together() -> None:
    end = received([0.000125 * n for n in range(1, 8001)])
    assert len(end.waits_s) == 8000
    assert end.wakes < 2100


def test_answers_do_not_wait_however_fast_they_come() -> None:
    end = received([0.0001 * n for n in range(1, 200)], asks=True)
    assert max(end.waits_s) < 1e-9


def test_after_a_busy_time_none_waits_again() -> None:
    end = received([0.0001 * n for n in range(1, 100)] + [0.1 + 0.01 * n for n in range(10)])
    assert end.waits_s[-10:] == [0.0] * 10


def test_a_bus_that_breaks_down_while_it_is_looked_at_wakes_nobody_more() -> None:
    end = received([0.0001 * n for n in range(1, 100)], breaks=True)
    assert end.wakes == 3
