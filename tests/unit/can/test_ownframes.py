"""Our own frames that come back from the kernel are never taken for another's, whatever becomes of them; and
a frame that we did not send is found."""

from __future__ import annotations

import heapq

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from bridge.can.ownframes import LINGER_S, OwnFrames
from bridge.canopen.frame import Frame

RPDO = 0x205
STOPPED, ENABLING = bytes.fromhex("7e04000000000000"), bytes.fromhex("7f04002000000000")
PERIOD_S = 0.01


def burst(*data: bytes) -> tuple[Frame, ...]:
    return tuple(Frame(RPDO, one) for one in data)


class Kernel:
    """Repeats what it is told, and gives it back later: in order, and not before it is let out of a queue."""

    def __init__(self, own: OwnFrames) -> None:
        self.own = own
        self.now = 1000.0
        self.frames: tuple[Frame, ...] = ()
        self.place = 0
        self.due = float("inf")
        self.period_s = PERIOD_S
        self.out_at = 0.0
        self.waiting: list[tuple[float, int, bytes]] = []
        self.number = 0
        self.strangers: list[bytes] = []

    def tell(self, frames: tuple[Frame, ...], period_s: float, *, at_once: bool) -> None:
        """In one round with a look before it, as the master does."""
        assert self.look() == []
        self.own.told(frames, self.now, period_s, at_once=at_once)
        if period_s != self.period_s or self.due == float("inf"):
            self.due = self.now  # a new phase
        self.frames, self.period_s, self.place = frames, period_s, 0
        if at_once:
            self.send(frames[0].data)

    def follow(self, words: int) -> None:
        """A setpoint that changes every 2 ms."""
        for n in range(words):
            self.tell(burst(n.to_bytes(8, "big")), 0.01, at_once=True)
            self.run(0.002)

    def end(self) -> None:
        self.own.silenced(RPDO, self.now)
        self.due = float("inf")

    def single(self, data: bytes) -> None:
        """Send like ``tell``, with a look before it."""
        assert self.look() == []
        self.own.sent(Frame(RPDO, data), self.now)
        self.send(data)

    def send(self, data: bytes) -> None:
        self.out_at = max(self.out_at, self.now)
        self.number += 1
        heapq.heappush(self.waiting, (self.out_at, self.number, data))

    def block(self, seconds: float) -> None:
        """Others have the bus: what is sent waits."""
        self.out_at = max(self.out_at, self.now + seconds)

    def run(self, seconds: float) -> None:
        end = self.now + seconds
        while self.due <= end:
            self.now = self.due
            self.send(self.frames[self.place % len(self.frames)].data)
            self.place += 1
            self.due += self.period_s
        self.now = end

    def look(self) -> list[bytes]:
        """Frames that came back by now and are taken for somebody else's."""
        strangers: list[bytes] = []
        while self.waiting and self.waiting[0][0] <= self.now:
            at, _, data = heapq.heappop(self.waiting)
            if not self.own.is_own(RPDO, data, at):
                strangers.append(data)
        return strangers


WORDS = st.lists(st.binary(min_size=8, max_size=8), min_size=1, max_size=3)
STEPS = st.one_of(
    st.tuples(st.just("tell"), WORDS, st.sampled_from([0.001, 0.01, 0.02, 0.1]), st.booleans()),
    st.tuples(st.just("follow"), st.integers(1, 400)),
    st.tuples(st.just("single"), st.binary(min_size=8, max_size=8)),
    st.tuples(st.just("run"), st.floats(0.0, 0.5)),
    st.tuples(st.just("block"), st.floats(0.0, 0.9 * LINGER_S)),
    st.tuples(st.just("end")),
    st.tuples(st.just("look")),
)


@pytest.mark.landing
@settings(max_examples=150, deadline=None)
@given(st.lists(STEPS, max_size=60))
@example([("tell", [ENABLING], 0.001, False), ("block", 0.9), ("run", 0.5), ("tell", [STOPPED], 0.1, False)])
def test_our_own_frames_are_never_anothers(steps: list[tuple]) -> None:
    """Words change at any time, the bus is busy, and the process hangs."""
    kernel = Kernel(OwnFrames())
    for what, *more in steps:
        match what:
            case "tell":
                data, period_s, at_once = more
                kernel.tell(burst(*data), period_s, at_once=at_once)
            case "follow":
                kernel.follow(*more)
            case "single":
                kernel.single(*more)
            case "run":
                kernel.run(*more)
            case "block":
                kernel.block(*more)
            case "end":
                kernel.end()
            case _:
                assert kernel.look() == []
    kernel.run(2 * LINGER_S)
    assert kernel.look() == []


