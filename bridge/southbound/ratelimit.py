"""How often something may be told: a bucket of tokens that fills with time."""

from __future__ import annotations


class RateLimit:
    """At most ``burst`` at once and one every ``every_s`` seconds after that."""

    __slots__ = ("_burst", "_every_s", "_filled_at", "_tokens")

    def __init__(self, burst: int, every_s: float) -> None:
        self._burst = burst
        self._every_s = every_s
        self._tokens = float(burst)
        self._filled_at: float | None = None

    def allows(self, now: float) -> bool:
        """Take a token, if there is one."""
        if self._filled_at is not None:
            fill = max(0.0, now - self._filled_at) / self._every_s
            self._tokens = min(float(self._burst), self._tokens + fill)
        self._filled_at = now
        if self._tokens < 1:
            return False
        self._tokens -= 1
        return True
