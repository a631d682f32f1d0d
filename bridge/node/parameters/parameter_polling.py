"""Order in which parameter points are read: in turn, within a budget, after everything else. Sans-IO.

Every point is read once after its node has booted, and those with ``every_ms`` periodically. Points are read
one at a time; if more are due than the budget allows, all are read less often.
"""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from enum import Enum
from typing import Final, NamedTuple

from bridge.command import ParameterHolder
from bridge.command.node import Node
from bridge.parameter import ParameterEntry

MOST_PER_S: Final = 20.0
"""Reads of one node per second: drives answer an SDO in 20 … 50 ms (Lenze: 30 ms and 20 ms typical)."""
BUS_SHARE: Final = 0.05
"""Share of the bus that the polls of all nodes together may take."""
_BITS: Final = 2 * 135
"""Bits of a request and its answer with the most stuff bits (ISO 11898-1)."""
_PATIENCE_S: Final = 5.0
"""Shortest time in seconds before a failed read is repeated."""


class Came(Enum):
    """Result of a read."""

    READ = "read"
    FAILED = "failed"
    NEVER = "never"
    """The drive does not have the parameter."""


class PointRead(NamedTuple):
    """Read of a point that is due: whose it is, and the monotonic time in seconds at which it is begun.
    ``turn`` tells reads of an earlier operation of the node apart."""

    holder: ParameterHolder
    entry: ParameterEntry
    at: float
    place: int
    turn: int


class ParameterPolling:
    """Polls of one node's parameter points: it says which is to be read, and is told what came of it.
    ``nodes`` share the budget."""

    def __init__(self, node: Node, nodes: int) -> None:
        self._node = node
        share = BUS_SHARE * node.bus.bitrate / _BITS / max(nodes, 1)
        self.pause_s = 1.0 / min(MOST_PER_S, share)
        """Time between two reads, in seconds."""
        self._due: list[tuple[float, int]] = []
        self._places: list[tuple[ParameterHolder, ParameterEntry]] = []
        self._next_at = 0.0
        self._asked = False
        self._round = 0

    def start(self, drives: Sequence[ParameterHolder], now: float) -> None:
        """Begin with all points of ``drives``."""
        of_drives = [[(drive, entry) for entry in drive.spec.names.points()] for drive in drives]
        self._places = [place for in_turn in zip(*of_drives, strict=True) for place in in_turn]
        self._due = [(now, place) for place in range(len(self._places))]
        self._next_at = now
        self._round += 1
        self._asked = False

    def stop(self) -> None:
        self._due = []
        self._round += 1
        self._asked = False

    def next_deadline(self) -> float | None:
        if not self._due or self._asked:
            return None
        return max(self._due[0][0], self._next_at)

    def take_due(self, now: float) -> PointRead | None:
        """Read that is to be begun now; None where there is none. ``on_result`` is told what came of it."""
        deadline = self.next_deadline()
        if deadline is None or now < deadline:
            return None
        _, place = heapq.heappop(self._due)
        self._next_at = now + self.pause_s
        self._asked = True
        drive, entry = self._places[place]
        return PointRead(drive, entry, now, place, self._round)

    def on_result(self, read: PointRead, came: Came) -> None:
        """Take over what came of a read that was due; nothing where the node was lost meanwhile."""
        if read.turn != self._round:
            return
        self._asked = False
        definition = read.entry.definition
        every_s = definition.every_ms / 1000 if definition else 0.0
        if came is Came.FAILED:
            heapq.heappush(self._due, (read.at + max(every_s, _PATIENCE_S), read.place))
        elif came is Came.READ and every_s:
            heapq.heappush(self._due, (read.at + every_s, read.place))