@settings(max_examples=100, deadline=None)
@given(st.lists(STEPS, max_size=40), st.binary(min_size=8, max_size=8))
def test_a_frame_with_data_that_we_have_not_sent_is_always_found(steps: list[tuple], foreign: bytes) -> None:
    own = OwnFrames()
    kernel = Kernel(own)
    said: set[bytes] = set()
    for what, *more in steps:
        if what == "tell":
            said.update(more[0])
            kernel.tell(burst(*more[0]), more[1], at_once=more[2])
        elif what == "single":
            said.add(more[0])
            kernel.single(more[0])
        elif what == "run":
            kernel.run(more[0])
        assert own.is_own(RPDO, foreign, kernel.now) is False or foreign in said


def test_what_was_in_force_is_found_when_it_cannot_be_ours_any_more() -> None:
    kernel = Kernel(OwnFrames())
    kernel.tell(burst(ENABLING), PERIOD_S, at_once=True)
    kernel.run(1.0)
    kernel.tell(burst(STOPPED), PERIOD_S, at_once=True)
    kernel.run(0.5 * LINGER_S)
    assert kernel.look() == []
    assert kernel.own.is_own(RPDO, ENABLING, kernel.now)
    kernel.run(0.6 * LINGER_S)
    assert not kernel.own.is_own(RPDO, ENABLING, kernel.now)


def test_one_who_repeats_what_we_send_is_found_by_the_number_of_frames() -> None:
    kernel = Kernel(OwnFrames())
    kernel.tell(burst(ENABLING), PERIOD_S, at_once=True)
    found_after = None
    for step in range(500):
        kernel.run(PERIOD_S)
        strangers = kernel.look()
        if not kernel.own.is_own(RPDO, ENABLING, kernel.now):
            found_after = step * PERIOD_S
            break
        assert strangers == []
    assert found_after is not None and found_after < 3.0
    for _ in range(1000):
        kernel.run(PERIOD_S)
        kernel.look()
    kernel.run(0.0)
    assert kernel.look() == [], "he has gone, and we are ourselves again"


def test_one_of_a_sequence_is_ours_at_any_time() -> None:
    """SYNC with its counter, or a burst that ends with stops."""
    kernel = Kernel(OwnFrames())
    kernel.tell(burst(ENABLING, ENABLING, STOPPED), PERIOD_S, at_once=True)
    for _ in range(50):
        kernel.run(PERIOD_S)
        assert kernel.look() == []
    assert kernel.own.is_own(RPDO, STOPPED, kernel.now)


def test_an_identifier_that_we_never_sent_on_is_not_ours() -> None:
    assert not OwnFrames().is_own(RPDO, STOPPED, 1000.0)


@pytest.mark.parametrize("stuck_s", [0.5, 30.0])
def test_frames_that_nobody_acknowledged_are_ours_when_they_come_at_last(stuck_s: float) -> None:
    kernel = Kernel(OwnFrames())
    kernel.tell(burst(ENABLING), PERIOD_S, at_once=True)
    kernel.run(1.0)
    kernel.look()
    kernel.own.stalled(kernel.now, is_stalled=True)
    kernel.end()
    kernel.now += stuck_s
    assert kernel.own.is_own(RPDO, ENABLING, kernel.now)
    kernel.own.stalled(kernel.now, is_stalled=False)
    assert all(kernel.own.is_own(RPDO, ENABLING, kernel.now + 0.001 * n) for n in range(60))
    assert not kernel.own.is_own(RPDO, ENABLING, kernel.now + 2 * LINGER_S)


def test_what_changes_with_every_round_is_not_kept_for_ever() -> None:
    own = OwnFrames()
    for n in range(20_000):
        own.told(burst(n.to_bytes(8, "little")), 1000.0 + 0.001 * n, PERIOD_S, at_once=True)
    assert len(own._streams[RPDO].past) < 4000
