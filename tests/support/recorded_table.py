"""The watchdog's table, and what is looked up in it while something else goes on."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from bridge.command import watchdog
from bridge.command.watchdog import Stimulus, WatchdogState


class RecordedTable(dict[tuple[WatchdogState, Stimulus], Any]):
    """``seen`` has the rows in the order in which they were looked up."""

    def __init__(self, *args: Any) -> None:
        super().__init__(*args)
        self.seen: list[tuple[WatchdogState, Stimulus]] = []

    def __getitem__(self, key: tuple[WatchdogState, Stimulus]) -> Any:
        self.seen.append(key)
        return super().__getitem__(key)


@contextmanager
def recorded_table() -> Iterator[RecordedTable]:
    table = watchdog.TABLE
    recorder = RecordedTable(table)
    watchdog.TABLE = recorder  # pyright: ignore[reportConstantRedefinition]
    try:
        yield recorder
    finally:
        watchdog.TABLE = table  # pyright: ignore[reportConstantRedefinition]
