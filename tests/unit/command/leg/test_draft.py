"""The working copy of a leg's state: what is known, stopped, heard and taken back."""

from __future__ import annotations

from dataclasses import replace

import pytest

from bridge.command.leg.effect import Heard
from bridge.text import render
from tests.support.leg import SHUT_DOWN, Leg, draft_of, running_nord, settings_of


def test_a_turn_without_anything_is_the_state_that_it_was_made_of() -> None:
    leg = running_nord()
    assert draft_of(leg).end() == leg.state


def test_what_is_known_of_a_running_drive() -> None:
    draft = draft_of(running_nord())
    assert draft.is_enabling
    assert draft.is_enabled
    assert draft.is_commanded
    assert not draft.is_tripped
    draft.way = draft.way._replace(is_heard=False)
    assert not draft.is_enabled, "what it said before its node restarted does not count"


def test_a_stop_is_the_bridges_and_drops_the_setpoints() -> None:
    draft = draft_of(running_nord())
    draft.stop(SHUT_DOWN)
    assert (draft.word, draft.is_ours, draft.setpoints) == (SHUT_DOWN, True, draft.rest)
    assert not draft.is_asked
    draft.stop(SHUT_DOWN, is_asked=True)
    assert draft.is_asked


@pytest.mark.parametrize("resumes", [True, False])
def test_a_stop_of_the_bridge_leaves_it_asked_only_where_an_acknowledge_resumes(resumes: bool) -> None:
    leg = running_nord()
    draft = draft_of(leg)
    draft.settings = replace(draft.settings, acknowledge_resumes=resumes)
    draft.stop(SHUT_DOWN)
    assert not draft.is_asked, "nobody has asked"
    draft.stop(SHUT_DOWN, is_asked=True)
    draft.stop(SHUT_DOWN)
    assert draft.is_asked is resumes


def test_a_telegram_counts_from_when_it_came_and_none_from_a_newer_one() -> None:
    draft = draft_of(running_nord(), at=100.5)
    draft.hear(100.4, ("control_word",))
    assert draft.timer.deadline == pytest.approx(100.6)
    assert draft.effects == [Heard(("control_word",))]
    draft.hear(100.1)
    assert draft.timer.heard_at == 100.4
    assert draft.timer.deadline == pytest.approx(100.6)


def test_a_token_ends_a_telegrams_time_before_the_watchdog_does() -> None:
    draft = draft_of(running_nord(), at=100.5)
    draft.owner = draft.owner._replace(alive_until=100.55)
    draft.hear(100.5)
    assert draft.timer.deadline == 100.55


def test_without_a_time_out_nothing_ends_it() -> None:
    draft = draft_of(running_nord(fieldbus_timeout_ms=0), at=100.5)
    draft.hear(100.5)
    assert draft.timer.deadline is None


def test_what_is_written_for_a_drive_that_is_not_enabled_does_not_make_it_jump() -> None:
    leg = Leg(settings_of("cia402/cyclic-position"))
    assert leg.settings.follows
    draft = draft_of(leg)
    draft.setpoints = tuple(word + 1 for word in draft.rest)
    draft.keep_at_rest()
    for place, _ in leg.settings.follows:
        assert draft.setpoints[place] == draft.rest[place]


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
    draft = draft_of(leg)
    draft.way = draft.way._replace(**change)
    assert render(draft.why_blocked) == why
    assert draft.may_enable is (not change)


def test_what_is_begun_anew_leaves_nothing_of_it() -> None:
    leg = running_nord()
    draft = draft_of(leg)
    draft.stop(SHUT_DOWN, is_asked=True)
    draft.hear(leg.now, ("control_word",))
    draft.begin_anew()
    assert draft.end() == leg.state
    assert not draft.effects
    assert draft.asked is None
