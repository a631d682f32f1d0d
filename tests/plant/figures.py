"""Figures of many runs: hours of plants, cases of each kind of fault, pairs of them at one time, and which
cells of the bridge's tables were gone through.

    python -m tests.plant.figures FILE ...

Prints the figures of these files, which ``python -m tests.plant --out`` has written, together.
"""

from __future__ import annotations

import json
import sys
from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, fields
from itertools import combinations_with_replacement
from pathlib import Path
from typing import Any, Final

from bridge.command.leg import deeds
from bridge.command.leg.table import TABLE, Deed
from bridge.command.stop_check import step
from bridge.command.stop_check.table import OUTCOME_TABLE, PLACE_TABLE, PlaceDeed
from tests.plant.plan import KINDS, Plan, Step, length_s
from tests.plant.plant import Result

_SHORT_S: Final = 0.5
"""What a step without a length disturbs so long."""

Table = Mapping[tuple[Any, Any], tuple[Any, Any]]
_TABLES: Final[dict[str, tuple[object, str, Table]]] = {
    "controller leg": (deeds, "TABLE", TABLE),
    "judge, place of a stop": (step, "PLACE_TABLE", PLACE_TABLE),
    "judge, its outcome": (step, "OUTCOME_TABLE", OUTCOME_TABLE),
}
"""The tables, and where the bridge looks them up."""
_IDLE: Final = (Deed.NOTHING, PlaceDeed.NOTHING, ())


@dataclass(slots=True)
class Figures:
    """``cells`` counts looks at a table's cells by ``table: row, column``; ``pairs`` plants' moments at which
    two kinds were at work together, by ``kind + kind``."""

    runs: int = 0
    played_s: float = 0.0
    spent_s: float = 0.0
    frames: int = 0
    looks: int = 0
    cases: Counter[str] = field(default_factory=Counter[str])
    pairs: Counter[str] = field(default_factory=Counter[str])
    cells: Counter[str] = field(default_factory=Counter[str])

    def add(self, other: Figures) -> None:
        self.runs += other.runs
        self.played_s += other.played_s
        self.spent_s += other.spent_s
        self.frames += other.frames
        self.looks += other.looks
        self.cases.update(other.cases)
        self.pairs.update(other.pairs)
        self.cells.update(other.cells)


def figures_of(result: Result, spent_s: float) -> Figures:
    """Those of one run, without its cells."""
    pairs = pairs_of(result.plan, result.played_s)
    return Figures(1, result.played_s, spent_s, result.frames, result.looks, result.counts, pairs)


class _Counted(dict[tuple[Any, Any], tuple[Any, Any]]):
    """A table that counts which of its cells are looked up."""

    def __init__(self, table: Table) -> None:
        super().__init__(table)
        self.looks: Counter[tuple[Any, Any]] = Counter()

    def __getitem__(self, key: tuple[Any, Any]) -> tuple[Any, Any]:
        self.looks[key] += 1
        return super().__getitem__(key)


@contextmanager
def counted(cells: Counter[str]) -> Iterator[None]:
    """Within it every look of the bridge at one of its tables is counted."""
    tables = {name: _Counted(table) for name, (_, _, table) in _TABLES.items()}
    for name, (module, attribute, _) in _TABLES.items():
        setattr(module, attribute, tables[name])
    try:
        yield
    finally:
        for name, (module, attribute, table) in _TABLES.items():
            setattr(module, attribute, table)
            for key, number in tables[name].looks.items():
                cells[_name(name, key)] += number


def _name(table: str, key: tuple[Any, Any]) -> str:
    return f"{table}: {key[0].name}, {key[1]}"


def pairs_of(plan: Plan, until: float) -> Counter[str]:
    """Kinds of steps that were at work at one time, before ``until``."""
    pairs: Counter[str] = Counter()
    under_way: list[Step] = []
    for new in plan.steps:
        if new.at >= until:
            break
        under_way = [one for one in under_way if one.at + _length_s(one) > new.at]
        pairs.update(_pair(one.what, new.what) for one in under_way)
        under_way.append(new)
    return pairs


def _pair(one: str, other: str) -> str:
    return " + ".join(sorted((one, other)))


_PAIRS: Final = [_pair(*pair) for pair in combinations_with_replacement(KINDS, 2)]


def _length_s(step: Step) -> float:
    return max(length_s(step), _SHORT_S)


def summary(figures: Figures) -> str:
    """The most of it in a line."""
    gone, acts = 0, 0
    for name, (_, _, table) in _TABLES.items():
        cells = _acting(name, table)
        gone, acts = gone + sum(cell in figures.cells for cell in cells), acts + len(cells)
    pairs = sum(1 for pair in _PAIRS if figures.pairs[pair])
    return (
        f"{figures.runs} plants, {figures.played_s / 3600:.2f} h in {figures.spent_s:.0f} s "
        f"({figures.played_s / max(figures.spent_s, 0.01):.0f} times real time), {figures.frames} frames, "
        f"{figures.looks} judgements, {figures.cases.total()} cases of {len(figures.cases)} faults, "
        f"{pairs} of {len(_PAIRS)} pairs of them at one time, {gone} of {acts} cells of the tables"
    )


def report(figures: Figures) -> str:
    """All of it as a page."""
    missing = [pair for pair in _PAIRS if not figures.pairs[pair]]
    lines = [
        "# Plants in seeds",
        "",
        f"{summary(figures)}.",
        "",
        "| fault | cases |",
        "|---|--:|",
        *(f"| {kind} | {figures.cases[kind]} |" for kind in KINDS),
        "",
        f"Rarest at one time: {_rarest(figures.pairs)}.",
        *(["", f"Never: {'; '.join(missing)}."] if missing else []),
        "",
        "| table | cells that do something | gone through | cells that change nothing | gone through |",
        "|---|--:|--:|--:|--:|",
    ]
    never: list[str] = []
    for name, (_, _, table) in _TABLES.items():
        acts = _acting(name, table)
        idle = {_name(name, key) for key in table} - set(acts)
        gone = sum(cell in figures.cells for cell in acts), sum(cell in figures.cells for cell in idle)
        lines.append(f"| {name} | {len(acts)} | {gone[0]} | {len(idle)} | {gone[1]} |")
        never += [cell for cell in acts if cell not in figures.cells]
    return "\n".join([*lines, "", *(f"- never: {cell}" for cell in never)]) + "\n"


def _acting(name: str, table: Table) -> list[str]:
    """Cells that change something."""
    return [_name(name, key) for key, (after, deed) in table.items() if deed not in _IDLE or after != key[0]]


def _rarest(pairs: Counter[str]) -> str:
    return "; ".join(f"{pair} ({number})" for pair, number in pairs.most_common()[:-4:-1])


def write(path: Path, figures: Figures) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(
        json.dumps({one.name: getattr(figures, one.name) for one in fields(figures)}), encoding="utf-8"
    )


def read(path: Path) -> Figures:
    found: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    for name in ("cases", "pairs", "cells"):
        found[name] = Counter[str](found[name])
    return Figures(**found)


def main() -> int:
    together = Figures()
    for name in sys.argv[1:]:
        together.add(read(Path(name)))
    print(report(together), end="")
    return 0


if __name__ == "__main__":
    sys.exit(main())
