"""Order in which parameter points are read: in turn, within a budget, after everything else. Sans-IO.

Every point is read once after its node has booted, and those with ``every_ms`` periodically. Points are read
one at a time; if more are due than the budget allows, all are read less often.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable, Sequence
from enum import Enum
from typing import Final

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


Ask = Callable[[ParameterHolder, ParameterEntry, Callable[[Came], None]], None]


class ParameterPolling:
    """Polls of one node's parameter points. ``ask`` reads one and reports its result; ``nodes`` share the
    budget."""

    def __init__(self, node: Node, nodes: int, ask: Ask) -> None:
        self._node = node
        self._ask = ask
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

    def on_time(self, now: float) -> None:
        deadline = self.next_deadline()
        if deadline is None or now < deadline:
            return
        _, place = heapq.heappop(self._due)
        self._next_at = now + self.pause_s
        self._asked = True
        drive, entry = self._places[place]
        this_round = self._round

        def done(came: Came) -> None:
            if this_round != self._round:
                return  # the node was lost meanwhile
            self._asked = False
            every_s = entry.definition.every_ms / 1000 if entry.definition else 0.0
            if came is Came.FAILED:
                heapq.heappush(self._due, (now + max(every_s, _PATIENCE_S), place))
            elif came is Came.READ and every_s:
                heapq.heappush(self._due, (now + every_s, place))

        self._ask(drive, entry, done)
