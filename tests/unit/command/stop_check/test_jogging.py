"""An owner that jogs: run, stop, run. Who is deaf is named within a bound, and who obeys never."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise
from math import ceil

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bridge.command.stop_check.state import Bounds, LastStop, Says, Sent, StopVerdict
from tests.support.judge import Judge
from tests.support.nightly import examples

PAUSE_S = 0.1
WAY_S = 0.02
OFF_S = 0.1
RAMP_S = 8.0
SEEN_S = WAY_S + 0.05
SEEN_OFF_S = WAY_S + OFF_S
BOUNDS = Bounds(
    3 * PAUSE_S + WAY_S + OFF_S,
    3 * PAUSE_S + WAY_S + OFF_S + RAMP_S,
    seen_off_s=SEEN_OFF_S,
    seen_s=SEEN_S,
)
STEP_S = 0.01
FULL = 16384.0


@dataclass(slots=True)
class Motor:
    """``ramp_s`` is its time from full speed to standstill; ``late_s`` after a word it does what it says.
    ``brake_s`` it goes on saying *enabled* after the voltage has been taken. At standstill it says so."""

    ramp_s: float = 1.0
    late_s: float = 0.0
    brake_s: float = 0.0
    is_deaf: bool = False
    speed: float = FULL
    state: Says = Says.ENABLED
    word: Sent = Sent.ENABLES
    taken_at: float = 0.0
    due: list[tuple[float, Sent]] = field(default_factory=list[tuple[float, Sent]])

    def gets(self, word: Sent, now: float) -> None:
        if not self.is_deaf:
            self.due.append((now + self.late_s, word))

    def step(self, now: float) -> None:
        if self.is_deaf:
            return  # it goes on as it was
        while self.due and self.due[0][0] <= now:
            word = self.due.pop(0)[1]
            if word is not self.word:
                self.word, self.taken_at = word, now
        change = FULL * STEP_S / self.ramp_s
        if self.word is Sent.ENABLES:
            self.state, self.speed = Says.ENABLED, min(FULL, self.speed + change)
        elif self.word is Sent.OFF:
            self.speed = max(0.0, self.speed - FULL * STEP_S)
            if now - self.taken_at >= self.brake_s:
                self.state = Says.AT_REST
        else:
            self.speed = max(0.0, self.speed - change)
            if not self.speed:
                self.state = Says.AT_REST


class Jogged:
    """Bridge and drive; the word is on the bus with the next step, TPDOs come every ``tpdo_s``."""

    def __init__(self, motor: Motor, tpdo_s: float, *, has_speed: bool = True) -> None:
        self.motor, self.tpdo_s, self.has_speed = motor, tpdo_s, has_speed
        self.now = 0.0
        self.follow = Judge()
        self.said = Says.NOTHING
        self.tpdo_at = 0.0
        self.verdicts: list[StopVerdict] = []
        self.follow.on_node(is_there=True)
        self.send(Sent.ENABLES, 1.0)

    def send(self, word: Sent, seconds: float) -> None:
        self.follow.on_output(word)
        self.follow.on_handed_over(self.now, BOUNDS)
        end = self.now + seconds
        while self.now < end - STEP_S / 2:
            self.motor.gets(word, self.now)
            self.now = round(self.now + STEP_S, 6)
            self.motor.step(self.now)
            if self.now >= self.tpdo_at:
                self.tpdo_at = self.now + self.tpdo_s
                self.telegram()
            self.verdicts += self.follow.on_time(self.now, self.now, PAUSE_S)

    def telegram(self) -> None:
        if self.motor.state is not self.said:
            self.said = self.motor.state
            self.follow.on_report(self.said, self.now)
        self.follow.on_telegram(self.now, self.motor.speed if self.has_speed else None)

    def jog(self, word: Sent, run_s: float, stop_s: float, until_s: float) -> None:
        while self.now < until_s and not self.ignored:
            self.send(word, stop_s)
            self.send(Sent.ENABLES, run_s)

    @property
    def ignored(self) -> list[StopVerdict]:
        return [verdict for verdict in self.verdicts if verdict.outcome is LastStop.IGNORED]


def bound_s(run_s: float, stop_s: float, seen_s: float, limit_s: float, tpdo_s: float) -> float:
    """What the published bound says: stops count but for ``seen_s`` and the telegrams at their two ends."""
    counts_s = stop_s - seen_s - tpdo_s - 2 * STEP_S
    assert counts_s > 0
    return (ceil(limit_s / counts_s) + 1) * (run_s + stop_s)


JOGS = [(1.0, 0.3), (0.2, 0.4), (3.0, 1.0), (10.0, 2.0), (60.0, 7.9)]


@pytest.mark.parametrize(("run_s", "stop_s"), JOGS)
@pytest.mark.parametrize("word", [Sent.RAMP, Sent.OFF])
def test_a_deaf_drive_is_named_however_its_owner_jogs(run_s: float, stop_s: float, word: Sent) -> None:
    jogged = Jogged(Motor(is_deaf=True), 0.05)
    most_s = bound_s(run_s, stop_s, SEEN_S, BOUNDS.ramp_s / 4, 0.05)
    jogged.jog(word, run_s, stop_s, jogged.now + most_s)
    (verdict,) = jogged.ignored
    assert verdict.at < 1.0 + most_s
    assert not jogged.follow.follows or jogged.follow.state is LastStop.NONE


@pytest.mark.parametrize(("run_s", "stop_s"), [(1.0, 0.35), (60.0, 0.4)])
def test_after_words_that_take_the_voltage_no_speed_is_needed(run_s: float, stop_s: float) -> None:
    jogged = Jogged(Motor(is_deaf=True), 0.05, has_speed=False)
    most_s = bound_s(run_s, stop_s, SEEN_OFF_S, BOUNDS.off_s, 0.05)
    jogged.jog(Sent.OFF, run_s, stop_s, jogged.now + most_s)
    (verdict,) = jogged.ignored
    assert verdict.summed is not None and verdict.summed.stops > 1


@pytest.mark.parametrize("word", [Sent.RAMP, Sent.OFF])
def test_a_drive_that_goes_deaf_after_it_has_obeyed_for_long(word: Sent) -> None:
    motor = Motor(ramp_s=4.0)
    jogged = Jogged(motor, 0.05)
    jogged.jog(word, 1.0, 0.3, 100.0)
    assert not jogged.ignored
    motor.is_deaf = True
    motor.due.clear()
    motor.speed = FULL
    jogged.jog(word, 1.0, 0.3, 100.0 + 2 * bound_s(1.0, 0.3, SEEN_S, BOUNDS.ramp_s / 4, 0.05))
    assert len(jogged.ignored) == 1


def test_one_long_ramp_on_which_it_gets_no_slower_is_named_after_a_quarter_of_its_bound() -> None:
    jogged = Jogged(Motor(is_deaf=True), 0.05)
    jogged.send(Sent.RAMP, 60.0)
    (verdict,) = jogged.ignored
    assert verdict.at - verdict.since == pytest.approx(SEEN_S + BOUNDS.ramp_s / 4, abs=2 * PAUSE_S)


def test_it_is_named_again_only_after_as_much_time_again() -> None:
    jogged = Jogged(Motor(is_deaf=True), 0.05)
    for _ in range(200):
        jogged.send(Sent.RAMP, 0.3)
        jogged.send(Sent.ENABLES, 1.0)
    times = [verdict.at for verdict in jogged.ignored]
    assert len(times) > 1
    assert min(b - a for a, b in pairwise(times)) > 10.0


def jogged_by_hand(word: Sent = Sent.RAMP, *, has_speed: bool = True) -> Jogged:
    """Deaf, and almost named."""
    jogged = Jogged(Motor(is_deaf=True), 0.05, has_speed=has_speed)
    counts_s = BOUNDS.ramp_s / 4 if word is Sent.RAMP else BOUNDS.off_s
    seen_s = SEEN_S if word is Sent.RAMP else SEEN_OFF_S
    for _ in range(4):
        jogged.send(word, 0.9 * counts_s / 4 + seen_s)
        jogged.send(Sent.ENABLES, 1.0)
    assert not jogged.ignored
    return jogged


def again(jogged: Jogged) -> bool:
    """Whether one more such stop names it."""
    jogged.send(Sent.RAMP, 0.9)
    return bool(jogged.ignored)


def test_one_more_stop_names_it() -> None:
    assert again(jogged_by_hand())


@pytest.mark.parametrize("says", [Says.AT_REST, Says.STOPPING, Says.HOLDING])
def test_a_report_but_enabled_begins_the_sum_anew(says: Says) -> None:
    jogged = jogged_by_hand()
    for state in (says, Says.ENABLED):
        jogged.motor.state = state
        jogged.send(Sent.ENABLES, 0.2)
    assert not again(jogged)


def test_a_node_that_was_away_begins_the_sum_anew() -> None:
    jogged = jogged_by_hand()
    jogged.follow.on_node(is_there=False)
    jogged.follow.on_node(is_there=True)
    jogged.said = Says.NOTHING
    jogged.send(Sent.ENABLES, 1.0)
    assert not again(jogged)


def test_on_the_ramp_of_a_quick_stop_nothing_is_summed() -> None:
    jogged = Jogged(Motor(is_deaf=True, state=Says.STOPPING), 0.05)
    jogged.jog(Sent.RAMP, 1.0, 0.9, 30.0)
    assert not jogged.ignored


def test_silence_is_not_summed() -> None:
    """The drive is to stop by its own time-out, which has a bound of its own."""
    jogged = Jogged(Motor(is_deaf=True), 0.05)
    jogged.jog(Sent.SILENT, 1.0, 0.9, 30.0)
    assert not jogged.ignored


def test_a_telegram_older_than_the_stop_is_not_summed() -> None:
    jogged = Jogged(Motor(is_deaf=True), 0.05)
    jogged.send(Sent.RAMP, 0.5)
    before = jogged.follow.is_judged, jogged.now - 1.0
    jogged.follow.on_telegram(before[1], 0.0)  # the bus is drained late: it stood then
    jogged.send(Sent.RAMP, BOUNDS.ramp_s / 4 - 0.5 + SEEN_S + 0.1)
    assert len(jogged.ignored) == 1


def test_ramps_without_a_speed_are_not_summed() -> None:
    jogged = Jogged(Motor(is_deaf=True), 0.05, has_speed=False)
    jogged.jog(Sent.RAMP, 1.0, 0.9, 30.0)
    assert not jogged.ignored


motors = st.builds(
    Motor,
    ramp_s=st.floats(0.05, RAMP_S),
    late_s=st.floats(0.0, WAY_S),
    brake_s=st.floats(0.0, OFF_S),
)


@pytest.mark.landing
@settings(max_examples=examples(60), deadline=None)
@given(
    motors,
    st.sampled_from([0.01, 0.02, 0.05, 0.1]),
    st.booleans(),
    st.lists(
        st.tuples(
            st.sampled_from([Sent.RAMP, Sent.OFF]),
            st.sampled_from([0.05, 0.1, 0.3, 1.0, 5.0]),
            st.floats(0.02, 3.0),
        ),
        min_size=1,
        max_size=6,
    ),
)
def test_a_drive_that_obeys_is_never_named_however_its_owner_jogs(
    motor: Motor, tpdo_s: float, has_speed: bool, pattern: list[tuple[Sent, float, float]]
) -> None:
    """Also where its ramp or its brake takes longer than any stop."""
    jogged = Jogged(motor, tpdo_s, has_speed=has_speed)
    while jogged.now < 60.0:
        for word, stop_s, run_s in pattern:
            jogged.send(word, stop_s)
            jogged.send(Sent.ENABLES, run_s)
    assert not jogged.ignored


@settings(max_examples=examples(40), deadline=None)
@given(
    st.sampled_from([Sent.RAMP, Sent.OFF]),
    st.floats(0.3, 3.0),
    st.floats(0.05, 5.0),
    st.sampled_from([0.01, 0.05]),
)
def test_a_deaf_drive_is_named_within_the_bound_at_any_rhythm(
    word: Sent, stop_s: float, run_s: float, tpdo_s: float
) -> None:
    jogged = Jogged(Motor(is_deaf=True), tpdo_s)
    most_s = bound_s(run_s, stop_s, SEEN_S, BOUNDS.ramp_s / 4, tpdo_s)
    jogged.jog(word, run_s, stop_s, jogged.now + most_s)
    assert len(jogged.ignored) == 1


@pytest.mark.parametrize("has_begun_to_stop", [False, True])
def test_who_is_named_by_a_sum_follows_after_the_short_bound(has_begun_to_stop: bool) -> None:
    """Also where its first telegram after that says nothing that is known."""
    jogged = Jogged(Motor(is_deaf=True), 0.05)
    jogged.send(Sent.RAMP, STEP_S)
    judge = jogged.follow
    if has_begun_to_stop:
        judge.on_report(Says.STOPPING, jogged.now)
        judge.on_report(Says.ENABLED, jogged.now)
    before = LastStop.FOLLOWED if has_begun_to_stop else LastStop.FORWARDED
    while not jogged.ignored and jogged.now < BOUNDS.ramp_s:
        jogged.now += 0.05
        jogged.telegram()
        jogged.verdicts += judge.on_time(jogged.now, jogged.now, PAUSE_S)
    (verdict,) = jogged.ignored
    assert verdict.before is before and verdict.summed is not None
    judge.on_report(Says.AT_REST, jogged.now)
    judge.on_report(Says.ENABLED, jogged.now)
    assert judge.next_deadline() is None, "it does not follow any more"
    judge.on_report(Says.NOTHING, jogged.now + 0.05)
    judge.on_report(Says.AT_REST, jogged.now + 0.1)
    assert judge.on_time(jogged.now + 0.1, jogged.now + 0.1, PAUSE_S) == []
    at = jogged.now + 0.1 + BOUNDS.off_s
    assert judge.on_time(at - STEP_S, at - STEP_S, PAUSE_S) == []
    (verdict,) = judge.on_time(at, at, PAUSE_S)
    assert (verdict.outcome, verdict.before) == (LastStop.FOLLOWED, LastStop.IGNORED)
