"""A fault in any cell of the leg's table breaks a rule of the exploration, but for those that are named."""

from __future__ import annotations

from functools import cache
from typing import Final

import pytest

from bridge.command.leg.state import Stage
from bridge.command.leg.table import TABLE, Cell
from tests.support.leg_profiles import space
from tests.support.leg_space import Space
from tests.support.leg_wrong_cells import PROFILES, UNNOTICED, Place, every_fault

# All of a CPU for a minute or two each.
pytestmark = [pytest.mark.nightly, pytest.mark.timeout(1500)]

_MOST: Final = 60_000
"""States; more than ``leg_profiles.MOST``, because nothing is forgotten."""


def _space(profile: str) -> Space:
    """What the exploration forgets decides nothing in the right leg; in a wrong one it may."""
    found = space(**PROFILES[profile])
    found.forgets = lambda leg, seen: (leg, seen)
    return found


@cache
def _walked() -> tuple[tuple[str, frozenset[Place]], ...]:
    """Profiles with the cells that each reaches, the shortest walk first."""
    walks = {profile: _space(profile).explore(_MOST) for profile in PROFILES}
    return tuple(
        (name, frozenset(walks[name].cells)) for name in sorted(walks, key=lambda it: walks[it].steps)
    )


def _is_found(place: Place, wrong: Cell) -> bool:
    for profile, cells in _walked():
        if place in cells:
            try:
                _space(profile).explore(_MOST, {**TABLE, place: wrong})
            except AssertionError as error:
                assert "\nafter " in str(error)
                return True
    return False


@pytest.mark.parametrize("stage", Stage)
def test_a_fault_in_any_cell_is_found(stage: Stage) -> None:
    faults = {fault: wrong for fault, wrong in every_fault().items() if fault[0][0] is stage}
    assert faults
    missed = {fault for fault, wrong in faults.items() if not _is_found(fault[0], wrong)}
    assert missed == {fault for fault in UNNOTICED if fault[0][0] is stage}
