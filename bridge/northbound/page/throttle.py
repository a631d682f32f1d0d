"""Limit of password guesses per address. Sans-IO: times are monotonic seconds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, TypeVar

FREE: Final = 5
"""Wrong passwords of one user in a row without a pause."""
FREE_OF_ADDRESS: Final = 20
"""Free guesses of one address for all users together: several people may be behind it."""
FIRST_PAUSE_S: Final = 1.0
LONGEST_PAUSE_S: Final = 300.0
FORGOTTEN_S: Final = 3600.0
_MOST: Final = 4096
_LONGEST_NAME: Final = 64
_Key = TypeVar("_Key")


@dataclass(slots=True)
class _FailureCount:
    failures: int = 0
    last: float = 0.0
    until: float = 0.0

    def add(self, free: int, now: float) -> None:
        if now > self.last + FORGOTTEN_S:
            self.failures = 0
        self.failures += 1
        self.last = now
        over = self.failures - free
        if over > 0:
            self.until = now + min(FIRST_PAUSE_S * 2.0 ** min(over - 1, 64), LONGEST_PAUSE_S)


class Throttle:
    """After ``FREE`` wrong passwords of a user each further one doubles the pause in which no login of that
    user from that address is even looked at; after ``FREE_OF_ADDRESS`` none of that address.

    A password that is right forgets what was counted for its own user, and nothing of the others: who has a
    login cannot use it to guess somebody else's.
    """

    def __init__(self) -> None:
        self._users: dict[tuple[str, str], _FailureCount] = {}
        self._addresses: dict[str, _FailureCount] = {}

    def __len__(self) -> int:
        return max(len(self._users), len(self._addresses))

    def begin(self, address: str, user: str, now: float) -> float:
        """Count a login as wrong before its password is checked, because any number may be under way. Where
        it is not to be checked it is not counted, and this is for how many seconds; otherwise 0."""
        key = address, user[:_LONGEST_NAME]
        known = (self._users.get(key), self._addresses.get(address))
        pause_s = max((one.until - now for one in known if one), default=0.0)
        if pause_s > 0:
            return pause_s
        self._users.setdefault(key, _FailureCount()).add(FREE, now)
        self._addresses.setdefault(address, _FailureCount()).add(FREE_OF_ADDRESS, now)
        _make_room(self._users)
        _make_room(self._addresses)
        return 0.0

    def withdrawn(self, address: str, user: str) -> None:
        """Uncount a login that is not checked after all."""
        for known in (self._users.get((address, user[:_LONGEST_NAME])), self._addresses.get(address)):
            if known:
                known.failures = max(0, known.failures - 1)

    def succeeded(self, address: str, user: str) -> None:
        own = self._users.pop((address, user[:_LONGEST_NAME]), None)
        of_all = self._addresses.get(address)
        if own is None or of_all is None:
            return
        of_all.failures -= own.failures
        if of_all.failures <= 0:
            del self._addresses[address]
        elif of_all.failures <= FREE_OF_ADDRESS:
            of_all.until = 0.0


def _make_room(counts: dict[_Key, _FailureCount]) -> None:
    while len(counts) > _MOST:
        counts.pop(min(counts, key=lambda one: counts[one].last))
