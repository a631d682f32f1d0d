"""The earliest time at which each client's commands can have arrived: zenoh's connections cannot be seen."""

from __future__ import annotations

from collections import deque
from typing import Final

from bridge.command.messages.freshness import Inflow, LoopPulse

_MOST: Final = 256
"""Clients that are remembered; the one that has been silent longest is forgotten first."""
_MOST_UNDER_WAY: Final = 64
"""A client that waits for its answers has no more commands than this under way."""


class _Asker:
    def __init__(self, now: float, look: LoopPulse) -> None:
        self.inflow = Inflow(now, look, is_hidden=True)
        self.handled: deque[float] = deque(maxlen=_MOST_UNDER_WAY)


class Askers:
    """Sans-IO; times are monotonic seconds."""

    def __init__(self) -> None:
        self._askers: dict[str, _Asker] = {}

    def arrival(self, name: str, received_at: float, now: float, look: LoopPulse) -> float:
        """The earliest arrival of a command of ``name`` that zenoh handed over at ``received_at`` and that is
        handled ``now``. To be called in the order of each client's commands."""
        asker = self._askers.pop(name, None) or _Asker(received_at, look)
        self._askers[name] = asker
        if len(self._askers) > _MOST:
            del self._askers[next(iter(self._askers))]
        handled = asker.handled
        # The command that many before it was still waiting when this one came.
        crowded = len(handled) == _MOST_UNDER_WAY and handled[0] > received_at
        handled.append(now)
        # The loop may have polled since: the poll before this command arrived is the one that counts.
        seen = LoopPulse(min(look.at, received_at), look.steady_since)
        return asker.inflow.arrive(received_at, seen, crowded=crowded)
