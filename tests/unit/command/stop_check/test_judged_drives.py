"""The judgement whether a drive follows its stop, by examples and against simulated drives at random."""

from __future__ import annotations

from dataclasses import dataclass, field

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bridge.command.stop_check.drive_check import DriveStopCheck
from bridge.command.stop_check.state import Bounds, LastStop, Says, Sent, StopVerdict
from bridge.drive import OwnJudgement, OwnVerdict
from bridge.drive.own_judgement import DriveWatch
from tests.support.judge import Judge
from tests.support.nightly import examples
from tests.support.rig import Rig

BOUNDS = Bounds(off_s=0.5, ramp_s=5.0, silence_s=6.0)
PAUSE_S = 0.1


class Judged:
    """A ``Judge`` whose drive sends every 50 ms what it last said."""

    def __init__(self, pause_s: float | None = PAUSE_S) -> None:
        self.follow = Judge()
        self.now = 100.0
        self.heard_at: float | None = None
        self.pause_s = pause_s
        self.verdicts: list[StopVerdict] = []
        self.follow.on_node(is_there=True)

    def send(self, sent: Sent) -> None:
        self.follow.on_output(sent)
        self.follow.on_handed_over(self.now, BOUNDS)

    def says(self, says: Says) -> None:
        self.heard_at = self.now
        self.follow.on_report(says, self.now)

    def run(self, seconds: float, *, heard: bool = True) -> None:
        for _ in range(round(seconds / 0.05)):
            self.now += 0.05
            if heard:
                self.heard_at = self.now
            self.verdicts += self.follow.on_time(self.now, self.heard_at, self.pause_s)

    def enabled(self) -> None:
        self.send(Sent.ENABLES)
        self.says(Says.ENABLED)
        self.run(1.0)
        assert not self.verdicts

    @property
    def outcomes(self) -> list[LastStop]:
        return [verdict.outcome for verdict in self.verdicts]


def judged(pause_s: float | None = PAUSE_S) -> Judged:
    one = Judged(pause_s)
    one.enabled()
    return one


def test_forwarded_then_followed() -> None:
    drive = judged()
    drive.send(Sent.OFF)
    assert drive.follow.state is LastStop.FORWARDED
    drive.run(0.2)
    drive.says(Says.AT_REST)
    drive.run(10)
    assert drive.outcomes == [LastStop.FOLLOWED]
    assert drive.follow.follows


def test_a_drive_that_runs_on_is_named_once() -> None:
    drive = judged()
    drive.send(Sent.OFF)
    drive.run(0.4)
    assert not drive.verdicts
    drive.run(100)
    (verdict,) = drive.verdicts
    assert verdict.outcome is LastStop.IGNORED
    assert verdict.before is LastStop.FORWARDED
    assert BOUNDS.off_s <= verdict.at - verdict.since < BOUNDS.off_s + 2 * PAUSE_S
    assert not drive.follow.follows


def test_a_ramp_has_its_time() -> None:
    drive = judged()
    drive.send(Sent.RAMP)
    drive.run(4.9)
    assert not drive.verdicts
    drive.run(0.3)
    assert drive.outcomes == [LastStop.IGNORED]


def test_a_stronger_word_shortens_the_bound() -> None:
    drive = judged()
    drive.send(Sent.RAMP)
    drive.run(1.0)
    drive.send(Sent.OFF)
    drive.run(0.4)
    assert not drive.verdicts
    drive.run(0.3)
    assert drive.outcomes == [LastStop.IGNORED]


def test_words_that_go_to_and_fro_do_not_put_the_end_off_for_ever() -> None:
    drive = judged()
    for _ in range(200):
        drive.send(Sent.OFF)
        drive.run(0.05)
        drive.send(Sent.RAMP)
        drive.run(0.05)
    assert drive.outcomes == [LastStop.IGNORED]


def test_a_drive_that_is_not_heard_is_not_judged_and_then_from_when_it_is_back() -> None:
    drive = judged()
    drive.send(Sent.OFF)
    drive.run(60, heard=False)
    assert not drive.verdicts
    assert drive.follow.follows
    drive.follow.on_pause(drive.now)
    drive.says(Says.ENABLED)
    drive.run(0.45)
    assert not drive.verdicts
    drive.run(0.2)
    assert drive.outcomes == [LastStop.IGNORED]


