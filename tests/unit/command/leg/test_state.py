"""Stages and motions of a leg: each is in the sets that the rules go by, and has its meaning in words."""

from __future__ import annotations

from bridge.command.leg.state import (
    ANY_TRIP,
    AWAITS_REPORT,
    BLOCKED,
    MAY_FOLLOW_LATE,
    MEANING,
    MUTE,
    NORMAL,
    REACTING,
    RESTS,
    STARTING,
    UNHEARD,
    WANTS_STOP_WORD,
    Motion,
    Stage,
)


def test_each_stage_is_normal_or_in_a_start_or_tripped_and_never_two_of_them() -> None:
    assert len(NORMAL) + len(STARTING) + len(ANY_TRIP) == len(Stage)
    assert {*NORMAL, *STARTING, *ANY_TRIP} == set(Stage)


def test_each_stage_has_a_meaning_of_its_own() -> None:
    assert set(MEANING) == set(Stage)
    assert len(set(MEANING.values())) == len(Stage)


def test_the_sets_within_others() -> None:
    assert MUTE < REACTING < ANY_TRIP < WANTS_STOP_WORD
    assert UNHEARD < AWAITS_REPORT < STARTING
    assert BLOCKED < WANTS_STOP_WORD
    assert {Stage.HELD, Stage.LET_GO} == ANY_TRIP - REACTING


def test_where_an_owner_may_enable_no_stop_word_is_wanted() -> None:
    for stage in (Stage.READY, Stage.ENABLED, *STARTING):
        assert stage not in WANTS_STOP_WORD
        assert stage not in BLOCKED
        assert not stage.is_tripped


def test_a_drive_rests_where_it_has_stopped_or_failed_and_may_follow_late_where_it_never_moved() -> None:
    assert {Motion.ENDED, Motion.FAULTED} == RESTS
    assert {Motion.EXPECTED, Motion.FAULTED} == MAY_FOLLOW_LATE
    assert Motion.SEEN not in RESTS | MAY_FOLLOW_LATE


def test_a_stage_is_found_by_its_text() -> None:
    assert {Stage.CLOSED: 1}["closed"] == 1  # type: ignore[index]
    assert Stage("silent") is Stage.SILENCED
