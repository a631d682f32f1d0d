"""A burst keeps its owner's deadline by itself: in the kernel, and where a timer of ours sends it."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bridge.can.burstend import MOST_FRAMES, Burst, BurstEnd, sequence
from bridge.can.kernelbursts import KernelBursts
from bridge.can.softbursts import SoftBursts
from bridge.canopen.frame import Frame
from tests.support.broadcast_manager import BroadcastManager
from tests.support.nightly import examples

RUN, STOP = Frame(0x205, b"\x7f\x04"), Frame(0x205, b"\x7e\x04")
PERIOD_S = 0.01


class Bench:
    """A kernel with one burst; ``late`` is how long the next messages are on their way."""

    def __init__(self) -> None:
        self.now = 100.0
        self.late = 0.0
        self.stalls: list[float] = []
        """Pauses of the process before each of its next looks at the clock and the messages, seconds."""
        self.seen: list[tuple[float, Frame]] = []
        self.kernel = BroadcastManager(lambda: self.now, lambda frame: self.seen.append((self.now, frame)))
        self.beats = KernelBursts(self.clock)
        self.beats.open(self)

    def send(self, message: bytes, /) -> int:
        self.stall()
        return self.kernel.send(message)

    def close(self) -> None:
        self.kernel.close()

    def stall(self) -> None:
        if self.stalls:
            self.run(self.stalls.pop(0))

    def clock(self) -> float:
        self.stall()
        seen = self.now
        if self.late:
            late, self.late = self.late, 0.0
            self.run(late)
        return seen

    def beat(
        self, frame: Frame = RUN, *, ending: BurstEnd | None, at_once: bool = False, count: int = 10
    ) -> None:
        self.beats.start(Burst((frame,), PERIOD_S, count, ending), self.now, at_once=at_once)

    def run(self, seconds: float) -> None:
        end = self.now + seconds
        while (at := self.kernel.next_deadline()) is not None and at <= end:
            self.now = at
            self.kernel.on_time()
        self.now = end

    def times(self, frame: Frame) -> list[float]:
        return [time for time, seen in self.seen if seen == frame]


@given(
    left_s=st.floats(-0.5, 30.0), period_s=st.sampled_from([0.001, 0.01, 0.05]), count=st.integers(4, 10_000)
)
def test_a_sequence_never_stops_before_the_deadline_and_enables_a_period_after_it_at_most(
    left_s: float, period_s: float, count: int
) -> None:
    found = sequence(Burst((RUN,), period_s, count, BurstEnd(left_s, STOP)), 0.0)
    assert len(found.frames) == min(count, MOST_FRAMES)
    sent = [found.frames[n % len(found.frames)] for n in range(found.total)]
    going = sent.count(RUN)
    assert sent == [RUN] * going + [STOP] * (len(sent) - going)
    assert (going - 1) * period_s < max(left_s, 0.0) or not going
    if STOP in sent:
        assert going * period_s >= left_s - 1e-6
    assert len(sent) <= count


def test_the_kernel_stops_a_drive_that_nobody_renews() -> None:
    bench = Bench()
    bench.beat(ending=None)
    bench.run(0.045)
    at = bench.now + 0.05
    bench.beat(ending=BurstEnd(at, STOP))
    bench.run(1.0)
    assert at <= bench.times(STOP)[0] <= at + 2 * PERIOD_S
    assert bench.times(RUN)[-1] < at + PERIOD_S


@pytest.mark.parametrize("at_once", [True, False])
def test_a_message_that_was_long_on_its_way_ends_in_time_all_the_same(at_once: bool) -> None:
    bench = Bench()
    bench.beat(ending=None)
    bench.run(0.045)
    at = bench.now + 0.06
    bench.late = 0.04
    bench.beat(ending=BurstEnd(at, STOP), at_once=at_once)
    bench.run(1.0)
    assert bench.times(RUN)[-1] < at + PERIOD_S
    assert at <= bench.times(STOP)[0]


def test_a_burst_that_is_started_anew_after_the_deadline_enables_nothing() -> None:
    bench = Bench()
    bench.beat(ending=None)
    bench.run(0.075)
    bench.seen.clear()
    at = bench.now + 0.02
    bench.late = 0.024
    bench.beat(ending=BurstEnd(at, STOP))
    bench.run(1.0)
    assert all(time < at + PERIOD_S for time in bench.times(RUN))
    assert bench.times(STOP)


def test_without_a_stop_the_burst_ends_and_what_is_gone_is_not_deleted_again() -> None:
    bench = Bench()
    at = bench.now + 0.05
    bench.beat(ending=BurstEnd(at, None))
    bench.run(0.2)
    assert bench.times(RUN)[-1] < at + PERIOD_S
    for _ in range(3):
        bench.beat(ending=BurstEnd(at, None))
        bench.run(0.1)
    assert not bench.beats.refusal
    number = len(bench.seen)
    bench.beat(ending=BurstEnd(bench.now + 1.0, None))
    bench.run(0.05)
    assert len(bench.seen) > number, "the owner is back"


def test_a_telegram_in_time_moves_the_stop_away() -> None:
    bench = Bench()
    for _ in range(100):
        bench.beat(ending=BurstEnd(bench.now + 0.03, STOP))
        bench.run(0.028)
    assert not bench.times(STOP)
    times = bench.times(RUN)
    pauses = [after - before for before, after in pairwise(times)]
    assert max(pauses) <= PERIOD_S + 0.001, "and the phase is kept"


STALLS = st.lists(st.sampled_from([0.0, 0.0, 0.004, 0.025, 0.05, 0.2]), max_size=5)
RENEWALS = st.tuples(
    st.sampled_from([0.0, 0.015, 0.04, 0.09, 0.3]),
    st.sampled_from([-0.01, 0.0, 0.005, 0.015, 0.025, 0.045, 0.2]),
    st.booleans(),
    STALLS,
)


@settings(max_examples=examples(1000))
@given(steps=st.lists(RENEWALS, min_size=1, max_size=3), silent=st.booleans())
def test_who_renews_a_burst_has_it_on_the_bus_wherever_the_bridge_stood_still(
    steps: list[tuple[float, float, bool, list[float]]], *, silent: bool
) -> None:
    bench = Bench()
    bench.beat(ending=None)
    ending = BurstEnd(bench.now, None if silent else STOP)
    for wait_s, left_s, at_once, stalls in steps:
        bench.run(wait_s)
        bench.stalls = list(stalls)
        ending = ending._replace(at=bench.now + left_s)
        bench.beat(ending=ending, at_once=at_once)
        bench.stalls.clear()
    latest = max(ending.at, bench.now) + 2 * PERIOD_S
    bench.run(0.3)
    assert all(time < latest for time in bench.times(RUN)), "and nobody who does not keeps it there"
    # A renewal may have come too late: the next one after it counts.
    for _ in range(2):
        bench.seen.clear()
        bench.beat(STOP, ending=None)
        bench.run(PERIOD_S * 1.5)
    assert bench.times(STOP)
    assert not bench.times(RUN)


def test_a_timer_of_ours_keeps_it_as_well() -> None:
    soft = SoftBursts()
    ending = BurstEnd(0.045, STOP)
    sent = [soft.start(Burst((RUN,), PERIOD_S, 10, ending), 0.0, at_once=False)]
    for ms in range(1, 200):
        sent += soft.due(ms / 1000)
    assert sent == [RUN] * 5 + [STOP] * 5
    silent = SoftBursts()
    silent.start(Burst((RUN,), PERIOD_S, 10, BurstEnd(0.045, None)), 0.0, at_once=False)
    assert len([frame for ms in range(1, 200) for frame in silent.due(ms / 1000)]) == math.floor(4.5)
    assert 0x205 not in silent


def test_a_burst_of_more_frames_than_a_sequence_holds_is_cut() -> None:
    bench = Bench()
    bench.beat(ending=BurstEnd(bench.now + 3.0, STOP), count=1000)
    at = bench.now + 3.0
    bench.run(20.0)
    assert bench.times(RUN)[-1] < at + PERIOD_S + 300 * 0.0001
    assert not bench.times(STOP)
