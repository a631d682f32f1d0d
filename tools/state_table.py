#!/usr/bin/env python3
"""Draw the watchdog's state table from the code into docs/explanation/dead-man-chain.md.

    .venv/bin/python -m tools.state_table

What stands between the two marks is replaced; a test fails where it is not up to date.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final

from bridge.command.watchdog import TABLE, Effect, Stimulus, WatchdogState

PAGE: Final = Path(__file__).resolve().parents[1] / "docs" / "explanation" / "dead-man-chain.md"
BEGIN: Final = "<!-- drawn by tools/state_table.py: begin -->"
END: Final = "<!-- drawn by tools/state_table.py: end -->"


def table() -> str:
    """One row for each event, one column for each state; → names the next state where it is another."""
    states = [state.label for state in WatchdogState]
    rows = [["event", *states], ["---"] * (len(states) + 1)]
    rows += [[stimulus.value, *(_cell(state, stimulus) for state in WatchdogState)] for stimulus in Stimulus]
    return "\n".join(f"| {' | '.join(row)} |" for row in rows).replace(" --- ", "---")


def _cell(state: WatchdogState, stimulus: Stimulus) -> str:
    after, effect = TABLE[state, stimulus]
    what = "–" if effect is Effect.NOTHING else effect.value
    return what if after is state else f"→ **{after.label}**: {what}"


def drawn(text: str) -> str:
    """``text`` of a page with the table as it is now. Raises ValueError where the page has no marks."""
    before, begin, rest = text.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not begin or not end:
        raise ValueError(f"the page has no line {BEGIN!r} with {END!r} after it")
    return f"{before}{BEGIN}\n\n{table()}\n\n{END}{after}"


if __name__ == "__main__":
    PAGE.write_text(drawn(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
    print(f"{PAGE.name}: {len(Stimulus)} events, {len(WatchdogState)} states")
