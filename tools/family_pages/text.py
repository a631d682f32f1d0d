"""Tables and words of the pages."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

from bridge.mapping.entry_types import ObjectRef


def table(columns: Sequence[str], rows: Iterable[Sequence[object]]) -> Iterator[str]:
    yield f"| {' | '.join(columns)} |"
    yield f"|{'---|' * len(columns)}"
    for row in rows:
        yield f"| {' | '.join(str(cell).replace('|', chr(92) + '|') for cell in row)} |"
    yield ""


def states_text(states: dict[int, str]) -> str:
    return ", ".join(f"{number} {text}" for number, text in sorted(states.items()))


def range_text(low: float | None, high: float | None) -> str:
    if low is None and high is None:
        return "–"
    return f"{'' if low is None else f'{low:g}'}…{'' if high is None else f'{high:g}'}"


def object_text(ref: ObjectRef) -> str:
    return f"`{ref}`"
