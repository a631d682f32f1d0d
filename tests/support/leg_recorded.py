"""Record of a leg while it is explored."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from bridge.command.leg.state import Stage
from bridge.command.leg.table import Cell, Deed, Stimulus

Cells = set[tuple[Stage, Stimulus]]


class RecordedTable(dict[tuple[Stage, Stimulus], Cell]):
    """Takes each cell from ``table`` when it is looked up; ``last`` is the last one that has a deed. A cell
    without one stays, or that only goes on with its deed, so that it is found in C when it is looked up
    again: each step does that."""

    def __init__(self, table: Mapping[tuple[Stage, Stimulus], Cell]) -> None:
        super().__init__()
        self.table = table
        self.seen: Cells = set()
        self.last: tuple[Stage, Deed] | None = None

    def __missing__(self, key: tuple[Stage, Stimulus]) -> Cell:
        self.seen.add(key)
        cell = self.table[key]
        if cell[1] is Deed.NOTHING or cell == (key[0], Deed.BLOCK):
            self[key] = cell
        else:
            self.last = key[0], cell[1]
        return cell


@dataclass(slots=True)
class Walked:
    """``steps``: state and event, each once."""

    states: int = 0
    steps: int = 0
    enabled: int = 0
    refused: int = 0
    cells: Cells = field(default_factory=set[tuple[Stage, Stimulus]])
