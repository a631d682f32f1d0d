"""The leg's table, and what is looked up in it while something else goes on."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from bridge.command.leg import turn
from bridge.command.leg.state import Stage
from bridge.command.leg.table import Stimulus


class RecordedTable(dict[tuple[Stage, Stimulus], Any]):
    """``seen`` has the rows in the order in which they were looked up."""

    def __init__(self, *args: Any) -> None:
        super().__init__(*args)
        self.seen: list[tuple[Stage, Stimulus]] = []

    def __getitem__(self, key: tuple[Stage, Stimulus]) -> Any:
        self.seen.append(key)
        return super().__getitem__(key)


@contextmanager
def recorded_table() -> Iterator[RecordedTable]:
    table = turn.TABLE
    recorder = RecordedTable(table)
    turn.TABLE = recorder  # pyright: ignore[reportConstantRedefinition]
    try:
        yield recorder
    finally:
        turn.TABLE = table  # pyright: ignore[reportConstantRedefinition]
