"""However a controller's telegrams come, and whatever it hangs in: none counts as younger than it is.

A sender, a network with a window, and a server's event loop are played in steps of 1 ms.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bridge.command import Action, Code, Do, Identity, Request, Source, TakeControl, command_of
from bridge.command.messages.freshness import (
    BOUND_MS,
    GRAIN_MS,
    NEVER,
    NOW_S,
    Inflow,
    LoopPulse,
    is_stale,
    way_ms,
)
from tests.support.nightly import examples
from tests.support.rig import ACKNOWLEDGE, ENABLE, HALF_SPEED, OTHER_PLC, PLC, SHUT_DOWN, Rig

STEP_S = 0.001
READ_MOST, WINDOW, TURN, BEAT_S, HANG_S = 16, 64, 4, 0.01, 0.1
"""In telegrams and seconds; as in the Modbus server, but for the numbers."""


@dataclass
class Path:
    """One connection. ``latency`` is in steps, each way; telegrams are the steps at which they were sent."""

    latency: int
    sending: deque[int] = field(default_factory=deque[int])
    flying: deque[tuple[int, int]] = field(default_factory=deque[tuple[int, int]])
    credits: deque[tuple[int, int]] = field(default_factory=deque[tuple[int, int]])
    received: deque[int] = field(default_factory=deque[int])
    window: int = WINDOW

    @property
    def is_busy(self) -> bool:
        return bool(self.sending or self.flying or self.received)

    def step(self, now: int) -> None:
        while self.credits and self.credits[0][0] <= now:
            self.window += self.credits.popleft()[1]
        while self.sending and self.window:
            self.window -= 1
            self.flying.append((now + self.latency, self.sending.popleft()))
        while self.flying and self.flying[0][0] <= now:
            self.received.append(self.flying.popleft()[1])

    def read(self, now: int) -> list[int]:
        some = [self.received.popleft() for _ in range(min(len(self.received), READ_MOST))]
        self.credits.append((now + self.latency, len(some)))
        return some


class Server:
    """Reads, beats and handles as ``modbus.session`` and ``pulse`` do; ``counted`` are the telegrams that
    count, as (sent, received) in seconds."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.look = LoopPulse(0.0, 0.0)
        self.beat_at = 0.0
        self.inflow = Inflow(0.0, self.look)
        self.waiting: deque[tuple[int, float]] = deque()
        self.counted: list[tuple[float, float]] = []
        self.refused = 0

    def turn(self, step: int) -> None:
        now = step * STEP_S
        if self.inflow.is_open and self.path.received:
            some = self.path.read(step)
            received_at = self.inflow.arrive(now, self.look, crowded=len(some) == READ_MOST)
            self.waiting += [(sent, received_at) for sent in some]
        for _ in range(min(TURN, len(self.waiting))):
            sent, received_at = self.waiting.popleft()
            request = Request(PLC, "", Do(Action.KEEP_ALIVE), received_at=received_at)
            if is_stale(request, now, 0):
                self.refused += 1
            else:
                self.counted.append((sent * STEP_S, received_at))
        if len(self.waiting) >= READ_MOST:
            self.inflow.shut(now)
        elif not self.waiting:
            self.inflow.reopen(now)
        if now - self.beat_at >= BEAT_S:
            has_hung = now - self.beat_at > HANG_S
            self.look = LoopPulse(self.beat_at, now if has_hung else self.look.steady_since)
            self.beat_at = now


def play(latency: int, bursts: list[tuple[int, int]], hangs: list[tuple[int, int]]) -> Server:
    """``bursts``: (steps after the last, telegrams); ``hangs``: (steps after the last, steps)."""
    path = Path(latency)
    server = Server(path)
    sent: dict[int, int] = {}
    at = 20
    for after, count in bursts:
        at += after
        sent[at] = sent.get(at, 0) + count
    hung: set[int] = set()
    begin = 0
    for after, steps in hangs:
        begin += after
        hung |= set(range(begin, begin + steps))
        begin += steps
    step = -1
    while step < at or path.is_busy or server.waiting:
        step += 1
        path.sending += [step] * sent.get(step, 0)
        path.step(step)
        if step not in hung:
            server.turn(step)
    return server


@settings(max_examples=examples(300), deadline=None)
@given(
    st.integers(0, 40),
    st.lists(st.tuples(st.integers(0, 60), st.integers(1, 400)), min_size=1, max_size=12),
    st.lists(st.tuples(st.integers(1, 200), st.integers(1, 400)), max_size=5),
)
def test_no_telegram_counts_as_younger_than_it_is(
    latency: int, bursts: list[tuple[int, int]], hangs: list[tuple[int, int]]
):
    for sent, received_at in play(latency, bursts, hangs).counted:
        assert received_at <= sent + latency * STEP_S + GRAIN_MS / 1000 + 2 * STEP_S


