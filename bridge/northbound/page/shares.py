"""Who gets a tab, and whose connection gives way: shares per user and address instead of first come. Sans-IO,
times in monotonic seconds."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Final, Generic, TypeVar

from bridge.command import Role

MOST_TABS: Final = 64
MOST_OF_USER: Final = 16
"""Tabs of one user with however many logins, or of visitors from one address."""
FOR_ENGINEERS: Final = 1
"""Tabs that only an engineer may take: somebody has to be able to look."""
MOST_CONNECTIONS: Final = 256
MOST_IDLE_OF_ADDRESS: Final = 32
"""Connections of one address on which nothing was asked yet: a browser opens six."""
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
class Admission:
    """Whether a tab is let in, and which of the others, by its place, gives way to it."""

    is_in: bool
    gives_way: int | None = None


def admit(taken: Sequence[Seat], new: Seat) -> Admission:
    """Who opens one more tab. Where all are taken, one of the least role gives way to a higher role; within a
    role one of whoever has most to whoever would still have fewer. Who commands a drive never does: it would
    stop."""
    shares = Counter(one.who for one in taken)
    if shares[new.who] >= MOST_OF_USER:
        return Admission(is_in=False)
    room = MOST_TABS if new.role is Role.ENGINEER else MOST_TABS - FOR_ENGINEERS
    if len(taken) < room:
        return Admission(is_in=True)
    yielding = [
        (one.role, -shares[one.who], -one.since, place)
        for place, one in enumerate(taken)
        if not one.commands
        and (one.role < new.role or (one.role is new.role and shares[one.who] > shares[new.who] + 1))
    ]
    return Admission(is_in=True, gives_way=min(yielding)[-1]) if yielding else Admission(is_in=False)


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


@dataclass(slots=True)
class _Connection:
    address: str
    doing: Doing
    since: float


class Connections(Generic[_Id]):
    """The open connections. Before a login nobody is known, so they are shared by address."""

    def __init__(self) -> None:
        self._open: dict[_Id, _Connection] = {}

    def __len__(self) -> int:
        return len(self._open)

    def opened(self, one: _Id, address: str, now: float) -> list[_Id]:
        """A new one; which others are to be closed for it."""
        self._open[one] = _Connection(address, Doing.SILENT, now)
        own = [
            other
            for other, held in self._open.items()
            if held.address == address and held.doing is Doing.SILENT and other != one
        ]
        closing = own[: max(0, len(own) + 1 - MOST_IDLE_OF_ADDRESS)]
        if not closing and len(self._open) > MOST_CONNECTIONS:
            closing = self._yielding(one, now)
        for other in closing:
            del self._open[other]
        return closing

    def does(self, one: _Id, doing: Doing, now: float) -> None:
        held = self._open.get(one)
        if held is not None:
            held.doing, held.since = doing, now

    def closed(self, one: _Id) -> None:
        """May be called again."""
        self._open.pop(one, None)

    def _yielding(self, new: _Id, now: float) -> list[_Id]:
        """Of the address with most of those that do least, the one that has done so for longest."""
        idle = {
            one: held
            for one, held in self._open.items()
            if one != new and held.doing is not Doing.BUSY and not self._is_proved(held, now)
        }
        if not idle:
            return [new]
        shares = Counter((held.doing, held.address) for held in idle.values())
        order = {
            one: (held.doing, -shares[held.doing, held.address], held.since) for one, held in idle.items()
        }
        return [min(idle, key=lambda one: order[one])]

    @staticmethod
    def _is_proved(held: _Connection, now: float) -> bool:
        return held.doing is Doing.UNPROVED and now >= held.since + UNPROVED_S