def test_a_drive_that_sends_changes_alone_is_judged_by_the_time() -> None:
    drive = judged(None)
    drive.send(Sent.OFF)
    drive.run(0.45, heard=False)
    assert not drive.verdicts
    drive.run(0.1, heard=False)
    assert drive.outcomes == [LastStop.IGNORED]


def test_a_drive_that_sends_changes_alone_and_was_not_enabled_follows() -> None:
    drive = Judged(None)
    drive.says(Says.AT_REST)
    drive.send(Sent.ENABLES)
    drive.send(Sent.OFF)
    drive.run(0.4, heard=False)
    assert not drive.verdicts, "the word that enabled may still be on its way"
    drive.run(1.0, heard=False)
    assert drive.outcomes == [LastStop.FOLLOWED]


def test_what_was_decided_and_not_sent_is_no_stop_yet() -> None:
    drive = judged()
    drive.follow.on_output(Sent.OFF)
    drive.run(10)
    assert not drive.verdicts
    drive.follow.on_handed_over(drive.now, BOUNDS)
    drive.run(0.4)
    assert not drive.verdicts
    drive.run(0.3)
    assert drive.outcomes == [LastStop.IGNORED]


def test_enabled_by_somebody_else() -> None:
    drive = judged()
    drive.send(Sent.OFF)
    drive.says(Says.AT_REST)
    drive.run(3600)
    drive.says(Says.ENABLED)
    drive.run(0.05)
    assert drive.outcomes == [LastStop.FOLLOWED, LastStop.IGNORED]
    assert drive.verdicts[-1].before is LastStop.FOLLOWED


def test_the_word_that_enabled_may_be_on_its_way_when_the_stop_goes_out() -> None:
    drive = Judged()
    drive.send(Sent.ENABLES)
    drive.says(Says.AT_REST)
    drive.send(Sent.OFF)
    drive.run(0.1)
    drive.says(Says.ENABLED)
    drive.run(0.1)
    drive.says(Says.AT_REST)
    drive.run(10)
    assert drive.outcomes == [LastStop.FOLLOWED]


def test_found_enabled_at_boot_up() -> None:
    drive = Judged()
    drive.send(Sent.RAMP)
    drive.send(Sent.OFF)
    drive.follow.on_node(is_there=False)
    drive.follow.on_node(is_there=True)
    drive.follow.on_handed_over(drive.now, BOUNDS)
    drive.says(Says.ENABLED)
    drive.run(0.7)
    assert drive.outcomes == [LastStop.IGNORED]


def test_still_enabled_after_the_reaction_is_said_to_be_so() -> None:
    drive = judged()
    drive.send(Sent.OFF)
    drive.run(1.0)
    drive.follow.on_node(is_there=False)
    assert drive.follow.state is LastStop.IGNORED
    assert not drive.follow.follows
    drive.follow.on_node(is_there=True)
    drive.follow.on_handed_over(drive.now, BOUNDS)
    drive.says(Says.ENABLED)
    drive.run(1.0)
    assert drive.outcomes == [LastStop.IGNORED, LastStop.IGNORED]
    assert [verdict.again for verdict in drive.verdicts] == [False, True]


# cut off by the bridge itself


def cut_off(drive: Judged, sent: Sent = Sent.OFF) -> Judged:
    """The bridge stops the drive's node in the same turn in which it stops the drive."""
    drive.follow.on_output(sent)
    drive.follow.on_cut_off(drive.now, BOUNDS)
    drive.follow.on_node(is_there=False)
    return drive


def test_who_was_cut_off_while_enabled_is_named_at_the_bound() -> None:
    drive = cut_off(judged())
    assert not drive.follow.is_judged, "nobody need wait for what it says"
    drive.run(0.4, heard=False)
    assert not drive.verdicts
    drive.run(100, heard=False)
    (verdict,) = drive.verdicts
    assert verdict.outcome is LastStop.IGNORED and verdict.is_cut_off
    assert not drive.follow.follows
    assert drive.follow.next_deadline() is None


def test_who_has_followed_before_it_is_cut_off_is_not_named() -> None:
    drive = judged()
    drive.send(Sent.OFF)
    drive.run(0.1)
    drive.says(Says.AT_REST)
    drive.run(0.1)
    cut_off(drive, Sent.RAMP).run(100, heard=False)
    assert drive.outcomes == [LastStop.FOLLOWED]


