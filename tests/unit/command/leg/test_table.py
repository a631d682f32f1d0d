"""What holds for every cell of the leg's table, and so for every sequence."""

from __future__ import annotations

from bridge.command.leg.state import ANY_TRIP, MEANING, NORMAL, REACTING, STARTING, Stage
from bridge.command.leg.table import TABLE, Deed, Stimulus

MAY_ENABLE = frozenset((Stage.ENABLED, Stage.BLIND, Stage.LEADING, Stage.HELD))
"""Stages in which an enabling word may be on the bus."""
ORDERS = frozenset(
    (
        Stimulus.ENABLING_WORD,
        Stimulus.START,
        Stimulus.START_ENABLED,
        Stimulus.START_STOPPING,
        Stimulus.START_UNHEARD,
        Stimulus.START_BRAKING,
    )
)
ACKNOWLEDGES = frozenset((Stimulus.ACKNOWLEDGE, Stimulus.ACKNOWLEDGE_FAULT))
STOPS = frozenset((Stimulus.STOP, Stimulus.LATE_STOP, Stimulus.LEFT, Stimulus.ANEW))

_STOPS_BY = {Stimulus.STOP: Deed.STOP_AS_ASKED, Stimulus.LATE_STOP: Deed.FORWARD}
"""The others are stops by the bridge."""


def test_every_stage_has_each_event_and_a_meaning() -> None:
    assert TABLE.keys() == {(stage, stimulus) for stage in Stage for stimulus in Stimulus}
    assert MEANING.keys() == set(Stage) == {*NORMAL, *STARTING, *ANY_TRIP}


def test_only_an_order_leads_to_where_a_drive_is_enabled() -> None:
    for (stage, stimulus), (after, _) in TABLE.items():
        if after in MAY_ENABLE and stage not in MAY_ENABLE | STARTING:
            assert stimulus in ORDERS | {Stimulus.EXPIRED_HOLD}, (stage, stimulus)
            assert stimulus is Stimulus.EXPIRED_HOLD or stage in (Stage.INTERLOCKED, Stage.READY)


def test_an_enabling_word_passes_no_interlock_no_closed_way_and_no_trip() -> None:
    for stage in (Stage.CLOSED, Stage.INTERLOCKED, *ANY_TRIP):
        assert TABLE[stage, Stimulus.ENABLING_WORD] == (stage, Deed.TAKE)


def test_nothing_but_an_acknowledge_ends_a_trip() -> None:
    for (stage, stimulus), (after, _) in TABLE.items():
        if stage in ANY_TRIP and after not in ANY_TRIP:
            assert stimulus in ACKNOWLEDGES
            assert after is Stage.INTERLOCKED


def test_nothing_but_the_timer_trips() -> None:
    for (stage, stimulus), (after, deed) in TABLE.items():
        if after in ANY_TRIP and stage not in ANY_TRIP:
            assert stimulus.name.startswith("EXPIRED")
            assert deed is (Deed.HOLD if after is Stage.HELD else Deed.REACT)


def test_a_stop_counts_in_every_stage() -> None:
    for stage in Stage:
        for stimulus in STOPS:
            after, deed = TABLE[stage, stimulus]
            kind = _STOPS_BY.get(stimulus, Deed.STOP)
            is_late = stimulus is Stimulus.LATE_STOP and stage in REACTING
            assert deed is (Deed.TAKE if is_late else kind), "the reaction stops the drive already"
            assert after not in MAY_ENABLE | STARTING, "and needs a fresh order after it"


def test_a_closed_way_lets_nothing_through_but_an_order_to_hold() -> None:
    for stage in Stage:
        after, _ = TABLE[stage, Stimulus.WAY_CLOSED]
        assert after in {Stage.CLOSED, *ANY_TRIP} - {Stage.HELD}


def test_what_is_not_valid_changes_nothing() -> None:
    for stage in Stage:
        assert TABLE[stage, Stimulus.INVALID] == (stage, Deed.REFUSE)


def test_a_start_ends_enabled_stopped_or_overtaken() -> None:
    """Each of its stages has a way out that time alone opens."""
    for stage in STARTING:
        assert TABLE[stage, Stimulus.START_OVERDUE] == (Stage.INTERLOCKED, Deed.GIVE_UP)
        assert TABLE[stage, Stimulus.SAYS_ENABLED] == (Stage.ENABLED, Deed.DONE)
        assert TABLE[stage, Stimulus.SAYS_FAULT] == (Stage.INTERLOCKED, Deed.GIVE_UP)
