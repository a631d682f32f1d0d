#!/usr/bin/env python3
"""Draw the tables of the controller leg and of the judge of stops into docs/reference/decision-tables.md.

    .venv/bin/python -m tools.state_table

What stands between the marks is replaced; a test fails where it is not up to date.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Final

from bridge.command.leg.due import expiry
from bridge.command.leg.state import ANY_TRIP, MEANING, NORMAL, STARTING, Motion, Stage
from bridge.command.leg.table import TABLE, Deed, Stimulus
from bridge.command.leg.word_table import WORD_TABLE
from bridge.command.stop_check import table as judge
from bridge.command.stop_check.state import PLACES, LastStop, StopPlace
from bridge.config import REACTIONS
from tools.marks import replaced

PAGE: Final = Path(__file__).resolve().parents[1] / "docs" / "reference" / "decision-tables.md"
BEGIN: Final = "<!-- drawn by tools/state_table.py: begin -->"
END: Final = "<!-- drawn by tools/state_table.py: end -->"
WORDS_BEGIN: Final = "<!-- words drawn by tools/state_table.py: begin -->"
WORDS_END: Final = "<!-- words drawn by tools/state_table.py: end -->"
JUDGE_BEGIN: Final = "<!-- judge drawn by tools/state_table.py: begin -->"
JUDGE_END: Final = "<!-- judge drawn by tools/state_table.py: end -->"
PARTS: Final = {
    "Neither tripped nor in a start": NORMAL,
    "While a start goes on": STARTING,
    "While tripped": ANY_TRIP,
}


def tables() -> str:
    """What the stages are; then a table for each group of them: one column for each stage, one row for each
    event that changes one of them or is answered."""
    parts = [_table([["stage", "what it is"], *([f"**{stage}**", MEANING[stage]] for stage in Stage)])]
    for heading, group in PARTS.items():
        stages = [stage for stage in Stage if stage in group]
        rows = [[_event(stimulus), *(_cell(stage, stimulus) for stage in stages)] for stimulus in Stimulus]
        happens = [row for row in rows if set(row[1:]) != {Deed.NOTHING.value}]
        parts += [f"### {heading}", _table([["event", *stages], *happens])]
    return "\n\n".join(parts)


def word_tables() -> str:
    """Words that are sent in each stage, by what the drive has reported of its motion; then the stop of each
    reaction. Stages and motions with the same words share a row and a column."""
    columns = _alike((motion.value, [_words(stage, motion) for stage in Stage]) for motion in Motion)
    shown = list(columns.values())
    rows = _alike((f"**{stage}**", [words[at] for words in shown]) for at, stage in enumerate(Stage))
    table = [["stage", *columns], *([stages, *words] for stages, words in rows.items())]
    stops = [[f"`{name}`", rule.first, rule.stop] for name, rule in REACTIONS.items() if not rule.holds]
    return "\n\n".join(
        (
            _table(table),
            _table([["reaction", "its stop", "once the ramp is over"], *stops]),
        )
    )


def _alike(lines: Iterable[tuple[str, list[str]]]) -> dict[str, list[str]]:
    """``lines``, those with the same cells under the names of all."""
    names: dict[tuple[str, ...], list[str]] = {}
    for name, cells in lines:
        names.setdefault(tuple(cells), []).append(name)
    return {"; ".join(alike): list(cells) for cells, alike in names.items()}


def _words(stage: Stage, motion: Motion) -> str:
    word, may_hold = WORD_TABLE[stage, motion]
    return word.value if may_hold else f"{word}, *not holding*"


def judge_tables() -> str:
    """The places of a stop; then what each event makes of the place, and each finding of the outcome."""
    places = _table([["place", "what it is"], *([f"**{place}**", PLACES[place]] for place in StopPlace)])
    news = [[news.value, *(_place(place, news) for place in StopPlace)] for news in judge.News]
    outcomes = [LastStop.FORWARDED, LastStop.FOLLOWED, LastStop.IGNORED]
    found = [[finding.value, *(_outcome(one, finding) for one in outcomes)] for finding in judge.Evidence]
    return "\n\n".join(
        (
            places,
            _table([["event", *StopPlace], *news]),
            _table([["what is found of a stop on the bus", *(one.label for one in outcomes)], *found]),
        )
    )


def _place(place: StopPlace, news: judge.News) -> str:
    after, deed = judge.PLACE_TABLE[place, news]
    return deed.value if after is place else f"→ **{after}**: {deed}"


def _outcome(outcome: LastStop, finding: judge.Evidence) -> str:
    after, deeds = judge.OUTCOME_TABLE[outcome, finding]
    shown = "; ".join(deeds) or judge.PlaceDeed.NOTHING.value
    return shown if after is outcome else f"→ **{after.label}**: {shown}"


def _table(rows: Iterable[list[str]]) -> str:
    first, *others = rows
    return "\n".join(f"| {' | '.join(row)} |" for row in (first, ["---"] * len(first), *others)).replace(
        " --- ", "---"
    )


def _event(stimulus: Stimulus) -> str:
    """Name of the event, with the reactions by which the end of the time-out is this one."""
    reactions = [name for name, rule in REACTIONS.items() if expiry(rule) is stimulus]
    return f"{stimulus.value} (on_expiry = {', '.join(reactions)})" if reactions else stimulus.value


def _cell(stage: Stage, stimulus: Stimulus) -> str:
    """→ names the next stage where it is another."""
    after, deed = TABLE[stage, stimulus]
    return deed.value if after is stage else f"→ **{after}**: {deed}"


def drawn(text: str) -> str:
    """``text`` of a page with the tables as they are now. Raises ValueError where the page has no marks."""
    for begin, end, drawn_now in (
        (BEGIN, END, tables()),
        (WORDS_BEGIN, WORDS_END, word_tables()),
        (JUDGE_BEGIN, JUDGE_END, judge_tables()),
    ):
        text = replaced(text, begin, end, drawn_now)
    return text


if __name__ == "__main__":
    PAGE.write_text(drawn(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
    print(f"{PAGE.name}: {len(Stimulus)} events, {len(Stage)} stages")