def test_who_says_so_before_its_node_leaves_is_not_named() -> None:
    drive = cut_off(judged())
    drive.run(0.05)
    drive.says(Says.AT_REST)
    drive.run(100, heard=False)
    assert drive.outcomes == [LastStop.FOLLOWED]


def test_a_node_that_says_that_it_is_stopped_speaks_for_its_drive() -> None:
    drive = cut_off(judged())
    for _ in range(3):
        drive.run(0.1, heard=False)
        drive.follow.on_node_stopped(drive.now)
    drive.run(100, heard=False)
    assert drive.outcomes == [LastStop.FOLLOWED]


def test_what_it_was_told_just_before_may_have_enabled_it() -> None:
    drive = Judged()
    drive.send(Sent.OFF)
    drive.says(Says.AT_REST)
    drive.run(1.0)
    drive.send(Sent.ENABLES)
    cut_off(drive).run(1.0, heard=False)
    assert drive.outcomes == [LastStop.FOLLOWED, LastStop.IGNORED]


def test_a_node_that_starts_anew_is_not_named() -> None:
    drive = cut_off(judged())
    drive.follow.on_restart()
    drive.run(100, heard=False)
    assert not drive.verdicts


@pytest.mark.landing
def test_holding_is_obeying_where_the_voltage_may_stay() -> None:
    drive = judged()
    drive.send(Sent.RAMP)
    drive.run(1.0)
    drive.says(Says.HOLDING)
    drive.run(3600)
    drive.says(Says.ENABLED)  # pushed by its load
    drive.run(1.0)
    drive.says(Says.HOLDING)
    drive.run(3600)
    assert drive.outcomes == [LastStop.FOLLOWED]
    drive.send(Sent.OFF)
    drive.run(0.4)
    drive.says(Says.AT_REST)
    drive.run(10)
    assert drive.outcomes == [LastStop.FOLLOWED]


def test_holding_is_not_obeying_where_the_voltage_is_taken() -> None:
    drive = judged()
    drive.send(Sent.RAMP)
    drive.says(Says.HOLDING)
    drive.run(100)
    drive.send(Sent.OFF)
    drive.run(1.0)
    assert drive.outcomes == [LastStop.FOLLOWED, LastStop.IGNORED]


def test_on_the_ramp_of_a_fault() -> None:
    drive = judged()
    drive.send(Sent.OFF)
    drive.says(Says.AT_REST)
    drive.run(3600)
    drive.says(Says.STOPPING)
    drive.run(4.0)
    assert drive.outcomes == [LastStop.FOLLOWED]
    drive.run(2.0)
    assert drive.outcomes == [LastStop.FOLLOWED, LastStop.IGNORED], "a ramp has an end"


def test_two_masters_that_alternate_are_one_occurrence() -> None:
    drive = judged()
    drive.send(Sent.OFF)
    drive.says(Says.AT_REST)
    drive.run(10)
    for _ in range(50):
        drive.says(Says.ENABLED)
        drive.run(0.05)
        drive.says(Says.AT_REST)
        drive.run(0.05)
    assert drive.outcomes == [LastStop.FOLLOWED, LastStop.IGNORED]
    drive.run(1.0)
    assert drive.outcomes[2:] == [LastStop.FOLLOWED]
    assert drive.verdicts[-1].before is LastStop.IGNORED


def test_two_masters_that_alternate_after_a_long_time_are_one_occurrence_too() -> None:
    drive = judged()
    drive.send(Sent.OFF)
    drive.run(1.0)
    drive.now += 60.0
    for _ in range(50):
        drive.says(Says.AT_REST)
        drive.run(0.05)
        drive.says(Says.ENABLED)
        drive.run(0.05)
    assert drive.outcomes == [LastStop.IGNORED]


def test_a_ramp_is_over_when_the_drive_has_been_at_rest() -> None:
    drive = judged()
    drive.send(Sent.RAMP)
    drive.run(0.3)
    drive.says(Says.AT_REST)
    drive.run(0.7)
    drive.says(Says.ENABLED)
    drive.run(0.7)
    assert drive.outcomes == [LastStop.FOLLOWED, LastStop.IGNORED]


def test_at_rest_before_the_enabling_word_arrives_ends_no_ramp() -> None:
    drive = Judged()
    drive.says(Says.AT_REST)
    drive.send(Sent.ENABLES)
    drive.send(Sent.RAMP)
    drive.run(0.05)
    drive.says(Says.ENABLED)
    drive.run(0.7)
    drive.says(Says.AT_REST)
    drive.run(10)
    assert drive.outcomes == [LastStop.FOLLOWED]


