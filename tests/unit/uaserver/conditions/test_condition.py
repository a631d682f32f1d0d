"""State of an alarm condition: each method, and what no sequence of calls can make of it (OPC 10000-9)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.uaserver.conditions.condition import (
    MAX_TIME_SHELVED_MS,
    MOST_EVENT_IDS,
    Act,
    Comment,
    ConditionState,
    Shelving,
    Step,
)
from bridge.uaserver.library import StatusCodes as Codes

NORMAL, NO_COMMENT = ConditionState(), Comment()
GERMAN = Comment("Förderband geprüft", "de", "", 1000.0)


def event(number: int) -> bytes:
    return number.to_bytes(16, "big")


def act(number: int = 1, comment: Comment = NO_COMMENT) -> Act:
    return Act(event(number), comment, "anna")


def raised(state: ConditionState = NORMAL, severity: int = 800, number: int = 1) -> ConditionState:
    """The state once its event has been told."""
    step = state.raised(severity, 1000, anew=True)
    assert step.tells
    return step.state.told(event(number))


ACKED = raised().acknowledge(act(), 2000).state
DISABLED = raised().disable(act(), 2000).state
TIMED = raised().timed_shelve(act(), 60_000, 2000).state
ONCE = raised().one_shot_shelve(act(), 2000).state


def test_an_alarm_goes_its_way_until_nothing_of_it_is_left() -> None:
    # Annex B.1.2: active, acknowledged, inactive, confirmed.
    ways = [raised()]
    ways.append(ways[-1].acknowledge(act(comment=GERMAN), 2000).state)
    ways.append(ways[-1].cleared(3000).state)
    ways.append(ways[-1].confirm(act(), 4000).state)
    told = [(one.active, one.acked, one.confirmed, one.retain) for one in ways]
    assert told == [
        (True, False, True, True),
        (True, True, False, True),
        (False, True, False, True),
        (False, True, True, False),
    ]
    assert ways[-1].comment == replace(GERMAN, user="anna")


@pytest.mark.parametrize(
    ("step", "code"),
    [
        (raised().acknowledge(act(2), 0), Codes.BadEventIdUnknown),
        (raised().add_comment(act(2), 0), Codes.BadEventIdUnknown),
        (NORMAL.acknowledge(act(), 0), Codes.BadEventIdUnknown),
        (ACKED.acknowledge(act(), 0), Codes.BadConditionBranchAlreadyAcked),
        (raised().confirm(act(), 0), Codes.BadConditionBranchAlreadyConfirmed),
        (NORMAL.enable(act(), 0), Codes.BadConditionAlreadyEnabled),
        (DISABLED.disable(act(), 0), Codes.BadConditionAlreadyDisabled),
        (DISABLED.acknowledge(act(), 0), Codes.BadConditionDisabled),
        (DISABLED.confirm(act(), 0), Codes.BadConditionDisabled),
        (DISABLED.add_comment(act(), 0), Codes.BadConditionDisabled),
        (DISABLED.one_shot_shelve(act(), 0), Codes.BadConditionDisabled),
        (DISABLED.unshelve(act(), 0), Codes.BadConditionDisabled),
        (NORMAL.timed_shelve(act(), 0, 0), Codes.BadShelvingTimeOutOfRange),
        (NORMAL.timed_shelve(act(), float("nan"), 0), Codes.BadShelvingTimeOutOfRange),
        (NORMAL.timed_shelve(act(), MAX_TIME_SHELVED_MS + 1, 0), Codes.BadShelvingTimeOutOfRange),
        (TIMED.timed_shelve(act(), 1000, 0), Codes.BadConditionAlreadyShelved),
        (ONCE.one_shot_shelve(act(), 0), Codes.BadConditionAlreadyShelved),
        (NORMAL.unshelve(act(), 0), Codes.BadConditionNotShelved),
    ],
)
def test_what_cannot_be_done_changes_nothing_and_says_why(step: Step, code: int) -> None:
    assert (step.code, step.tells) == (code, False)
    assert step.state in (NORMAL, raised(), ACKED, DISABLED, TIMED, ONCE)


def test_another_reason_is_acknowledged_anew() -> None:
    again = ACKED.raised(900, 3000, anew=True)
    assert (again.state.acked, again.state.event_ids, again.state.active_ms) == (False, (), 1000)
    assert (again.state.severity, again.state.last_severity) == (900, 800)
    assert again.state.acknowledge(act(1), 4000).code == Codes.BadEventIdUnknown


def test_the_same_reason_with_another_severity_stays_acknowledged() -> None:
    worse = ACKED.raised(1000, 3000, anew=False)
    assert (worse.tells, worse.state.acked, worse.state.last_severity) == (True, True, 800)
    assert worse.state.raised(1000, 4000, anew=False) == Step(worse.state)


def test_shelving_ends_with_its_time() -> None:
    assert TIMED.on_time(61_999) == Step(TIMED)
    assert TIMED.on_time(62_000).state.shelving is Shelving.UNSHELVED
    assert ONCE.on_time(2000 + MAX_TIME_SHELVED_MS).tells


def test_what_is_shelved_for_once_is_back_with_the_next_alarm() -> None:
    assert ONCE.cleared(3000).state.shelving is Shelving.UNSHELVED
    assert TIMED.cleared(3000).state.shelving is Shelving.TIMED
    assert TIMED.one_shot_shelve(act(), 3000).state.shelving is Shelving.ONE_SHOT


def test_a_comment_without_text_and_locale_leaves_the_present_one() -> None:
    commented = raised().add_comment(act(comment=GERMAN), 2000).state
    assert commented.add_comment(act(), 3000).state.comment.text == GERMAN.text
    assert commented.add_comment(act(comment=Comment("", "de")), 3000).state.comment.text == ""


def test_a_disabled_condition_goes_on_watching_and_says_nothing() -> None:
    gone = DISABLED.cleared(3000)
    assert (gone.tells, gone.state.retain) == (False, False)
    assert gone.state.raised(700, 4000, anew=True).tells is False
    assert DISABLED.enable(act(), 5000).state.retain


def test_so_many_notifications_of_an_occurrence_are_known() -> None:
    state = raised()
    for number in range(2, 30):
        state = state.told(event(number))
    assert len(state.event_ids) == MOST_EVENT_IDS
    assert state.acknowledge(act(29), 0).code == Codes.Good


Move = Callable[[ConditionState, float], Step]
ACTS = st.builds(act, st.integers(1, 12), st.sampled_from([Comment(), GERMAN, Comment("", "en")]))
MOVES: st.SearchStrategy[Move] = st.one_of(
    st.builds(
        lambda severity, anew: lambda state, now: state.raised(severity, now, anew=anew),
        st.integers(1, 1000),
        st.booleans(),
    ),
    st.just(lambda state, now: state.cleared(now)),
    st.just(lambda state, now: state.on_time(now)),
    st.builds(
        lambda name, given_: lambda state, now: getattr(state, name)(given_, now),
        st.sampled_from(
            ["enable", "disable", "add_comment", "acknowledge", "confirm", "one_shot_shelve", "unshelve"]
        ),
        ACTS,
    ),
    st.builds(
        lambda given_, ms: lambda state, now: state.timed_shelve(given_, ms, now),
        ACTS,
        st.floats(-1, 2 * MAX_TIME_SHELVED_MS),
    ),
)


@given(st.lists(st.tuples(MOVES, st.floats(0, 3_600_000)), max_size=40))
def test_no_sequence_of_calls_leads_to_a_state_that_part_9_forbids(moves: list[tuple[Move, float]]) -> None:
    state, now = NORMAL, 0.0
    for number, (move, pause) in enumerate(moves):
        now += pause
        before, (state, code, tells) = state, move(state, now)
        if code:
            # A refused call neither changes anything nor tells of it.
            assert (state, tells) == (before, False)
        # Told is what has changed, and of a disabled condition that it was disabled and nothing more.
        assert tells <= (state != before or not code)
        assert not tells or before.enabled or state.enabled
        # What is to be confirmed was acknowledged.
        assert state.acked or state.confirmed
        assert state.retain == (state.enabled and (state.active or not state.acked or not state.confirmed))
        # A shelved one has an end, which MaxTimeShelved bounds; one that is not has none.
        assert state.shelved == (state.unshelve_at_ms > 0)
        assert state.unshelve_at_ms <= now + MAX_TIME_SHELVED_MS
        assert len(state.event_ids) <= MOST_EVENT_IDS
        if tells:
            state = state.told(event(number % 12 + 1))
