"""Detection of a suspended machine: CLOCK_BOOTTIME goes on then and CLOCK_MONOTONIC does not. Sans-IO."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

_NOTICEABLE_S: Final = 0.01


class SuspendWatch:
    """Watch for suspensions. ``look`` gives a lower and an upper bound, in seconds, of how long the machine
    has been suspended since it was booted: two clocks cannot be read at once, and the process may be delayed
    between them."""

    def __init__(self, look: Callable[[], tuple[float, float]]) -> None:
        self._look = look
        self._at_most = look()[1]

    def take(self) -> float:
        """Seconds for which it was suspended since the last call; 0 for none."""
        at_least, at_most = self._look()
        slept_s = at_least - self._at_most
        if slept_s > _NOTICEABLE_S:
            self._at_most = at_most
            return slept_s
        self._at_most = min(self._at_most, at_most)
        return 0.0
