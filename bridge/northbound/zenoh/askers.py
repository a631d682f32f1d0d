"""When the commands of each asker can have come: zenoh's connections cannot be seen from here."""

from __future__ import annotations

from collections import deque
from typing import Final

from bridge.command.freshness import Inflow, Look

_MOST: Final = 256
"""Askers that are kept in mind; who has not asked for the longest time is forgotten first."""
_MOST_UNDER_WAY: Final = 64
"""Commands that an asker which waits for its answers has under way at most."""


class _Asker:
    def __init__(self, now: float, look: Look) -> None:
        self.inflow = Inflow(now, look, is_hidden=True)
        self.handled: deque[float] = deque(maxlen=_MOST_UNDER_WAY)


class Askers:
    """Pure: times are monotonic seconds."""

    def __init__(self) -> None:
        self._askers: dict[str, _Asker] = {}

    def arrival(self, name: str, received_at: float, now: float, look: Look) -> float:
        """When the command of ``name`` that zenoh handed over at ``received_at``, and that is handled
        ``now``, can have come at the earliest. Each asker's commands are asked about in their order."""
        asker = self._askers.pop(name, None) or _Asker(received_at, look)
        self._askers[name] = asker
        if len(self._askers) > _MOST:
            del self._askers[next(iter(self._askers))]
        handled = asker.handled
        # The one so many before it was still waiting when this came.
        crowded = len(handled) == _MOST_UNDER_WAY and handled[0] > received_at
        handled.append(now)
        # The loop may have looked since: what this is told by is the look before it came.
        seen = Look(min(look.at, received_at), look.steady_since)
        return asker.inflow.arrive(received_at, seen, crowded=crowded)
