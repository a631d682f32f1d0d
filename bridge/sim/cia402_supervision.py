"""How the simulated CiA 402 drive watches its master: the heartbeat consumer (1016h, CiA 301 §7.5.2.19)."""

from __future__ import annotations

from collections.abc import Callable

_NODE_MAX = 127


def is_consumer_entry(value: int) -> bool:
    """Whether 1016h:1 may hold this: node id in bits 16 … 22, time in the low word."""
    return value >> 16 <= _NODE_MAX


class HeartbeatConsumer:
    """Watches one producer from its first heartbeat on. ``entry`` is 1016h:1 as it is now."""

    def __init__(self, entry: Callable[[], int]) -> None:
        self._entry = entry
        self._heard_at: float | None = None
        self.is_lost = False

    @property
    def node(self) -> int:
        """The watched node, 0 for none."""
        entry = self._entry()
        return entry >> 16 & _NODE_MAX if entry & 0xFFFF else 0

    def reset(self) -> None:
        self._heard_at, self.is_lost = None, False

    def on_heartbeat(self, data: bytes, now: float) -> bool:
        """True if the producer is back."""
        if len(data) != 1:
            return False
        was_lost, self.is_lost, self._heard_at = self.is_lost, False, now
        return was_lost

    def expired(self, now: float) -> bool:
        """True once when the producer has been silent for too long."""
        deadline = self.next_deadline()
        if deadline is None or now < deadline:
            return False
        self._heard_at, self.is_lost = None, True
        return True

    def next_deadline(self) -> float | None:
        if self._heard_at is None or not self.node:
            return None
        return self._heard_at + (self._entry() & 0xFFFF) / 1000