def test_what_was_said_before_the_stop_does_not_count() -> None:
    drive = Judged()
    drive.send(Sent.ENABLES)
    said_at = drive.now
    drive.now += 0.01
    drive.send(Sent.OFF)
    drive.follow.on_report(Says.AT_REST, said_at)  # the bus is drained late
    assert drive.follow.state is LastStop.FORWARDED


def test_silence_is_a_stop_as_long_as_the_drive_watches_us() -> None:
    drive = judged()
    drive.send(Sent.SILENT)
    drive.run(5.9)
    assert not drive.verdicts
    drive.run(0.3)
    assert drive.outcomes == [LastStop.IGNORED]


def test_a_status_word_of_no_known_state_says_nothing() -> None:
    drive = judged()
    drive.send(Sent.OFF)
    drive.says(Says.NOTHING)
    drive.run(100)
    assert not drive.verdicts


# at random

TPDO_S = 0.05
STEP_S = 0.01
WAY_S = 0.02
"""The longest way of a word to the drive, with its repetition."""
OFF_S = 0.1
RAMP_S = 1.0
RANDOM = Bounds(3 * PAUSE_S + WAY_S + OFF_S, 3 * PAUSE_S + WAY_S + OFF_S + RAMP_S)


@dataclass(slots=True)
class Drive:
    """Takes every word it hears, and obeys in its time; on a ramp it says *enabled* until the end of it."""

    off_s: float
    ramp_s: float
    holds: bool
    word: Sent = Sent.OFF
    state: Says = Says.AT_REST
    is_deaf: bool = False
    stops_at: float | None = None
    on_way: list[tuple[float, Sent]] = field(default_factory=list[tuple[float, Sent]])

    def step(self, now: float) -> None:
        while self.on_way and self.on_way[0][0] <= now:
            self._take(self.on_way.pop(0)[1], now)
        if self.stops_at is not None and now >= self.stops_at:
            self.stops_at = None
            self.state = Says.HOLDING if self.holds and self.word is Sent.RAMP else Says.AT_REST

    def _take(self, word: Sent, now: float) -> None:
        before, self.word = self.word, word
        if word is before:
            return
        if word is Sent.ENABLES:
            self.state, self.stops_at = Says.ENABLED, None
        elif self.state is not Says.AT_REST:
            ends = now + (self.off_s if word is Sent.OFF else self.ramp_s)
            self.stops_at = ends if self.stops_at is None or word is Sent.RAMP else min(ends, self.stops_at)


@dataclass(slots=True)
class Bus:
    """Bridge, wire and drive: words are repeated, telegrams wait in a buffer while the bridge is late."""

    drive: Drive
    way_s: float
    now: float = 0.0
    follow: Judge = field(default_factory=Judge)
    wanted: Sent = Sent.OFF
    word: Sent = Sent.OFF
    cut_until: float = 0.0
    late_until: float = 0.0
    tpdo_at: float = 0.0
    last: float | None = None
    shown: Says = Says.NOTHING
    inbox: list[tuple[float, Says]] = field(default_factory=list[tuple[float, Says]])
    verdicts: list[StopVerdict] = field(default_factory=list[StopVerdict])

    def __post_init__(self) -> None:
        self.follow.on_node(is_there=True)

    def run(self, seconds: float) -> None:
        end = self.now + seconds
        while self.now < end:
            self.now = round(self.now + STEP_S, 6)
            cut = self.now < self.cut_until
            if not cut and not self.drive.is_deaf:
                self.drive.on_way.append((self.now + self.way_s, self.word))
            self.drive.step(self.now)
            if self.now >= self.tpdo_at:
                self.tpdo_at = self.now + TPDO_S
                if not cut:
                    self.inbox.append((self.now, self.drive.state))
            if self.now >= self.late_until:
                self.round()

    def round(self) -> None:
        inbox, self.inbox = self.inbox, []
        for at, says in inbox:
            if self.last is not None and at - self.last > PAUSE_S:
                self.follow.on_pause(at)
            self.last = at
            if says is not self.shown:
                self.shown = says
                self.follow.on_report(says, at)
        self.verdicts += self.follow.on_time(self.now, self.last, PAUSE_S)
        self.word = self.wanted
        self.follow.on_handed_over(self.now, RANDOM)

    def send(self, word: Sent) -> None:
        """A bridge that is late decides nothing; what it decides goes out with the round."""
        if self.now >= self.late_until:
            self.wanted = word
            self.follow.on_output(word)

    @property
    def ignored(self) -> list[StopVerdict]:
        return [verdict for verdict in self.verdicts if verdict.outcome is LastStop.IGNORED]


