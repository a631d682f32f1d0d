"""Who gets a tab, and whose connection gives way: shares per user and address instead of first come. Sans-IO,
times in monotonic seconds."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import IntEnum
from math import inf
from typing import Final, Generic, TypeVar

from bridge.base.admission import Admission, Limits, Stage, Tell, Visitor
from bridge.command import Role

MOST_TABS: Final = 64
MOST_OF_USER: Final = 16
"""Tabs of one user with however many logins, or of visitors from one address."""
FOR_ENGINEERS: Final = 1
"""Tabs that only an engineer may take: somebody has to be able to look."""
MOST_CONNECTIONS: Final = 256
MOST_WAITING_OF_ADDRESS: Final = 64
"""Connections of one address on which nothing is under way: a browser opens six."""
UNPROVED_S: Final = 6.0
"""How long a tab's connection may be one that has not proved its session yet."""


@dataclass(frozen=True, slots=True)
class Seat:
    """One tab: ``commands`` a drive or not, opened at ``since``. ``user`` is empty for a visitor."""

    user: str
    address: str
    role: Role
    commands: bool = False
    since: float = 0.0

    @property
    def who(self) -> str:
        """By whom tabs are shared: a user, or the visitors of one address."""
        return self.user or f"visitor {self.address}"


@dataclass(frozen=True, slots=True)
class Seating:
    """Whether a tab is let in, and which of the others, by its place, gives way to it."""

    is_in: bool
    gives_way: int | None = None


def admit(taken: Sequence[Seat], new: Seat) -> Seating:
    """Who opens one more tab. Where all are taken, one of the least role gives way to a higher role; within a
    role one of whoever has most to whoever would still have fewer. Who commands a drive never does: it would
    stop."""
    shares = Counter(one.who for one in taken)
    if shares[new.who] >= MOST_OF_USER:
        return Seating(is_in=False)
    room = MOST_TABS if new.role is Role.ENGINEER else MOST_TABS - FOR_ENGINEERS
    if len(taken) < room:
        return Seating(is_in=True)
    yielding = [
        (one.role, -shares[one.who], -one.since, place)
        for place, one in enumerate(taken)
        if not one.commands
        and (one.role < new.role or (one.role is new.role and shares[one.who] > shares[new.who] + 1))
    ]
    return Seating(is_in=True, gives_way=min(yielding)[-1]) if yielding else Seating(is_in=False)


class Doing(IntEnum):
    """What a connection does; the first give way first."""

    SILENT = 0
    """Nothing was asked on it yet."""
    KEPT = 1
    """It was answered, and is kept for the next request."""
    UNPROVED = 2
    """A tab's, that may not have proved its session yet."""
    BUSY = 3


_Id = TypeVar("_Id")
_STAGES: Final = {Doing.SILENT: Stage.CONNECTED, Doing.KEPT: Stage.GREETED, Doing.BUSY: Stage.SESSION}
_LIMITS: Final = Limits(
    MOST_CONNECTIONS, MOST_CONNECTIONS // 2, MOST_WAITING_OF_ADDRESS, slow_s=inf
)  # the place for who has rights is among the tabs: who has none of those is soon answered


class _Doing:
    """What one connection does, and since when."""

    __slots__ = ("_clock", "doing", "since")

    def __init__(self, clock: Callable[[], float]) -> None:
        self._clock = clock
        self.doing, self.since = Doing.SILENT, clock()

    def stage(self) -> Stage:
        """A tab that may not have proved its session yet may be nobody's."""
        if self.doing is not Doing.UNPROVED:
            return _STAGES[self.doing]
        return Stage.SESSION if self._clock() >= self.since + UNPROVED_S else Stage.CHANNEL


class Connections(Generic[_Id]):
    """The open connections, which ``end`` ends. Before a login nobody is known, so they are shared by
    address."""

    def __init__(self, end: Callable[[_Id], None], tell: Tell, clock: Callable[[], float]) -> None:
        self._end = end
        self._clock = clock
        self._admission = Admission(_LIMITS, tell)
        self._open: dict[_Id, tuple[_Doing, Visitor]] = {}

    def __len__(self) -> int:
        return len(self._admission)

    def opened(self, one: _Id, address: str) -> bool:
        """A new one; False where there is no room for it."""
        does = _Doing(self._clock)
        visitor = Visitor(address, does.since, does.stage, lambda: self._end(one))
        is_in = self._admission.admit(visitor, does.since)
        if is_in:
            self._open[one] = does, visitor
        return is_in

    def does(self, one: _Id, doing: Doing) -> None:
        held = self._open.get(one)
        if held is not None:
            does, visitor = held
            does.doing = doing
            does.since = visitor.since = self._clock()

    def closed(self, one: _Id) -> None:
        """May be called again."""
        held = self._open.pop(one, None)
        if held is not None:
            self._admission.leave(held[1])
