"""Figures of runs: what was counted is what was there."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

from bridge.command.leg import deeds
from bridge.command.leg.state import Stage
from bridge.command.leg.table import TABLE, Stimulus
from tests.plant.figures import Figures, counted, pairs_of, read, report, summary, write
from tests.plant.plan import KINDS, Plan, Step

LONG = Step(10.0, "noise", 0, 5.0)
STEPS = (LONG, Step(11.0, "stop"), Step(11.6, "clock stepped", 0, 3600.0), Step(12.2, "noise", 0, 0.1))


def figures(**cases: int) -> Figures:
    return Figures(1, 3600.0, 120.0, 7, 8, Counter(cases), Counter({"bus off + kill": 1}), Counter())


def test_kinds_at_work_at_one_time_are_pairs() -> None:
    pairs = pairs_of(Plan(1, 20.0, STEPS), 20.0)
    assert pairs == {"noise + stop": 1, "clock stepped + noise": 1, "noise + noise": 1}


def test_what_was_not_played_is_no_pair() -> None:
    assert pairs_of(Plan(1, 20.0, STEPS), 11.3) == {"noise + stop": 1}


def test_looks_at_a_table_are_counted_while_they_are_wanted() -> None:
    cells: Counter[str] = Counter()
    with counted(cells):
        assert deeds.TABLE[Stage.READY, Stimulus.STOP] == TABLE[Stage.READY, Stimulus.STOP]
    assert deeds.TABLE is TABLE
    assert cells == {"controller leg: READY, stop by a command": 1}


def test_figures_are_the_same_when_they_are_read_again(tmp_path: Path) -> None:
    write(tmp_path / "build" / "plant.json", figures(kill=3))
    together = read(tmp_path / "build" / "plant.json")
    assert together == figures(kill=3)
    together.add(figures(kill=1, noise=2))
    assert together.cases == {"kill": 4, "noise": 2}
    assert "2 plants, 2.00 h in 240 s (30 times real time)" in summary(together)


def test_the_page_names_what_was_never_there() -> None:
    page = report(figures(kill=3))
    assert "| kill | 3 |" in page
    assert "- never: controller leg: READY, stop by a command" in page
    assert "bus off + bus off;" in page
    assert "bus off + kill;" not in page
    assert all(f"| {kind} |" in page for kind in KINDS)
