"""Times at which requests came: they may wait here, or in what they are for."""

from __future__ import annotations

from contextvars import ContextVar
from typing import Final, Protocol

NEVER: Final = float("-inf")
"""The time of a request that may have waited for any time."""

received_at: ContextVar[float | None] = ContextVar("received_at", default=None)
"""Earliest time at which the message whose service is being carried out can have come; None for just now."""


class Arrivals(Protocol):
    """Times of what comes through one connection."""

    def arrive(self, *, crowded: bool) -> float:
        """Earliest time at which what was read just now can have come, or ``NEVER``. ``crowded``: more may be
        left, or more is under way than there should be."""
        ...
