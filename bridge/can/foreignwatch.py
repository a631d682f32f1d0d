"""Frames of others on the bridge's own identifiers, received by a socket of its own.

All our own frames come back there, so it wakes nobody: it is polled a hundred times a second, and five times
as often while somebody is there.
"""

from __future__ import annotations

import socket
import time
from typing import Final

from bridge.can.cansockets import CanSockets
from bridge.can.ownframes import OwnFrames
from bridge.can.receiver import BATCH, Stamps, WatchReceiver
from bridge.canopen.frame import Frame

LOOK_S: Final = 0.01
_LOOK_AGAIN_S: Final = 0.002
"""While somebody is there: the answer is to be as fast as its frames."""
_ALERT_S: Final = 1.0
_MOST_PER_LOOK: Final = 1024


class ForeignWatch:
    """``own`` is told of everything that we send. Times are monotonic seconds."""

    def __init__(self, sockets: CanSockets) -> None:
        self.own = OwnFrames()
        self._sockets = sockets
        self._can_ids: frozenset[int] = frozenset()
        self._socket: socket.socket | None = None
        self._receiver: WatchReceiver | None = None
        self._looked_at = 0.0
        self._found_at = float("-inf")

    def __contains__(self, can_id: int) -> bool:
        return can_id in self._can_ids

    def watch(self, can_ids: frozenset[int]) -> None:
        """Look at these from now on."""
        if can_ids != self._can_ids:
            self._can_ids = can_ids
            if self._socket:
                self._sockets.let_in(can_ids, self._socket)

    def open(self, now: float) -> None:
        """Raises OSError."""
        self._socket = self._sockets.watching(self._can_ids)
        self._receiver = WatchReceiver(self._socket)
        self._looked_at = now

    def close(self) -> None:
        self._receiver = None
        if self._socket:
            self._socket.close()
            self._socket = None

    def next_deadline(self) -> float | None:
        return self._looked_at + self._pause_s if self._receiver and self._can_ids else None

    @property
    def _pause_s(self) -> float:
        return _LOOK_AGAIN_S if self._looked_at < self._found_at + _ALERT_S else LOOK_S

    def take(self, now: float, *, at_once: bool = False) -> list[Frame]:
        """Frames of others since the last poll, if one is due or ``at_once``."""
        frames: list[Frame] = []
        is_due = at_once or now >= self._looked_at + self._pause_s
        if self._receiver is None or not is_due:
            return frames
        stamps = Stamps(now - time.time(), self._looked_at, now)
        self._looked_at = now
        try:
            for _ in range(_MOST_PER_LOOK // BATCH):
                if self._receiver.receive(frames, stamps, self.own.is_own) < BATCH:
                    break
        except OSError:
            # The interface is gone, and the socket that everything else comes from says so, too.
            pass
        # The filter may be wider than what was asked for.
        found = [frame for frame in frames if frame.can_id in self._can_ids]
        if found:
            self._found_at = now
        return found