@pytest.mark.parametrize("latency", [0, 1, 20])
def test_who_floods_and_hangs_is_not_taken_for_alive(latency: int):
    server = play(latency, [(1, 1), (10, 5000)], [])
    assert server.refused > 4000
    assert max(received_at for _, received_at in server.counted) < 0.2


@pytest.mark.parametrize("every", [1, 3, 10, 50])
@pytest.mark.parametrize("at_once", [1, 4, 8])
def test_who_waits_for_answers_always_counts(every: int, at_once: int):
    """With what this server can do: four telegrams a step."""
    server = play(0, [(every, min(at_once, 4 * every))] * 400, [])
    assert server.refused == 0


def test_after_a_hang_of_ours_who_has_waited_counts_again():
    server = play(1, [(10, 2)] * 200, [(500, 400)])
    assert server.refused
    assert server.counted[-1][0] == 2.02


def test_after_a_flood_who_has_calmed_down_counts_again():
    server = play(1, [(1, 1), (10, 500), *[(20, 1)] * 100], [])
    assert server.refused > 400
    assert [sent for sent, _ in server.counted[-50:]] == pytest.approx([1.051 + 0.02 * n for n in range(50)])


def test_what_comes_first_may_have_waited_for_the_connection_to_be_taken():
    inflow = Inflow(5.0, LoopPulse(1.0, 0.0))
    assert inflow.arrive(5.02, LoopPulse(4.99, 4.99)) == 1.0
    inflow = Inflow(5.0, LoopPulse(1.0, 0.0))
    assert inflow.arrive(5.06, LoopPulse(5.05, 5.0)) == 5.06


@pytest.mark.parametrize(("arrivals", "counts"), [(20, True), (60, False)])
def test_calm_is_few_arrivals(arrivals: int, counts: bool):
    inflow = Inflow(0.0, LoopPulse(0.0, 0.0))
    inflow.arrive(1.0, LoopPulse(0.99, 0.0), crowded=True)
    for n in range(arrivals):
        at = 1.0 + 0.1 * n / arrivals
        assert inflow.arrive(at, LoopPulse(at - 0.01, 0.0)) == NEVER
    assert (inflow.arrive(1.12, LoopPulse(1.11, 0.0)) != NEVER) is counts


def test_what_comes_after_a_hang_where_nobody_sees_the_connections_waits_for_calm():
    inflow = Inflow(0.0, LoopPulse(0.0, NEVER), is_hidden=True)
    assert inflow.arrive(0.02, LoopPulse(0.01, NEVER)) == 0.02
    assert inflow.arrive(1.03, LoopPulse(0.03, NEVER)) == 0.03
    assert inflow.arrive(1.05, LoopPulse(1.03, 1.03)) == NEVER
    assert inflow.arrive(1.20, LoopPulse(1.19, 1.03)) == 1.20
    assert inflow.arrive(1.21, LoopPulse(1.20, 1.03)) == 1.21


def test_who_asks_for_the_first_time_after_a_hang_may_have_asked_before_it():
    assert Inflow(5.5, LoopPulse(5.49, 5.0), is_hidden=True).arrive(5.5, LoopPulse(5.49, 5.0)) == NEVER
    assert Inflow(6.5, LoopPulse(6.49, 5.0), is_hidden=True).arrive(6.5, LoopPulse(6.49, 5.0)) == 6.5
    assert Inflow(5.5, LoopPulse(5.49, 5.0)).arrive(5.5, LoopPulse(5.49, 5.0)) == 5.5


# at the drive


def ask(rig: Rig, action: Action, age_s: float, identity: Identity = PLC, **values: int) -> Code:
    codes: list[Code] = []
    command = command_of(action, **({"values": values} if values else {}))
    request = Request(identity, "conveyor/fu1", command, received_at=rig.now - age_s)
    rig.channel.handle(request, rig.now, lambda outcome: codes.append(outcome.code))
    return codes[0]


