"""Turns of connections where many want to be served at once. Sans-IO.

The address that was served longest ago is next, and of an address the connection that was: any number of
connections has the turns of one address, and who asks now and then does not wait for those who ask without a
pause.
"""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, field
from heapq import heappop, heappush
from typing import Generic, TypeVar

One = TypeVar("One", bound=Hashable)


@dataclass(slots=True, eq=False)
class _Address(Generic[One]):
    """``served`` is the number of its last turn; ``waiting`` a heap of its connections that wait, each with
    the number of its own last turn and of its wish. It has an entry among the addresses that wait while
    ``is_queued``."""

    served: int
    members: int = 0
    is_queued: bool = False
    waiting: list[tuple[int, int, One]] = field(default_factory=list[tuple[int, int, One]])


@dataclass(slots=True, eq=False)
class _Waiting(Generic[One]):
    source: str
    address: _Address[One]
    served: int
    waits: bool = False


class Turns(Generic[One]):
    """Connections, and which of them wait. A new one, or a new address, is behind those that wait."""

    def __init__(self) -> None:
        self._number = 0
        self._places: dict[One, _Waiting[One]] = {}
        self._addresses: dict[str, _Address[One]] = {}
        self._queue: list[tuple[int, int, _Address[One]]] = []

    @property
    def addresses(self) -> int:
        """Addresses that have a connection."""
        return len(self._addresses)

    def enter(self, one: One, source: str) -> None:
        """A new connection of the address ``source``."""
        address = self._addresses.get(source)
        if address is None:
            address = self._addresses[source] = _Address[One](self._number)
        address.members += 1
        self._places[one] = _Waiting(source, address, self._number)

    def leave(self, one: One) -> None:
        """Forget a connection, whether it waits or not. May be called again."""
        place = self._places.pop(one, None)
        if place is None:
            return
        place.address.members -= 1
        if not place.address.members:
            del self._addresses[place.source]

    def wish(self, one: One) -> None:
        """A connection has something to be served. Does nothing for one that waits, or has left."""
        place = self._places.get(one)
        if place is None or place.waits:
            return
        place.waits = True
        self._number += 1
        heappush(place.address.waiting, (place.served, self._number, one))
        self._enqueue(place.address)

    def take(self) -> One | None:
        """The connection whose turn it is, which waits no more; None where none waits."""
        while self._queue:
            _, _, address = heappop(self._queue)
            address.is_queued = False
            while address.waiting:
                _, _, one = heappop(address.waiting)
                place = self._places.get(one)
                if place is None:
                    continue
                self._number += 1
                place.waits, place.served, address.served = False, self._number, self._number
                self._enqueue(address)
                return one
        return None

    def _enqueue(self, address: _Address[One]) -> None:
        if address.waiting and not address.is_queued:
            address.is_queued = True
            self._number += 1
            heappush(self._queue, (address.served, self._number, address))
