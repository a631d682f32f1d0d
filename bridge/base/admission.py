"""Connections that a server has, and for how long without being of use. Sans-IO.

One rule for all that listen. Silent sockets must not keep anybody out: a connection that has come no further
has little time, makes room for later ones, and each address has a limited share. One place is kept for who
has rights.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Final, TypeVar

_SLOW_S: Final = 5.0

Tell = Callable[[str, str, str], object]
"""Given a kind, a source and a detail for the log."""


class ConnectionStage(IntEnum):
    """Stage of a connection. Each protocol says what its own steps are; in a session it has been let
    in, and makes room for nobody."""

    CONNECTED = 0
    GREETED = 1
    CHANNEL = 2
    SESSION = 3


@dataclass(frozen=True, slots=True)
class Deadline:
    """``seconds`` after connecting, or after the end of its last session, it has to have got ``missing``."""

    seconds: float
    missing: str


@dataclass(frozen=True, slots=True)
class Limits:
    """Connections that a server has at most: all, those ``of_address``, and those of one address that are
    ``waiting``, which are in no session. ``held_bytes`` is of messages and answers of all together.

    ``kept``: places, of all and of those of an address, that only who has ``top_rank`` may keep. ``slow_s``:
    who has waited longer makes room first, whatever it has said. ``all_yield``: where nobody waits, one in a
    session makes room."""

    connections: int
    of_address: int
    waiting: int
    deadlines: Mapping[ConnectionStage, Deadline] = field(default_factory=dict[ConnectionStage, Deadline])
    held_bytes: int | None = None
    kept: int = 0
    top_rank: int = 1
    slow_s: float = _SLOW_S
    all_yield: bool = False


@dataclass(slots=True, eq=False)
class Visitor:
    """A connection. ``close`` ends it."""

    source: str
    since: float
    """Time from which it has been without a session, or where there are no sessions, was last heard."""
    stage: Callable[[], ConnectionStage]
    close: Callable[[], None]
    held: Callable[[], int] = lambda: 0
    """Bytes of messages and answers that are kept for it."""
    rank: Callable[[], int] = lambda: 0
    """Height of its user's role."""
    user: Callable[[], str] = lambda: ""
    """Name of its user; empty for one without a name."""

    def is_waiting(self) -> bool:
        return self.stage() is not ConnectionStage.SESSION

    def rank_of(self) -> int:
        return self.rank()

    def share_of(self) -> str:
        """Whom its place is counted for: its user, or without one its address."""
        return self.user() or self.source


Holder = TypeVar("Holder")


def first_to_yield(
    holders: Sequence[Holder], rank_of: Callable[[Holder], int], share_of: Callable[[Holder], str]
) -> Holder:
    """The one that makes room for others: of those of the lowest rank one of the user, or the address, that
    has the most, and of these the last one in ``holders``."""
    lowest = min(map(rank_of, holders))
    of_rank = [one for one in holders if rank_of(one) == lowest]
    crowds = Counter(map(share_of, of_rank))
    largest = max(crowds.values())
    return next(one for one in reversed(of_rank) if crowds[share_of(one)] == largest)


