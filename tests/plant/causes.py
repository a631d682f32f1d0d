"""What was done to a plant against what the bridge says of it: each fault that the docs name is told.

Where the bridge stands still, has no bus or is not in charge, it has not seen the fault, and owes nothing.
"""

from __future__ import annotations

from bisect import bisect_left
from collections import defaultdict
from dataclasses import dataclass
from typing import Final

from bridge.command import Event, EventKind
from tests.plant.oracle import Oracle

_LOOK_S: Final = 0.5
"""A bridge that was disturbed so shortly before may have missed the fault itself."""


@dataclass(frozen=True, slots=True)
class _Owed:
    """An event that is to be told by ``due`` of something that happened at ``since``."""

    kind: EventKind
    source: str
    since: float
    due: float
    what: str


class Causes:
    """Judge of events. What is wrong goes to the oracle's violations.

    A fault may be known only when it is over, however long it lasts, as a controller's silence is: so
    everything is kept with its time.
    """

    def __init__(self, oracle: Oracle) -> None:
        self._oracle = oracle
        self._owed: list[_Owed] = []
        self._told: defaultdict[tuple[EventKind, str], list[float]] = defaultdict(list)
        self._disturbed: list[float] = []

    def disturbed(self, at: float) -> None:
        """The bridge stands still, ends, begins, or has no bus: it sees nothing of this moment."""
        self._disturbed.append(at)

    def owes(self, kind: EventKind, source: str, since: float, due: float, what: str) -> None:
        """An event of this kind about ``source`` has to be told from ``since`` to ``due``."""
        self._owed.append(_Owed(kind, source, since, due, what))

    def told(self, event: Event, at: float) -> None:
        self._told[event.kind, event.source].append(at)

    def look(self, now: float, *, is_still: bool) -> None:
        """Judge what is due by ``now``."""
        if is_still:
            self.disturbed(now)
        due = [owed for owed in self._owed if owed.due <= now]
        self._owed = [owed for owed in self._owed if owed.due > now]
        for owed in due:
            self._oracle.looks += 1
            if _is_any(self._disturbed, owed.since - _LOOK_S, owed.due):
                continue
            if not _is_any(self._told[owed.kind, owed.source], owed.since, owed.due):
                self._oracle.wrong(
                    owed.due, f"{owed.what} at {owed.since - 1000.0:.3f} s, and no event says so"
                )


def _is_any(times: list[float], since: float, until: float) -> bool:
    """Whether any of these times, which are in order, is from ``since`` to ``until``."""
    place = bisect_left(times, since)
    return place < len(times) and times[place] <= until
