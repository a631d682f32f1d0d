"""What a front has refused by itself: however fast a client is refused, the bus process hears little of it.

Sans-IO."""

from __future__ import annotations

from typing import Final

from bridge.command import Rejection
from bridge.mirror.protocol import Rejected

_MOST_KINDS: Final = 20
"""Told one by one each time; of what comes on top only how many there were."""
_Kind = tuple[str, str, str, str]


class Rejections:
    """Rejections that wait to be told: the last one of each kind, and how many."""

    def __init__(self) -> None:
        self._waiting: dict[_Kind, Rejected] = {}

    def add(self, rejection: Rejection, now: float) -> None:
        """``now`` in seconds of the monotonic clock."""
        kind = (rejection.identity.user, rejection.target, rejection.action, rejection.code)
        if kind not in self._waiting and len(self._waiting) >= _MOST_KINDS:
            kind = ("", "", "", "")
        before = self._waiting.get(kind)
        self._waiting[kind] = Rejected(now, 1 + (before.count if before else 0), rejection)

    def take(self) -> list[Rejected]:
        """All of them, in the order in which their kinds first came."""
        waiting, self._waiting = self._waiting, {}
        return list(waiting.values())
