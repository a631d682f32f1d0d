"""Cyclic events: one that must not stay away, and one that is sent."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

FAILED: Final = 250
NO_RESPONSE: Final = 255


class SignWatch:
    """Watch over a sign: from the first one on, the next must come within ``time_s``. With 0 nothing is
    watched."""

    def __init__(self, time_s: Callable[[], float]) -> None:
        self._time_s = time_s
        self._since: float | None = None
        self.tripped = False

    def start(self, now: float) -> None:
        """A sign has come; it also ends a trip."""
        self._since, self.tripped = now, False

    def stop(self) -> None:
        self._since, self.tripped = None, False

    def expired(self, now: float) -> bool:
        """True once when the time has run out."""
        deadline = self.next_deadline()
        if deadline is None or now < deadline:
            return False
        self._since, self.tripped = None, True
        return True

    def next_deadline(self) -> float | None:
        if self._since is None:
            return None
        time_s = self._time_s()
        return self._since + time_s if time_s else None


class HeartbeatWatch(SignWatch):
    """1016h: one producer is watched, from its first heartbeat or boot-up on (CiA 301 §7.5.2.19)."""

    def __init__(self, node: Callable[[], int], time_ms: Callable[[], int]) -> None:
        super().__init__(lambda: time_ms() / 1000 if node() else 0.0)
        self._node = node
        self._time_ms = time_ms
        self.status = NO_RESPONSE
        """The producer's NMT state, or that it has failed or was never heard."""

    @property
    def node(self) -> int:
        """The watched node, 0 for none."""
        return self._node() if self._time_ms() else 0

    def stop(self) -> None:
        super().stop()
        self.status = NO_RESPONSE

    def on_heartbeat(self, data: bytes, now: float) -> bool:
        """True if the producer is back."""
        if len(data) != 1:
            return False
        was_lost, self.status = self.tripped, data[0] & 0x7F
        self.start(now)
        return was_lost

    def expired(self, now: float) -> bool:
        is_over = super().expired(now)
        if is_over:
            self.status = FAILED
        return is_over


class Cycle:
    """Cycle in which something is sent every ``period_s``; 0 is never."""

    def __init__(self, period_s: Callable[[], float]) -> None:
        self._wanted_s = period_s
        self._period_s = 0.0
        self._at = 0.0

    def reset(self) -> None:
        self._period_s = 0.0

    def due(self, now: float) -> bool:
        """Whether it is to be sent now. After a pause it is sent once; missed ones are skipped."""
        period_s = self._wanted_s()
        if period_s != self._period_s:  # just written: the new period begins now
            self._period_s, self._at = period_s, now + period_s
            return False
        if not period_s or now < self._at:
            return False
        self._at += period_s
        if self._at <= now:
            self._at = now + period_s
        return True

    def next_deadline(self) -> float | None:
        return self._at if self._period_s else None
