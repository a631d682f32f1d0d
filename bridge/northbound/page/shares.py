"""Shares of tabs per user and of connections per address, instead of first come, first served. Sans-IO, times
in monotonic seconds."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import IntEnum
from math import inf
from typing import Final, Generic, TypeVar

from bridge.base.admission import Admission, ConnectionStage, Limits, Tell, Visitor
from bridge.command import Role

MOST_TABS: Final = 64
MOST_OF_USER: Final = 16
"""Most tabs of one user in all logins, or of visitors from one address."""
FOR_ENGINEERS: Final = 1
"""Tabs kept free for engineers: one must always be able to look."""
MOST_CONNECTIONS: Final = 256
MOST_WAITING_OF_ADDRESS: Final = 64
"""Most idle connections of one address: a browser opens six."""
UNPROVED_S: Final = 6.0
"""Longest time for a tab's connection to prove its session, seconds."""


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
        """Holder of a share of the tabs: a user, or the visitors of one address."""
        return self.user or f"visitor {self.address}"


@dataclass(frozen=True, slots=True)
class Seating:
    """Decision on a tab: let in or not, and the place of the tab that gives way to it."""

    is_in: bool
    gives_way: int | None = None


def admit(taken: Sequence[Seat], new: Seat) -> Seating:
    """Decision on one more tab. Where all are taken, a tab of the lowest role gives way to a higher role;
    within a role, one of the holder with most tabs gives way to a holder who would still have fewer. A tab
    that commands a drive never gives way: the drive would stop."""
    shares = Counter(one.who for one in taken)
    if shares[new.who] >= MOST_OF_USER:
        return Seating(is_in=False)
    room = MOST_TABS if new.role >= Role.ENGINEER else MOST_TABS - FOR_ENGINEERS
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
    """Activity of a connection, in the order in which they give way."""

    SILENT = 0
    """No request has come yet."""
    KEPT = 1
    """Its request was answered, and it is kept for the next one."""
    UNPROVED = 2
    """It is a tab's, and may not have proved its session yet."""
    BUSY = 3


_Id = TypeVar("_Id")
_STAGES: Final = {
    Doing.SILENT: ConnectionStage.CONNECTED,
    Doing.KEPT: ConnectionStage.GREETED,
    Doing.BUSY: ConnectionStage.SESSION,
}
_LIMITS: Final = Limits(
    MOST_CONNECTIONS, MOST_CONNECTIONS // 2, MOST_WAITING_OF_ADDRESS, slow_s=inf
)  # the place for who has rights is among the tabs: who has none of those is soon answered


class _Doing:
    """Activity of one connection, and since when."""

    __slots__ = ("_clock", "doing", "since")

    def __init__(self, clock: Callable[[], float]) -> None:
        self._clock = clock
        self.doing, self.since = Doing.SILENT, clock()

    def stage(self) -> ConnectionStage:
        """Stage of the connection: a tab younger than ``UNPROVED_S`` may have no session yet, and gives way
        before those that have."""
        if self.doing is not Doing.UNPROVED:
            return _STAGES[self.doing]
        return (
            ConnectionStage.SESSION if self._clock() >= self.since + UNPROVED_S else ConnectionStage.CHANNEL
        )


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
        """Note a new connection; False where there is no room for it."""
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
        """Note that it is closed. May be called again."""
        held = self._open.pop(one, None)
        if held is not None:
            self._admission.leave(held[1])
