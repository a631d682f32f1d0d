#!/usr/bin/env python3
"""Draw the table of conformance units into docs/reference/opcua-conformance.md.

    .venv/bin/python -m tools.conformance_page

What stands between the marks is replaced; a test fails where it is not up to date.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final

from bridge.uaserver.conformance import PROFILES, ConformanceUnit, Profile, claimed, units_of
from tools.marks import replaced

PAGE: Final = Path(__file__).resolve().parents[1] / "docs" / "reference" / "opcua-conformance.md"
BEGIN: Final = "<!-- drawn by tools/conformance_page.py: begin -->"
END: Final = "<!-- drawn by tools/conformance_page.py: end -->"


def tables() -> str:
    """Which profiles are held; then the units of each."""
    summary = [
        "| profile | table | units held | claimed |",
        "|---|---|---|---|",
        *map(_row, PROFILES.values()),
    ]
    return "\n\n".join(("\n".join(summary), *map(_section, PROFILES.values())))


def _row(profile: Profile) -> str:
    # What is part of two of its parts counts once.
    needed = {unit.name: unit.test for unit in units_of(profile) if not unit.is_optional}
    held = sum(map(bool, needed.values()))
    is_claimed = "yes" if profile.uri in claimed() else "no"
    return f"| {profile.name} | {profile.table} | {held} of {len(needed)} | {is_claimed} |"


def _section(profile: Profile) -> str:
    parts = [f"### {profile.name}"]
    if profile.includes:
        parts.append(f"Includes: {'; '.join(profile.includes)}.")
    head = ["| conformance unit | test |", "|---|---|"]
    return "\n\n".join((*parts, "\n".join((*head, *map(_unit, profile.units)))))


def _unit(unit: ConformanceUnit) -> str:
    name = f"{unit.name} (optional)" if unit.is_optional else unit.name
    return f"| {name} | {f'`{unit.test}`' if unit.test else 'not served'} |"


def drawn(text: str) -> str:
    """The ``text`` of the page with the tables as they are in the code."""
    return replaced(text, BEGIN, END, tables())


if __name__ == "__main__":
    PAGE.write_text(drawn(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
