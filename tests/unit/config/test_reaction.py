"""Rows of the reactions to a silent controller."""

from __future__ import annotations

from typing import get_args

import pytest

from bridge.config import REACTIONS, DriveTable, Reaction, ReactionRule, StopKind


def test_every_value_of_on_expiry_has_its_row() -> None:
    assert tuple(REACTIONS) == get_args(Reaction)
    assert get_args(DriveTable.model_fields["on_expiry"].annotation) == get_args(Reaction)


@pytest.mark.parametrize("rule", REACTIONS.values())
def test_a_ramp_ends_in_a_stronger_stop(rule: ReactionRule) -> None:
    strength = list(StopKind)
    assert strength == [StopKind.STOP, StopKind.QUICK_STOP, StopKind.DISABLE_VOLTAGE]
    assert rule.ramp is None or strength.index(rule.ramp) < strength.index(rule.stop)
    assert rule.first is (rule.ramp or rule.stop)


@pytest.mark.parametrize("rule", REACTIONS.values())
def test_a_reaction_stops_is_silent_or_holds(rule: ReactionRule) -> None:
    assert [rule.sends_stop, rule.is_silent, rule.holds].count(True) == 1
    assert rule.sends_stop or rule.ramp is None


def test_the_reactions_stop_as_the_reference_says() -> None:
    """dead-man-chain.md, "Reactions"."""
    stops = {name: (rule.first, rule.stop) for name, rule in REACTIONS.items() if rule.sends_stop}
    assert stops == {
        "disable_voltage": ("disable voltage", "disable voltage"),
        "quick_stop": ("quick stop", "disable voltage"),
        "stop": ("stop", "stop"),
    }
    assert [name for name, rule in REACTIONS.items() if rule.is_silent] == ["silence"]
    assert [name for name, rule in REACTIONS.items() if rule.holds] == ["hold"]