class Admission:
    """The connections that there are. ``refused`` and ``broken`` count those that were not let in and those
    that were ended."""

    def __init__(
        self,
        limits: Limits,
        tell: Tell,
        refused: Callable[[], None] = lambda: None,
        broken: Callable[[], None] = lambda: None,
    ) -> None:
        self._limits = limits
        self._tell = tell
        self._refused = refused
        self._broken = broken
        self._visitors: list[Visitor] = []
        self._crowds: Counter[str] = Counter()

    def __len__(self) -> int:
        return len(self._visitors)

    def count_of(self, source: str) -> int:
        """Connections of this address."""
        return self._crowds[source]

    def admit(self, newcomer: Visitor, now: float) -> bool:
        """Let it in, at the expense of another where that is needed. False: there is no room."""
        limits = self._limits
        same = [visitor for visitor in self._visitors if visitor.source == newcomer.source]
        waiting = [visitor for visitor in same if visitor.is_waiting()]
        has_room = True
        if len(same) >= limits.of_address or len(waiting) >= limits.waiting:
            has_room = self._make_room(newcomer, same, now)
        elif len(self._visitors) >= limits.connections:
            has_room = self._make_room(newcomer, self._visitors, now)
        if not has_room:
            self._refused()
            self._tell(
                "refused connections", newcomer.source, "all that it may have, or all there are, are in use"
            )
            return False
        self._visitors.append(newcomer)
        self._crowds[newcomer.source] += 1
        return True

    def leave(self, visitor: Visitor) -> None:
        """It has ended. May be called again."""
        if visitor in self._visitors:
            self._forget(visitor)

    def look(self, now: float) -> None:
        """Close those whose time is up, who hold too much, or who have a place that is kept for others. To be
        called about once a second."""
        self.weigh()
        for visitor in tuple(self._visitors):
            stage = visitor.stage()
            deadline = self._limits.deadlines.get(stage)
            if stage is ConnectionStage.SESSION:
                visitor.since = now
            elif deadline is not None and now - visitor.since >= deadline.seconds:
                detail = f"no {deadline.missing} within {deadline.seconds:g} s"
                self._end(visitor, "connections closed that came no further", detail)
        self._keep_places()

    def weigh(self) -> None:
        """Close who holds the most of the address that does, until all together hold what they may."""
        most = self._limits.held_bytes
        if most is None:
            return
        held = {visitor: visitor.held() for visitor in self._visitors}
        of_source: Counter[str] = Counter()
        for visitor, size in held.items():
            of_source[visitor.source] += size
        while sum(held.values()) > most:
            heaviest = max(held, key=lambda one: (of_source[one.source], held[one]))
            of_source[heaviest.source] -= held.pop(heaviest)
            self._end(heaviest, "connections closed that had too much under way", "")

    def _keep_places(self) -> None:
        """Close connections beyond the limit, so that a place is free for who has a higher role: anybody may
        try it, but only the highest role keeps it."""
        limits = self._limits
        if not limits.kept:
            return
        settled = [one for one in self._visitors if not one.is_waiting()]
        for source in {one.source for one in settled}:
            same = [one for one in settled if one.source == source]
            self._free(same, limits.of_address - limits.kept)
        settled = [one for one in self._visitors if not one.is_waiting()]
        self._free(settled, limits.connections - limits.kept)

    def _free(self, settled: list[Visitor], most: int) -> None:
        """Leave ``most`` of them, as far as there are some of a lower role than the highest."""
        for _ in range(len(settled) - most):
            lower = [one for one in settled if one.rank() < self._limits.top_rank]
            if not lower:
                return
            yielding = first_to_yield(lower, Visitor.rank_of, Visitor.share_of)
            settled.remove(yielding)
            self._end(yielding, "connections closed whose place is kept for a higher role", "")

    def _make_room(self, newcomer: Visitor, candidates: Sequence[Visitor], now: float) -> bool:
        """End one of the candidates that wait, or where all yield one of all."""
        waiting = [one for one in candidates if one.is_waiting()]
        candidates = waiting or (candidates if self._limits.all_yield else ())
        if not candidates:
            return False
        crowds = Counter(one.source for one in candidates)
        crowds[newcomer.source] += 1

        def order(visitor: Visitor) -> tuple[int, bool, int, float]:
            """Connection that gives way: from the largest crowd first, then a slow one, the oldest of them;
            else the one that has sent least: a flood of idle sockets must not push out a client in the middle
            of its handshake."""
            is_slow = now - visitor.since > self._limits.slow_s
            stage = 0 if is_slow else visitor.stage()
            return -crowds[visitor.source], not is_slow, stage, visitor.since

        self._end(min(candidates, key=order), "connections that made room", "it was missed least")
        return True

    def _forget(self, visitor: Visitor) -> None:
        self._visitors.remove(visitor)
        self._crowds[visitor.source] -= 1
        if not self._crowds[visitor.source]:
            del self._crowds[visitor.source]

    def _end(self, visitor: Visitor, kind: str, detail: str) -> None:
        self._forget(visitor)
        self._broken()
        self._tell(kind, visitor.source, detail)
        visitor.close()
