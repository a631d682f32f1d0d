"""Which connections there may be, and for how long without a session. Sans-IO.

Silent sockets must not keep anybody out: a connection without a session has little time, makes room for later
ones, and each address has a limited share.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Final

from bridge.northbound.opcua.notices import Tell

MOST_CONNECTIONS: Final = 100
MOST_OF_ADDRESS: Final = 50
MOST_WAITING: Final = 25
"""Connections of one address that have no session yet."""
MOST_HELD: Final = 64 * 1024 * 1024
"""Bytes of messages and answers, of all connections together."""
_SLOW_S: Final = 5.0


class Stage(IntEnum):
    """How far a connection has come."""

    CONNECTED = 0
    GREETED = 1
    CHANNEL = 2
    SESSION = 3


DEADLINE_S: Final = {Stage.CONNECTED: 5.0, Stage.GREETED: 10.0, Stage.CHANNEL: 30.0}
"""Seconds after connecting, or after the end of its last session."""
_MISSING: Final = {Stage.CONNECTED: "hello", Stage.GREETED: "channel", Stage.CHANNEL: "session"}


@dataclass(slots=True, eq=False)
class Visitor:
    """A connection. ``close`` ends it."""

    source: str
    since: float
    """When it began to be without a session."""
    stage: Callable[[], Stage]
    held: Callable[[], int]
    """Bytes of messages and answers that are kept for it."""
    close: Callable[[], None]

    def is_waiting(self) -> bool:
        return self.stage() is not Stage.SESSION


class Admission:
    """The connections that there are. ``tell`` is given a kind, a source and a detail for the log, ``count``
    the point that counts it."""

    def __init__(self, tell: Tell, count: Callable[[str], None]) -> None:
        self._tell = tell
        self._count = count
        self._visitors: list[Visitor] = []

    def __len__(self) -> int:
        return len(self._visitors)

    def admit(self, newcomer: Visitor, now: float) -> bool:
        """Let it in, at the expense of another where that is needed. False: there is no room."""
        same = [visitor for visitor in self._visitors if visitor.source == newcomer.source]
        waiting = [visitor for visitor in same if visitor.is_waiting()]
        has_room = True
        if len(same) >= MOST_OF_ADDRESS or len(waiting) >= MOST_WAITING:
            has_room = self._make_room(waiting, now)
        elif len(self._visitors) >= MOST_CONNECTIONS:
            has_room = self._make_room([one for one in self._visitors if one.is_waiting()], now)
        if not has_room:
            self._count("opcua_refused_connections")
            self._tell(
                "refused connections", newcomer.source, "all that it may have, or all there are, are in use"
            )
            return False
        self._visitors.append(newcomer)
        return True

    def leave(self, visitor: Visitor) -> None:
        if visitor in self._visitors:
            self._visitors.remove(visitor)

    def look(self, now: float) -> None:
        """Close those whose time is up, or who hold too much. To be called about once a second."""
        self.weigh()
        for visitor in tuple(self._visitors):
            stage = visitor.stage()
            if stage is Stage.SESSION:
                visitor.since = now
            elif now - visitor.since >= DEADLINE_S[stage]:
                detail = f"no {_MISSING[stage]} within {DEADLINE_S[stage]:g} s"
                self._end(visitor, "connections closed that came no further", detail)

    def weigh(self) -> None:
        """Close who holds the most of the address that does, until all together hold what they may."""
        held = {visitor: visitor.held() for visitor in self._visitors}
        of_source: Counter[str] = Counter()
        for visitor, size in held.items():
            of_source[visitor.source] += size
        while sum(held.values()) > MOST_HELD:
            heaviest = max(held, key=lambda one: (of_source[one.source], held[one]))
            of_source[heaviest.source] -= held.pop(heaviest)
            self._end(heaviest, "connections closed that had too much under way", "")

    def _make_room(self, candidates: Sequence[Visitor], now: float) -> bool:
        if not candidates:
            return False
        crowds = Counter(one.source for one in candidates)

        def order(visitor: Visitor) -> tuple[int, bool, int, float]:
            """Who comes in the largest crowd goes first, then who is slow, the oldest of them; else who has
            said least: a flood of idle sockets must not push out a client in the middle of its handshake."""
            is_slow = now - visitor.since > _SLOW_S
            stage = 0 if is_slow else visitor.stage()
            return -crowds[visitor.source], not is_slow, stage, visitor.since

        self._end(min(candidates, key=order), "connections without a session that made room", "")
        return True

    def _end(self, visitor: Visitor, kind: str, detail: str) -> None:
        self._visitors.remove(visitor)
        self._count("opcua_broken_connections")
        self._tell(kind, visitor.source, detail)
        visitor.close()
