"""How long a node waits for its next boot-up: longer after each one that failed or did not last. Pure."""

from __future__ import annotations

from typing import Final

from bridge.base.ratelimit import Pauses
from bridge.text import Text

BETWEEN_BOOTS_S: Final = 0.2
_FIRST_S: Final = 1.0
_LAST_S: Final = 10.0
_LAST_UNUSABLE_S: Final = 300.0
"""A node that is there and cannot be used: what has to change is its configuration or the site file, and
each attempt may cost it writes."""
_STEADY_S: Final = 30.0
"""Who has been in operation for so long begins anew."""
_MANY: Final = 3


class BackOff:
    """Of one node. ``lost`` and ``failed`` give the seconds until it is booted again."""

    def __init__(self) -> None:
        self._since = float("-inf")
        self._pauses = Pauses()
        self.reset()

    def reset(self) -> None:
        """The node has started, or an operator wants it now."""
        self.pause_s = _FIRST_S
        self.between_boots_s = BETWEEN_BOOTS_S
        """The least time from one boot-up to the next, where the node is heard again meanwhile."""
        self._losses = 0
        self.steady_at: float | None = None
        """When a node that was lost again and again is believed to stay."""

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
        """A boot-up has failed; ``absent`` where the node did not answer."""
        return self._take(_LAST_S if absent else _LAST_UNUSABLE_S)

    def _take(self, most_s: float) -> float:
        pause_s = min(self.pause_s, most_s)
        self.pause_s = min(2 * pause_s, most_s)
        return pause_s

    @property
    def is_flapping(self) -> bool:
        """Lost again and again soon after each boot-up: not every time is told."""
        return self._losses >= _MANY

    def report(self, now: float) -> Text | None:
        """What to tell of a node that flaps, once a minute."""
        if not self.is_flapping or self._pauses.take(now) is None:
            return None
        return Text.of("node.lost_again", times=self._losses)
