"""What was done to a plant against what the bridge says of it: each fault that the docs name is told.

Where the bridge stands still, has no bus or is not in charge, it has not seen the fault, and owes nothing.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import Final

from bridge.command import Event, EventKind
from tests.plant.oracle import Oracle

_KEPT_S: Final = 5.0
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
    """Judge of events. What is wrong goes to the oracle's violations."""

    def __init__(self, oracle: Oracle) -> None:
        self._oracle = oracle
        self._owed: list[_Owed] = []
        self._told: list[tuple[float, EventKind, str]] = []
        self._disturbed_at = -inf

    def disturbed(self, at: float) -> None:
        """The bridge stands still, ends, begins, or has no bus: it sees nothing of this moment."""
        self._disturbed_at = at

    def owes(self, kind: EventKind, source: str, since: float, due: float, what: str) -> None:
        """An event of this kind about ``source`` has to be told from ``since`` to ``due``."""
        self._owed.append(_Owed(kind, source, since, due, what))

    def told(self, event: Event, at: float) -> None:
        self._told.append((at, event.kind, event.source))

    def look(self, now: float, *, is_still: bool) -> None:
        """Judge what is due by ``now``."""
        if is_still:
            self._disturbed_at = now
        self._told = [told for told in self._told if told[0] > now - _KEPT_S]
        due = [owed for owed in self._owed if owed.due <= now]
        self._owed = [owed for owed in self._owed if owed.due > now]
        for owed in due:
            self._oracle.looks += 1
            if self._disturbed_at >= owed.since - _LOOK_S:
                continue
            if not any(
                owed.since <= at <= owed.due and kind is owed.kind and source == owed.source
                for at, kind, source in self._told
            ):
                self._oracle.wrong(
                    owed.due, f"{owed.what} at {owed.since - 1000.0:.3f} s, and no event says so"
                )
