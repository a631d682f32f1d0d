"""The judge's two tables: everything that can happen keeps the rules, and every cell decides something."""

from __future__ import annotations

import itertools
import re
from collections.abc import Callable, Iterator
from inspect import getsource
from typing import Any, Final
from unittest.mock import patch

import pytest

from bridge.command.stop_check import step as judge
from bridge.command.stop_check.state import LastStop, StopPlace
from bridge.command.stop_check.table import OUTCOME_TABLE, PLACE_TABLE, Evidence, News, PlaceDeed
from tests.support import stop_rules
from tests.support.nightly import by_night_of
from tests.support.stop_profiles import ON_CHANGE, PROFILES
from tests.support.stop_space import RecordedTable, StopSpace
from tests.unit.command.stop_check import test_jogging, test_step

# All of a CPU for up to half a minute each; behind the other lanes of `make test` they get a part of one.
pytestmark = pytest.mark.timeout(900)

MOST: Final = 150_000
_FEW: Final = ("asked when it is due", "nodes that leave, on change")
"""The smallest ones."""
_BIG: Final = (
    *("words and reports", "silence and pauses", "nodes that leave", "nodes that leave on a ramp"),
    "words and reports, on change",
)
"""Each takes ten seconds and more."""
_PLACES, _OUTCOMES = "PLACE_TABLE", "OUTCOME_TABLE"
_EVERY: Final = {**PROFILES, **ON_CHANGE}


def space(name: str) -> StopSpace:
    return StopSpace(PROFILES[name]) if name in PROFILES else StopSpace(ON_CHANGE[name], pause=None)


@pytest.mark.landing
@pytest.mark.parametrize("name", by_night_of(sorted(_EVERY, key=_BIG.__contains__), len(_EVERY) - len(_BIG)))
def test_whatever_happens_keeps_the_rules(name: str) -> None:
    explored = space(name)
    explored.explore(MOST)
    assert explored.states > 2000


def test_the_rules_take_nothing_from_the_bridge() -> None:
    assert "bridge" not in re.findall(r"^(?:from|import) (\w+)", getsource(stop_rules), re.MULTILINE)


def test_every_cell_that_does_something_is_reached_and_nothing_is_found() -> None:
    places, outcomes = RecordedTable(judge.PLACE_TABLE), RecordedTable(judge.OUTCOME_TABLE)
    with patch.object(judge, _PLACES, places), patch.object(judge, _OUTCOMES, outcomes):
        assert not _is_found()
    assert {
        cell for cell in PLACE_TABLE if PLACE_TABLE[cell] != (cell[0], PlaceDeed.NOTHING)
    } <= places.reached
    assert {cell for cell in OUTCOME_TABLE if OUTCOME_TABLE[cell] != (cell[0], ())} <= outcomes.reached


def _wrong_places() -> Iterator[Any]:
    for (place, news), (after, deed) in PLACE_TABLE.items():
        if deed is not PlaceDeed.NOTHING:
            yield pytest.param(
                _PLACES, (place, news), (after, PlaceDeed.NOTHING), id=f"{place}, {news}: deed"
            )
        if after is not place:
            yield pytest.param(_PLACES, (place, news), (place, deed), id=f"{place}, {news}: place")


def _wrong_outcomes() -> Iterator[Any]:
    for (outcome, finding), (after, deeds) in OUTCOME_TABLE.items():
        cell, label = (outcome, finding), f"{outcome.label}, {finding}"
        for left_out in range(len(deeds)):
            others = deeds[:left_out] + deeds[left_out + 1 :]
            yield pytest.param(_OUTCOMES, cell, (after, others), id=f"{label}: {deeds[left_out]}")
        if after is not outcome:
            yield pytest.param(_OUTCOMES, cell, (outcome, deeds), id=f"{label}: outcome")


@pytest.mark.landing(10)
@pytest.mark.parametrize(("table", "cell", "wrong"), [*_wrong_places(), *_wrong_outcomes()])
def test_a_fault_in_any_cell_is_found(table: str, cell: object, wrong: object) -> None:
    with patch.dict(getattr(judge, table), {cell: wrong}):
        assert _is_found(), "no example and no rule is broken"


def _is_found() -> bool:
    try:
        for example in _examples():
            example()
        for name in _FEW:
            space(name).explore(MOST)
    except (AssertionError, ValueError):
        return True
    return False


def _examples() -> Iterator[Callable[[], None]]:
    """The tests of the judge that are examples, with each of their parameters."""
    for module in (test_step, test_jogging):
        for name, test in vars(module).items():
            if name.startswith("test_") and not hasattr(test, "hypothesis"):
                yield from _with_parameters(test)


def _with_parameters(test: Any) -> Iterator[Callable[[], None]]:
    marks = [mark for mark in getattr(test, "pytestmark", ()) if mark.name == "parametrize"]
    axes = [[_given(mark, row) for row in mark.args[1]] for mark in marks]
    for parts in itertools.product(*axes):
        given = {name: value for part in parts for name, value in part.items()}
        yield lambda given=given: test(**given)


def _given(mark: Any, row: Any) -> dict[str, Any]:
    names = mark.args[0]
    return {names: row} if isinstance(names, str) else dict(zip(names, row, strict=True))


def test_every_place_and_every_outcome_has_each_event() -> None:
    assert PLACE_TABLE.keys() == {(place, news) for place in StopPlace for news in News}
    assert OUTCOME_TABLE.keys() == {(outcome, finding) for outcome in LastStop for finding in Evidence}


def test_a_drive_that_is_not_told_to_stop_is_not_judged() -> None:
    assert {cell for (outcome, _), cell in OUTCOME_TABLE.items() if outcome is LastStop.NONE} == {
        (LastStop.NONE, ())
    }
