"""The working copy of a leg's state: what is known, stopped, heard and taken back."""

from __future__ import annotations

import pytest

from bridge.command.leg.effect import Heard
from bridge.text import render
from tests.support.leg import SHUT_DOWN, Leg, running_nord, settings_of, turn_of


def test_a_turn_without_anything_is_the_state_that_it_was_made_of() -> None:
    leg = running_nord()
    assert turn_of(leg).end() == leg.state


def test_what_is_known_of_a_running_drive() -> None:
    turn = turn_of(running_nord())
    assert turn.is_enabling
    assert turn.is_enabled
    assert turn.is_commanded
    assert not turn.is_tripped
    turn.way = turn.way._replace(is_heard=False)
    assert not turn.is_enabled, "what it said before its node restarted does not count"


def test_a_stop_is_the_bridges_and_drops_the_setpoints() -> None:
    turn = turn_of(running_nord())
    turn.stop(SHUT_DOWN)
    assert (turn.word, turn.is_ours, turn.setpoints) == (SHUT_DOWN, True, turn.rest)
    assert not turn.is_asked
    turn.stop(SHUT_DOWN, is_asked=True)
    assert turn.is_asked


def test_a_telegram_counts_from_when_it_came_and_none_from_a_newer_one() -> None:
    turn = turn_of(running_nord(), at=100.5)
    turn.hear(100.4, ("control_word",))
    assert turn.timer.deadline == pytest.approx(100.6)
    assert turn.effects == [Heard(("control_word",))]
    turn.hear(100.1)
    assert turn.timer.heard_at == 100.4
    assert turn.timer.deadline == pytest.approx(100.6)


def test_a_token_ends_a_telegrams_time_before_the_watchdog_does() -> None:
    turn = turn_of(running_nord(), at=100.5)
    turn.owner = turn.owner._replace(alive_until=100.55)
    turn.hear(100.5)
    assert turn.timer.deadline == 100.55


def test_without_a_time_out_nothing_ends_it() -> None:
    turn = turn_of(running_nord(fieldbus_timeout_ms=0), at=100.5)
    turn.hear(100.5)
    assert turn.timer.deadline is None


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


def test_what_is_begun_anew_leaves_nothing_of_it() -> None:
    leg = running_nord()
    turn = turn_of(leg)
    turn.stop(SHUT_DOWN, is_asked=True)
    turn.hear(leg.now, ("control_word",))
    turn.begin_anew()
    assert turn.end() == leg.state
    assert not turn.effects
    assert turn.asked is None
