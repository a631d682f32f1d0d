"""What time brings: the end of a time-out, a lease, a ramp, a burst."""

from __future__ import annotations

from typing import get_args

import pytest

from bridge.command import Action
from bridge.command.leg.due import expiry, judge
from bridge.command.leg.effect import Tell, Tripped
from bridge.command.leg.state import Owner, Stage
from bridge.command.leg.table import TABLE
from bridge.config import REACTIONS, Reaction
from bridge.text import render
from tests.support.leg import PLC, draft_of, running_nord


@pytest.mark.parametrize("reaction", get_args(Reaction))
def test_a_trip_goes_to_the_stage_of_its_reaction(reaction: Reaction) -> None:
    rule = REACTIONS[reaction]
    leg = running_nord(on_expiry=reaction)
    leg.trips()
    stage = leg.state.stage
    assert TABLE[Stage.ENABLED, expiry(rule)][0] is stage
    assert (stage is Stage.SILENCED, stage is Stage.HELD) == (rule.is_silent, rule.holds)
    assert (stage is Stage.RAMPING) is (rule.ramp is not None) is (leg.state.trip.ramps_until is not None)


@pytest.mark.parametrize(("at", "trips"), [(100.199, False), (100.2, True)])
def test_a_watchdog_trips_at_its_deadline_and_says_when_it_was_due(at: float, trips: bool) -> None:
    draft = draft_of(running_nord(), at)
    judge(draft)
    assert draft.is_tripped is trips
    found = [effect for effect in draft.effects if isinstance(effect, Tripped)]
    assert found == ([Tripped(100.2, PLC, 200)] if trips else [])
    assert draft.timer.is_overdue is trips


def test_a_lease_that_has_run_out_is_told_and_left() -> None:
    draft = draft_of(running_nord(), 100.1)
    draft.owner = Owner(PLC, lease_until=100.1)
    judge(draft)
    assert draft.owner.identity is None
    assert [render(one.said) for one in draft.effects if isinstance(one, Tell)] == [
        f"the lease of {PLC} ran out"
    ]


def test_a_ramp_ends_after_ten_seconds_and_a_burst_after_a_tenth_of_one() -> None:
    leg = running_nord(on_expiry="quick_stop", then_silence_ms=2000)
    leg.trips()
    assert leg.state.stage is Stage.RAMPING
    leg.waits(2.0)
    assert leg.state.stage is Stage.SILENCED
    leg.asks(Action.STOP)
    assert leg.state.stage is Stage.BURST
    leg.waits(0.1)
    assert leg.state.stage is Stage.SILENCED
    assert leg.state.trip.ramps_until is not None
    leg.waits(7.9)
    assert leg.state.trip.ramps_until is None
