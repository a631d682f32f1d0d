"""Signs that two devices share one node id. Sans-IO: gets what the node sends, with time stamps."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

_WINDOW: Final = 20
"""Heartbeats that are counted together."""
_TOO_SOON: Final = 0.7
"""A window that takes less than this share of the expected time had more than one producer."""
_TURNS: Final = 8
"""No single device changes its state this often within one window."""
_EXTRA_REPLIES: Final = 3
_FORGET_S: Final = 60.0
_TOGETHER_S: Final = 0.05
"""Two devices answer one request within this time; anything later is a late answer."""
_FOREIGN_S: Final = 2.0
"""For this long after another client's request, an answer may belong to that client."""


@dataclass(frozen=True, slots=True)
class StateChanges:
    """The heartbeat changed the state so often within so many messages."""

    changes: int
    messages: int


@dataclass(frozen=True, slots=True)
class TooManyHeartbeats:
    """So many came within a shorter time than expected."""

    count: int
    took_s: float
    expected_s: float


@dataclass(frozen=True, slots=True)
class AnsweredTwice:
    """So many SDO requests were."""

    requests: int


DuplicateSign = StateChanges | TooManyHeartbeats | AnsweredTwice


class DuplicateCheck:
    """Watches one node id. Each method returns what is wrong, or None."""

    def __init__(self) -> None:
        self.period_s: float | None = None
        """The node's heartbeat period as the boot-up left it; None if it sends none."""
        self._last_reply = b""
        self._last_reply_at = float("-inf")
        self._foreign_at = float("-inf")
        self._extra = 0
        self._extra_since = float("-inf")
        self.restart()

    def restart(self) -> None:
        """Start counting again: the node has restarted, or its period has changed."""
        self._begin: float | None = None
        self._count = 0
        self._changes = 0
        self._state = -1

    def on_heartbeat(self, state: int, time: float) -> DuplicateSign | None:
        """A heartbeat; a boot-up message goes to ``restart``."""
        if self.period_s is None:
            return None
        if self._begin is None:
            self._begin, self._state = time, state
            return None
        self._count += 1
        if state != self._state:
            self._state = state
            self._changes += 1
        if self._count < _WINDOW:
            return None
        took_s, changes, expected_s = time - self._begin, self._changes, _WINDOW * self.period_s
        self.restart()
        if changes >= _TURNS:
            return StateChanges(changes, _WINDOW)
        if took_s < _TOO_SOON * expected_s:
            return TooManyHeartbeats(_WINDOW, took_s, expected_s)
        return None

    def on_foreign_request(self, time: float) -> None:
        """An SDO request that is not ours."""
        self._foreign_at = time

    def on_reply(self, data: bytes, time: float, *, matched: bool) -> DuplicateSign | None:
        """An SDO answer; ``matched`` if it belongs to a request of ours. The caller leaves out late answers
        to our requests."""
        if matched:
            self._last_reply, self._last_reply_at = data[1:4], time
            return None
        if len(data) != 8 or data[1:4] != self._last_reply or time - self._last_reply_at > _TOGETHER_S:
            return None
        if time - self._foreign_at < _FOREIGN_S:
            return None
        if time - self._extra_since > _FORGET_S:
            self._extra, self._extra_since = 0, time
        self._extra += 1
        if self._extra < _EXTRA_REPLIES:
            return None
        self._extra = 0
        return AnsweredTwice(_EXTRA_REPLIES)
