"""How often one address may guess a password. Sans-IO: times are monotonic seconds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

FREE: Final = 5
"""Wrong passwords in a row that cost nothing but their check."""
FIRST_PAUSE_S: Final = 1.0
LONGEST_PAUSE_S: Final = 300.0
FORGOTTEN_S: Final = 3600.0
_MOST: Final = 4096


@dataclass(slots=True)
class _Address:
    failures: int = 0
    last: float = 0.0
    until: float = 0.0


class Throttle:
    """After ``FREE`` wrong passwords each further one doubles the pause in which no login of this address is
    even looked at. One that is right ends it."""

    def __init__(self) -> None:
        self._addresses: dict[str, _Address] = {}

    def __len__(self) -> int:
        return len(self._addresses)

    def pause_s(self, address: str, now: float) -> float:
        """How long this address has to wait; 0 where it may try."""
        known = self._addresses.get(address)
        return max(0.0, known.until - now) if known else 0.0

    def failed(self, address: str, now: float) -> None:
        known = self._addresses.setdefault(address, _Address())
        if now > known.last + FORGOTTEN_S:
            known.failures = 0
        known.failures += 1
        known.last = now
        over = known.failures - FREE
        if over > 0:
            known.until = now + min(FIRST_PAUSE_S * 2 ** (over - 1), LONGEST_PAUSE_S)
        self._make_room()

    def succeeded(self, address: str) -> None:
        self._addresses.pop(address, None)

    def _make_room(self) -> None:
        while len(self._addresses) > _MOST:
            self._addresses.pop(min(self._addresses, key=lambda one: self._addresses[one].last))
