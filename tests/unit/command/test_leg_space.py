"""The leg under every sequence of events, against rules written from the shared design (watchdog)."""

from __future__ import annotations

import re
from inspect import getsource
from typing import Any, Final

import pytest

from bridge.command.leg.table import TABLE
from tests.support import leg_oracle, leg_rules, leg_seen
from tests.support.leg_cells import NEVER
from tests.support.leg_profiles import MOST, ROWS, explored, space
from tests.support.leg_recorded import Cells
from tests.support.leg_words import LENZE, POSITION
from tests.support.nightly import by_night_of
from tools import exploration

# All of a CPU for up to half a minute each: with a fifth of one that takes its time.
# Behind the other lanes of `make test` it gets what these leave of the CPUs.
pytestmark = pytest.mark.timeout(1500)

_NORD = [row for row in ROWS if row.startswith("nord/sk-tu4-cao")]


def is_as_printed(row: str) -> Cells:
    found = explored(row)
    shown = exploration.shown()[row]
    expected = exploration.figures(found)
    assert {name: shown[name] for name in expected} == expected, "print it anew: python -m tools.exploration"
    return found.cells


@pytest.mark.nightly
@pytest.mark.parametrize("row", [row for row in ROWS if row not in _NORD])
def test_whatever_happens_in_the_words_of_every_family(row: str) -> None:
    assert not is_as_printed(row) & NEVER.keys()


@pytest.mark.nightly
def test_whatever_happens_and_every_cell_that_can() -> None:
    """In NORD's words with all settings. A cell that cannot occur is named with the reason."""
    reached = {cell for row in _NORD for cell in is_as_printed(row)}
    assert reached == TABLE.keys() - NEVER.keys()


_EVERY_CELL: Final = {
    "nord/sk-tu4-cao": ("quick_stop", "silence", "hold", "started"),
    "nord/sk-tu4-cao, other settings": (
        *("started, quick_stop", "started, stop", "started, silence", "started, hold"),
        *("quick_stop, then silence", "errors ignored, started", "life sign, started"),
        *("two connections, started", "lease", "started, then silent", "words that do not reach the bus"),
    ),
}
"""A quarter of what happens at night, with every cell."""


@pytest.mark.landing
def test_every_cell_that_can_where_a_change_lands() -> None:
    reached = {cell for row, profiles in _EVERY_CELL.items() for cell in explored(row, profiles).cells}
    assert not reached & NEVER.keys()
    assert not TABLE.keys() - NEVER.keys() - reached, "name a profile that reaches them: _EVERY_CELL"


@pytest.mark.landing(3)
@pytest.mark.parametrize("row", [row for row in ROWS if row not in _NORD])
def test_one_reaction_in_the_words_of_every_family(row: str) -> None:
    assert not explored(row, ("quick_stop",)).cells & NEVER.keys()


def test_every_row_is_printed() -> None:
    assert list(exploration.shown()) == [*ROWS]


def test_the_rules_take_nothing_from_the_bridge() -> None:
    for module in (leg_seen, leg_rules, leg_oracle):
        assert "bridge" not in re.findall(r"^(?:from|import) (\w+)", getsource(module), re.MULTILINE)


_FORGETFUL: Final[dict[str, dict[str, Any]]] = {
    "edges": {
        "names": {
            "owner writes a stop",
            "owner enables",
            "owner acknowledges by an edge",
            "owner resets the fault",
            "stranger stops the drive",
            "drive follows",
            "everything is due",
        },
        "on_expiry": "quick_stop",
    },
    "a stop that holds": {
        "names": {
            "owner writes a stop",
            "owner enables",
            "owner resets the fault",
            "stranger stops the drive",
            "drive follows",
            "drive says: fault",
            "node lost",
            "node operational, not heard",
            "everything is due",
        },
        "words": LENZE,
        "on_expiry": "stop",
    },
    "starts and positions": {
        "names": {
            "owner writes a stop",
            "owner enables",
            "owner starts the drive",
            "owner releases",
            "drive follows",
            "drive repeats",
            "drive takes the setpoint",
            "node lost",
            "node operational",
        },
        "words": POSITION,
        "on_expiry": "hold",
    },
}


@pytest.mark.landing
@pytest.mark.parametrize("profile", by_night_of(_FORGETFUL, 1))
def test_what_the_walk_forgets_decides_nothing(profile: str) -> None:
    explored_all = space(**_FORGETFUL[profile])
    forgets, explored_all.forgets = explored_all.forgets, lambda leg, seen: (leg, seen)
    explored_all.explore(MOST)
    compared = 0
    for state in explored_all.states:
        less = forgets(*state)
        if less == state:
            continue
        compared += 1
        for name, happen in explored_all.events.items():
            assert forgets(*happen(state)) == forgets(*happen(less)), name
    assert compared > 100
