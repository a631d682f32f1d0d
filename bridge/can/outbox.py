"""Frames for which the kernel had no room: sent in order when it has, never after their deadlines."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Final

from bridge.canopen.frame import Frame

_MOST_WAITING: Final = 512
_RETRY_S: Final = 0.001


class Outbox:
    """Times are monotonic seconds. ``retry_at`` is when ``send`` is worth a try; None: nothing waits."""

    def __init__(self) -> None:
        self.retry_at: float | None = None
        self._waiting: deque[tuple[Frame, float]] = deque()

    def __len__(self) -> int:
        return len(self._waiting)

    def put(self, frame: Frame, now: float, deadline: float) -> bool:
        """False where too many wait already."""
        if len(self._waiting) >= _MOST_WAITING:
            return False
        self._waiting.append((frame, deadline))
        if self.retry_at is None:
            self.retry_at = now + _RETRY_S
        return True

    def send(self, now: float, try_send: Callable[[Frame, float], bool]) -> int:
        """Hand to ``try_send`` what it takes; gives the number of frames whose time was over.

        ``try_send`` may ``clear`` the outbox: the bus may break while it sends.
        """
        expired = 0
        while self._waiting:
            frame, deadline = self._waiting[0]
            if now > deadline:
                expired += 1
            elif not try_send(frame, now):
                self.retry_at = now + _RETRY_S if self._waiting else None
                return expired
            self._waiting.popleft()
        self.retry_at = None
        return expired

    def clear(self) -> int:
        """Drop everything; gives how many there were."""
        dropped = len(self._waiting)
        self._waiting.clear()
        self.retry_at = None
        return dropped
