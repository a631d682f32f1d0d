"""Whether the bridge may act on a bus, or listens because another bridge may be in charge. Sans-IO."""

from __future__ import annotations

import random
from collections.abc import Callable
from enum import Enum
from typing import Final

from bridge.config import BusTable

_SHORTEST_S: Final = 0.2
_LONGEST_S: Final = 1.0
_PERIODS: Final = 2
_SILENCE: Final = 3
"""Listening times of silence after which a bridge in charge is gone."""


class BusRole(Enum):
    """Role of the bridge on a bus."""

    LISTENING = "listens before it begins"
    PASSIVE = "leaves the bus to another bridge"
    ACTING = "acts"


def listen_s(bus: BusTable) -> float:
    """Listening time in seconds: two periods of what another bridge with this site file would send."""
    longest_s = max(bus.heartbeat_ms / 1000, bus.rpdo_period_s)
    return min(max(_PERIODS * longest_s, _SHORTEST_S), _LONGEST_S)


class Standby:
    """Role of this bridge by what it hears of another. One that has been acting for less than its listening
    time gives way to another that acts: both may have begun at the same moment, or this one was away while
    the other took over. One that has acted for longer stays.

    ``spread`` gives a random number from 0 to 1, so that two that have given way to each other begin again at
    different times.
    """

    def __init__(self, listen_s: float, spread: Callable[[], float] = random.random) -> None:
        self.listen_s = listen_s
        self.silence_s = 0.0
        """Silence of the other bridge, in seconds, after which this one acts: three to six times
        ``listen_s``."""
        self.part = BusRole.LISTENING if listen_s else BusRole.ACTING
        self._spread = spread
        self._until: float | None = None
        """Time at which it acts unless it hears something before; None where that is not known yet."""
        self._acts_since = float("-inf")
        self._is_gone = False

    @property
    def acts(self) -> bool:
        return self.part is BusRole.ACTING

    def heard(self, now: float) -> bool:
        """Take a sign of a bridge in charge; True if that is new and this one gives way. While this one acts,
        call it only for signs that certainly come from a bridge."""
        is_new = not self.is_passive
        if self.acts and now >= self._acts_since + self.listen_s:
            return False
        if is_new:
            self.part = BusRole.PASSIVE
            self.silence_s = _SILENCE * self.listen_s * (1 + self._spread())
        self._until = now + self.silence_s
        return is_new

    @property
    def is_passive(self) -> bool:
        return self.part is BusRole.PASSIVE

    def on_time(self, now: float) -> bool:
        """True once, when it begins to act."""
        if self.acts or self._is_gone:
            return False
        if self._until is None:
            self._until = now + (self.silence_s if self.is_passive else self.listen_s)
        if now < self._until:
            return False
        self.part = BusRole.ACTING
        self.returns(now)
        return True

    def next_deadline(self) -> float | None:
        if self.acts or self._is_gone:
            return None
        return float("-inf") if self._until is None else self._until

    def returns(self, now: float) -> None:
        """Note that the bridge or its bus was away: another one may have taken over meanwhile."""
        self._acts_since = now

    def bus_is_gone(self) -> None:
        """Stop waiting: the bus cannot be heard now, so silence proves nothing."""
        self._is_gone = True
        self._until = None

    def bus_is_back(self, now: float) -> None:
        """Go on after an outage. A bridge that acts does so at once, with stopped words: listening first
        would delay them."""
        self._is_gone = False
        self.returns(now)
