"""Delay before a node's next boot-up: longer after each one that failed or did not last. Pure."""

from __future__ import annotations

from typing import Final

from bridge.base.ratelimit import Pauses
from bridge.text import Text

BETWEEN_BOOTS_S: Final = 0.2
_FIRST_S: Final = 1.0
_LAST_S: Final = 10.0
_LAST_UNUSABLE_S: Final = 300.0
"""Longest delay for a node that answers and cannot be used: its configuration or the site file has to change,
and each attempt may cost it EEPROM writes."""
_STEADY_S: Final = 30.0
"""Time in operation after which the delays start over."""
_MANY: Final = 3


class BackOff:
    """Delays of one node. ``lost`` and ``failed`` return the seconds until its next boot-up."""

    def __init__(self) -> None:
        self._since = float("-inf")
        self._pauses = Pauses()
        self.reset()

    def reset(self) -> None:
        """Start over: the node has restarted, or an operator wants it now."""
        self.pause_s = _FIRST_S
        self.between_boots_s = BETWEEN_BOOTS_S
        """Minimum time between two boot-ups of a node that is heard again in between, in seconds."""
        self._losses = 0
        self.steady_at: float | None = None
        """Time at which a flapping node counts as stable; None unless one is in operation."""

    def entered_operation(self, now: float) -> None:
        self._since = now
        self.steady_at = now + _STEADY_S if self.is_flapping else None

    def lost(self, now: float) -> float:
        if now - self._since >= _STEADY_S:
            self.reset()
        self._losses += 1
        pause_s = self._take(_LAST_S)
        if self._losses > 1:
            self.between_boots_s = pause_s
        self.steady_at = None
        return pause_s

    def failed(self, *, absent: bool) -> float:
        """Seconds until the next boot-up after a failed one; ``absent`` where the node did not answer."""
        return self._take(_LAST_S if absent else _LAST_UNUSABLE_S)

    def _take(self, most_s: float) -> float:
        pause_s = min(self.pause_s, most_s)
        self.pause_s = min(2 * pause_s, most_s)
        return pause_s

    @property
    def is_flapping(self) -> bool:
        """True if the node is lost repeatedly, soon after each boot-up: not every loss is reported."""
        return self._losses >= _MANY

    def report(self, now: float) -> Text | None:
        """Report of a node that flaps, at most once a minute; None if there is none."""
        if not self.is_flapping or self._pauses.take(now) is None:
            return None
        return Text.of("node.lost_again", times=self._losses)