steps = st.one_of(
    st.tuples(st.just("send"), st.sampled_from([Sent.ENABLES, Sent.RAMP, Sent.OFF])),
    st.tuples(st.just("cut"), st.floats(0.01, 2.0)),
    st.tuples(st.just("late"), st.floats(0.01, 2.0)),
)
plans = st.lists(st.tuples(steps, st.floats(0.0, 1.5)), max_size=25)
drives = st.builds(Drive, st.floats(0, OFF_S), st.floats(0, RAMP_S), st.booleans())


def played(bus: Bus, plan: list[tuple[tuple[str, Sent | float], float]]) -> None:
    for (what, more), seconds in plan:
        if isinstance(more, Sent):
            bus.send(more)
        elif what == "cut":
            bus.cut_until = bus.now + more
        else:
            bus.late_until = bus.now + more
        bus.run(seconds)


@pytest.mark.landing
@settings(max_examples=examples(300))
@given(drives, st.floats(0, WAY_S), plans)
def test_a_drive_that_follows_in_time_is_never_named(
    drive: Drive, way_s: float, plan: list[tuple[tuple[str, Sent | float], float]]
) -> None:
    bus = Bus(drive, way_s)
    played(bus, plan)
    bus.run(RANDOM.ramp_s + 2)
    assert not bus.ignored
    if bus.word is not Sent.ENABLES:
        bus.run(4.0)
        assert bus.follow.state is LastStop.FOLLOWED


@settings(max_examples=examples(300))
@given(drives, st.floats(0, WAY_S), plans, st.sampled_from([Sent.RAMP, Sent.OFF]))
def test_a_drive_that_does_not_follow_is_named_within_the_bound(
    drive: Drive, way_s: float, plan: list[tuple[tuple[str, Sent | float], float]], stop: Sent
) -> None:
    bus = Bus(drive, way_s)
    played(bus, plan)
    bus.cut_until = bus.late_until = 0.0
    bus.send(Sent.ENABLES)
    bus.run(0.5)
    bus.drive.is_deaf = True
    bus.drive.on_way.clear()
    began = bus.now
    bus.send(stop)
    bound = RANDOM.of(stop)
    assert bound is not None
    bus.run(bound + 2 * PAUSE_S + 2 * STEP_S)
    (verdict,) = bus.ignored
    assert verdict.at <= began + bound + PAUSE_S + STEP_S
    assert not bus.follow.follows


@settings(max_examples=examples(200))
@given(drives, st.floats(0, WAY_S), plans)
def test_a_drive_that_somebody_else_enables_is_named(
    drive: Drive, way_s: float, plan: list[tuple[tuple[str, Sent | float], float]]
) -> None:
    bus = Bus(drive, way_s)
    played(bus, plan)
    bus.cut_until = bus.late_until = 0.0
    bus.send(Sent.OFF)
    bus.run(RANDOM.ramp_s + 2)
    assert not bus.ignored
    bus.drive.is_deaf = True
    bus.drive.state = Says.ENABLED
    bus.run(PAUSE_S + 2 * STEP_S)
    assert len(bus.ignored) == 1


def test_of_a_drive_that_watches_our_heartbeat_too_silence_ends_its_process_data_alone() -> None:
    stops = OwnVerdict.STOPS
    heartbeat = DriveWatch("heartbeat", "heartbeat", "", 300.0, "", stops, silent_ms=100)
    process_data = DriveWatch("RPDO1", "process_data", "", 3000.0, "", stops, silent_ms=100)
    following = DriveStopCheck(Rig().channel)
    bounds = following._bounds(10, OwnJudgement((heartbeat, process_data)))
    assert bounds.silence_s == pytest.approx(3.0 + bounds.ramp_s)
    bounds = following._bounds(10, OwnJudgement((heartbeat,)))
    assert bounds.silence_s == pytest.approx(0.4 + bounds.ramp_s), "soon found to go on"
