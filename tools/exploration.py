#!/usr/bin/env python3
"""Explore the controller leg and print the figures into docs/reference/decision-tables.md.

    .venv/bin/python -m tools.exploration

What stands between the two marks is replaced; a test of ``make nightly`` fails where the numbers, but for the
seconds, are not up to date.
"""

from __future__ import annotations

from typing import Final

from bridge.command.leg.table import TABLE
from tests.support.leg_profiles import ROWS, Figures, explored
from tools.marks import replaced
from tools.state_table import PAGE

BEGIN: Final = "<!-- printed by tools/exploration.py: begin -->"
END: Final = "<!-- printed by tools/exploration.py: end -->"
_COLUMNS: Final = ("profiles", "states", "steps", "cells")


def figures(found: Figures) -> dict[str, str]:
    numbers = (found.profiles, found.states, found.steps, len(found.cells))
    return {name: f"{number:,}" for name, number in zip(_COLUMNS, numbers, strict=True)}


def shown() -> dict[str, dict[str, str]]:
    """The figures on the page, by the row."""
    table = PAGE.read_text(encoding="utf-8").partition(BEGIN)[2].partition(END)[0]
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in table.splitlines() if line]
    head, _, *body = [row for row in rows if len(row) > 1]
    return {name: dict(zip(head[1:], row, strict=True)) for name, *row in body if name != "together"}


def table(found: dict[str, Figures]) -> str:
    every = Figures()
    for one in found.values():
        every.profiles += one.profiles
        every.states += one.states
        every.steps += one.steps
        every.seconds += one.seconds
        every.cells |= one.cells
    lines = [f"| family | {' | '.join(_COLUMNS)} | seconds |", "|---" * (len(_COLUMNS) + 2) + "|"]
    lines += [
        f"| {row} | {' | '.join(figures(one).values())} | {one.seconds:.0f} |"
        for row, one in {**found, "together": every}.items()
    ]
    return "\n".join(lines)


def main() -> None:
    found: dict[str, Figures] = {}
    for row in ROWS:
        found[row] = explored(row)
        cells = len(found[row].cells)
        print(f"{row}: {found[row].steps:,} steps, {cells} of {len(TABLE)} cells, {found[row].seconds:.1f} s")
    page = replaced(PAGE.read_text(encoding="utf-8"), BEGIN, END, table(found))
    PAGE.write_text(page, encoding="utf-8")


if __name__ == "__main__":
    main()
