"""Lazy heap of deadlines: of many owners only those that are due cost anything."""

from __future__ import annotations

import heapq
from math import inf
from typing import Final, Generic, Protocol, TypeVar

_AHEAD_S: Final = 0.005
"""Look-ahead in seconds: owners with a deadline this near are looked at before the timer is set. Mostly it
has been put off meanwhile, and no wake-up is needed."""
_SWEEPS: Final = 10
_MOST_ENTRIES: Final = 8
"""Heap entries for each owner, beyond which those that no longer count are thrown away."""


class DeadlineOwner(Protocol):
    """Owner of deadlines: the earliest of them at any time, ``now`` for one that is past."""

    def next_deadline(self, now: float) -> float | None: ...


T = TypeVar("T", bound=DeadlineOwner)


class Deadlines(Generic[T]):
    """Deadlines of many owners, each of which is looked at no later than its earliest one.

    A deadline that was put off (each TPDO and telegram does that) is noticed when the old one comes.
    ``touch`` must tell of one that was brought forward. Times are monotonic seconds.
    """

    def __init__(self) -> None:
        self._owners: list[T] = []
        self._places: dict[T, int] = {}
        self._planned: list[float] = []
        self._touched: dict[int, None] = {}
        self._heap: list[tuple[float, int]] = []
        self._swept = 0
        self.missed = 0
        """Number of deadlines that ``sweep`` has found without having been told of them."""

    def add(self, owner: T) -> None:
        self._places[owner] = place = len(self._owners)
        self._touched[place] = None
        self._owners.append(owner)
        self._planned.append(inf)

    def touch(self, owner: T) -> None:
        """Note that the owner may have an earlier deadline than it had."""
        self._touched[self._places[owner]] = None

    @property
    def is_touched(self) -> bool:
        """An owner may have an earlier deadline than ``next`` has said."""
        return bool(self._touched)

    def take_due(self, now: float) -> list[T]:
        """Owners whose deadline has come, in their order; acting on it makes all of theirs uncertain."""
        heap, planned = self._heap, self._planned
        if not self._touched and (not heap or heap[0][0] > now):
            return []
        self._plan_touched(now)
        due = set[int]()
        while heap and heap[0][0] <= now:
            at, place = heapq.heappop(heap)
            if planned[place] != at:
                continue
            planned[place] = inf
            at = self._next_of(place, now)
            if at <= now:
                due.add(place)
                self._touched[place] = None
            else:
                self._plan(place, at)
        return [self._owners[place] for place in sorted(due)]

    def next(self, now: float) -> float | None:
        """Time of the next ``take_due``; None for never."""
        self._plan_touched(now)
        heap, planned = self._heap, self._planned
        while heap:
            at, place = heap[0]
            later = inf
            if planned[place] == at:
                if at > now + _AHEAD_S or (later := self._next_of(place, now)) <= at:
                    return at
                planned[place] = inf
            heapq.heappop(heap)
            self._plan(place, later)
        return None

    def sweep(self, now: float) -> list[T]:
        """Look at the next few owners, touched or not: at all of them in ten calls. Returns those with a
        deadline that ``touch`` should have told of."""
        count = len(self._owners)
        first, self._swept = self._swept, self._swept + -(-count // _SWEEPS)
        missed = [
            place
            for place in (place % count for place in range(first, self._swept))
            if place not in self._touched and self._next_of(place, now) < self._planned[place]
        ]
        self._swept %= max(count, 1)
        self.missed += len(missed)
        self._touched |= dict.fromkeys(missed)
        return [self._owners[place] for place in missed]

    def _next_of(self, place: int, now: float) -> float:
        at = self._owners[place].next_deadline(now)
        return inf if at is None else at

    def _plan_touched(self, now: float) -> None:
        if self._touched:
            touched, self._touched = self._touched, {}
            for place in touched:
                self._plan(place, self._next_of(place, now))

    def _plan(self, place: int, at: float) -> None:
        """Look at an owner ``at`` that time, unless it is looked at before."""
        heap, planned = self._heap, self._planned
        if at >= planned[place]:
            return
        planned[place] = at
        heapq.heappush(heap, (at, place))
        if len(heap) > _MOST_ENTRIES * len(planned):
            heap[:] = [(at, place) for place, at in enumerate(planned) if at < inf]
            heapq.heapify(heap)