@pytest.mark.parametrize("source", [s for s in Source if s is not Source.NONE])
def test_what_is_older_than_the_bound_is_refused_and_restarts_nothing(source: Source):
    who = Identity(source, "plc")
    control = "lease" if source is Source.LOCAL else source.label
    rig = Rig(fieldbus_timeout_ms=2000, control=control)
    bound_s = BOUND_MS / 1000
    if control == "lease":
        request = Request(who, "conveyor/fu1", TakeControl(ttl_ms=60_000))
        rig.channel.handle(request, rig.now, lambda _: None)
    assert ask(rig, Action.KEEP_ALIVE, bound_s - 0.001, who) is Code.OK
    left = rig.channel.left_ms(rig.now)
    for action in (Action.KEEP_ALIVE, Action.RESET_FAULT, Action.START, Action.TAKE_CONTROL):
        assert ask(rig, action, bound_s + 0.001, who) is Code.STALE
    assert ask(rig, Action.WRITE, bound_s + 0.001, who, control_word=ENABLE) is Code.STALE
    assert ask(rig, Action.WRITE, bound_s + 0.001, who, setpoint_1=1) is Code.STALE
    assert rig.channel.left_ms(rig.now) == left


def test_the_timer_runs_from_when_a_telegram_came_and_not_from_when_it_is_read():
    rig = Rig()
    rig.run()
    for _ in range(5):
        rig.wait(0.02)
        assert ask(rig, Action.WRITE, 0.02, control_word=ENABLE, setpoint_1=HALF_SPEED) is Code.OK
    assert rig.channel.left_ms(rig.now) == 180
    rig.wait(0.09)
    # All that is read now came at one time: together they are worth no more than the newest.
    for _ in range(100):
        assert ask(rig, Action.WRITE, 0.09, control_word=ENABLE) is Code.OK
    assert rig.channel.left_ms(rig.now) == 110
    rig.wait(0.111)
    assert rig.watchdog == "tripped"
    assert not rig.enables


def test_an_older_telegram_takes_no_time_from_a_newer_one():
    rig = Rig()
    rig.run()
    assert ask(rig, Action.KEEP_ALIVE, 0.08) is Code.OK
    assert rig.channel.left_ms(rig.now) == 200


def test_what_would_have_run_out_by_now_is_refused():
    rig = Rig(fieldbus_timeout_ms=50)
    assert ask(rig, Action.KEEP_ALIVE, 0.06) is Code.STALE


@pytest.mark.parametrize("action", [Action.STOP, Action.QUICK_STOP, Action.DISABLE_VOLTAGE])
def test_no_stop_is_too_old(action: Action):
    rig = Rig()
    rig.run()
    rig.wait(0.1)
    assert ask(rig, action, 60.0) is Code.OK
    assert not rig.enables
    assert rig.channel.left_ms(rig.now) == 100


def test_a_word_that_stops_is_never_too_old_but_for_anything_else():
    rig = Rig()
    rig.run()
    rig.wait(0.1)
    assert ask(rig, Action.WRITE, 60.0, control_word=SHUT_DOWN, setpoint_1=HALF_SPEED) is Code.OK
    assert not rig.enables
    assert not any(rig.sent_setpoints)
    assert rig.channel.left_ms(rig.now) == 100
    assert rig.channel.restart_interlock
    rig.wait(0.2)
    assert rig.watchdog == "tripped"
    assert ask(rig, Action.WRITE, 60.0, control_word=ACKNOWLEDGE) is Code.OK
    assert rig.watchdog == "tripped"


def test_an_old_word_that_stops_gives_nobody_control():
    rig = Rig()
    assert ask(rig, Action.WRITE, 60.0, OTHER_PLC, control_word=SHUT_DOWN) is Code.STALE
    assert rig.channel.owner is None


def test_giving_control_back_is_never_too_late():
    rig = Rig()
    rig.run()
    assert ask(rig, Action.RELEASE_CONTROL, 60.0) is Code.OK
    assert rig.channel.owner is None
    assert not rig.enables


@pytest.mark.parametrize(("control", "ms"), [("none", 0), ("modbus", 25), ("opcua", 25), ("zenoh", 125)])
def test_a_telegram_may_be_older_where_its_connection_is_not_seen(control: str, ms: int) -> None:
    """By the time for which a hang goes unnoticed; of a drive that nobody commands there is none."""
    assert way_ms(control) == ms


@pytest.mark.parametrize(("began", "counts"), [(0.999, False), (1.0, True)])
def test_an_unseen_connection_that_begins_within_a_second_of_a_hang_brings_what_may_have_waited(
    began: float, counts: bool
) -> None:
    look = LoopPulse(began, steady_since=0.0)
    arrived = Inflow(began, look, is_hidden=True).arrive(began, look)
    assert arrived == (began if counts else NEVER)


@pytest.mark.parametrize(("late_s", "assumed"), [(0.0, "now"), (0.0001, "then")])
def test_what_cannot_have_waited_for_longer_than_is_assumed_came_now(late_s: float, assumed: str) -> None:
    look = LoopPulse(0.0, 0.0)
    now = GRAIN_MS / 1000 - NOW_S + late_s
    assert Inflow(0.0, look).arrive(now, look) == (now if assumed == "now" else 0.0)
