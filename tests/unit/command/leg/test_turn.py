"""A turn of the leg: what is stopped, heard, left and cleared, and which word goes to the drive then."""

from __future__ import annotations

import pytest

from bridge.command import Code, Start
from bridge.command.leg.effect import Heard, LetGo, StartEnded, Tell, Tripped
from bridge.command.leg.state import Motion, Owner, Stage
from bridge.command.leg.turn import Turn, at_rest, control_word
from bridge.drive import DriveState
from bridge.text import render
from tests.support.leg import PLC, Leg, settings_of

SHUT_DOWN, RUN, DISABLE = 0x047E, 0x047F, 0x0000
ACKNOWLEDGE = 0x0080
"""NORD's (BU 2500 §6.5.1, §6.8)."""


def running(**given: object) -> Leg:
    leg = Leg(settings_of("nord/sk-tu4-cao", **{"fieldbus_timeout_ms": 200, **given}))
    leg.writes(SHUT_DOWN)
    leg.writes(RUN, setpoint_1=0x2000)
    leg.says(DriveState.OPERATION_ENABLED)
    assert leg.enables
    return leg


def turn_of(leg: Leg, at: float | None = None) -> Turn:
    return Turn(leg.settings, leg.state, leg.now if at is None else at)


def test_a_turn_without_anything_is_the_state_that_it_was_made_of() -> None:
    leg = running()
    assert turn_of(leg).end() == leg.state


def test_a_stop_of_some_kind_stays_as_it_is_and_an_enabling_word_becomes_one() -> None:
    words = running().settings.words
    assert at_rest(words, SHUT_DOWN) == SHUT_DOWN
    assert not words.enables(at_rest(words, RUN))
    assert at_rest(words, SHUT_DOWN | ACKNOWLEDGE) == SHUT_DOWN, "without the acknowledge"


@pytest.mark.parametrize("bit", [None, False, True])
def test_the_acknowledge_bit_is_always_as_the_owner_wrote_it(bit: bool | None) -> None:
    leg = running()
    state = leg.state._replace(edges=leg.state.edges._replace(bit=bit), word=SHUT_DOWN)
    assert control_word(leg.settings.words, state) == SHUT_DOWN | (ACKNOWLEDGE if bit else 0)


def test_what_is_known_of_a_running_drive() -> None:
    turn = turn_of(running())
    assert turn.is_enabling
    assert turn.is_enabled
    assert turn.is_commanded
    assert not turn.is_tripped
    turn.way = turn.way._replace(is_heard=False)
    assert not turn.is_enabled, "what it said before its node restarted does not count"


def test_a_stop_is_the_bridges_and_drops_the_setpoints() -> None:
    turn = turn_of(running())
    turn.stop(SHUT_DOWN)
    assert (turn.word, turn.is_ours, turn.setpoints) == (SHUT_DOWN, True, turn.rest)
    assert not turn.is_asked
    turn.stop(SHUT_DOWN, is_asked=True)
    assert turn.is_asked


def test_a_stop_by_a_command_is_sent_and_lets_go_of_what_is_held() -> None:
    turn = turn_of(running())
    turn.stop_as_asked(DISABLE)
    assert turn.sent.words[0] == DISABLE
    assert turn.effects == [LetGo()]


def test_a_telegram_counts_from_when_it_came_and_none_from_a_newer_one() -> None:
    turn = turn_of(running(), at=100.5)
    turn.hear(100.4, ("control_word",))
    assert turn.timer.deadline == pytest.approx(100.6)
    assert turn.effects == [Heard(("control_word",))]
    turn.hear(100.1)
    assert turn.timer.heard_at == 100.4
    assert turn.timer.deadline == pytest.approx(100.6)


def test_a_token_ends_a_telegrams_time_before_the_watchdog_does() -> None:
    turn = turn_of(running(), at=100.5)
    turn.owner = turn.owner._replace(alive_until=100.55)
    turn.hear(100.5)
    assert turn.timer.deadline == 100.55


def test_without_a_time_out_nothing_ends_it() -> None:
    turn = turn_of(running(fieldbus_timeout_ms=0), at=100.5)
    turn.hear(100.5)
    assert turn.timer.deadline is None


def test_who_leaves_stops_its_drive_and_takes_its_time_out_along() -> None:
    turn = turn_of(running())
    turn.timer = turn.timer._replace(timeout_ms=500)
    turn.leave()
    assert turn.owner.identity is None
    assert turn.timer.timeout_ms == 200
    assert not turn.settings.words.enables(turn.word)
    (told,) = turn.effects
    assert isinstance(told, Tell)
    assert render(told.said) == "fieldbus_timeout_ms = 200 again, as in the site file"


def test_a_start_that_is_going_on_ends_when_its_owner_leaves() -> None:
    leg = Leg(settings_of("nord/sk-tu4-cao", control="modbus"))
    leg.says(DriveState.READY)
    leg.asks(Start())
    assert leg.state.start is not None
    turn = turn_of(leg)
    turn.leave()
    ended = [effect for effect in turn.effects if isinstance(effect, StartEnded)]
    said = [(one.outcome.code, one.outcome.message) for one in ended]
    assert said == [(Code.CANCELLED, "control of the drive has changed")]
    assert turn.start is None


@pytest.mark.parametrize(("at", "trips"), [(100.199, False), (100.2, True)])
def test_a_watchdog_trips_at_its_deadline_and_says_when_it_was_due(at: float, trips: bool) -> None:
    turn = turn_of(running(), at)
    turn.judge()
    assert turn.is_tripped is trips
    found = [effect for effect in turn.effects if isinstance(effect, Tripped)]
    assert found == ([Tripped(100.2, PLC, 200)] if trips else [])
    assert turn.timer.is_overdue is trips


def test_a_lease_that_has_run_out_is_told_and_left() -> None:
    turn = turn_of(running(), 100.1)
    turn.owner = Owner(PLC, lease_until=100.1)
    turn.judge()
    assert turn.owner.identity is None
    assert [render(one.said) for one in turn.effects if isinstance(one, Tell)] == [
        f"the lease of {PLC} ran out"
    ]


def test_an_acknowledge_leaves_the_trip_behind_the_interlock() -> None:
    leg = running()
    leg.trips()
    turn = turn_of(leg)
    turn.clear(pulse=False)
    turn.settle()
    assert turn.stage is Stage.INTERLOCKED
    assert not turn.is_enabling
    assert turn.pulse_until is None
    again = turn_of(leg)
    again.clear(pulse=True)
    assert again.pulse_until is not None


def test_what_is_written_for_a_drive_that_is_not_enabled_does_not_make_it_jump() -> None:
    leg = Leg(settings_of("cia402/cyclic-position"))
    assert leg.settings.follows
    turn = turn_of(leg)
    turn.setpoints = tuple(word + 1 for word in turn.rest)
    turn.keep_at_rest()
    for place, _ in leg.settings.follows:
        assert turn.setpoints[place] == turn.rest[place]


@pytest.mark.parametrize(
    ("change", "why"),
    [
        ({"is_open": False, "why": "the node is lost"}, "the node is lost"),
        ({"why_unplaced": "its position is late"}, "its position is late"),
        ({}, "restart interlock: send a control word that does not enable first"),
    ],
)
def test_why_an_enabling_word_is_held_back(change: dict[str, object], why: str) -> None:
    leg = Leg(settings_of("nord/sk-tu4-cao"))
    turn = turn_of(leg)
    turn.way = turn.way._replace(**change)
    assert render(turn.why_blocked) == why
    assert turn.may_enable is (not change)


def test_motion_begins_with_the_first_enabling_word() -> None:
    leg = Leg(settings_of("nord/sk-tu4-cao", fieldbus_timeout_ms=200))
    leg.writes(SHUT_DOWN)
    leg.says(DriveState.READY)
    leg.writes(RUN)
    assert leg.state.motion is Motion.EXPECTED
