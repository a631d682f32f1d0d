"""Events into the log: every one that matters, and the ones that repeat at most once a minute."""

from __future__ import annotations

import logging
from typing import Final

from bridge.command import Event, Kind

_log = logging.getLogger("bridge.events")

_PAUSE_S: Final = 60.0
_MOST_KEYS: Final = 1000
_REPEATING: Final = frozenset((Kind.REFUSED, Kind.CONFIGURATION))


class EventLog:
    """A listener for the plant's events."""

    def __init__(self) -> None:
        self._told: dict[tuple[str, Kind], tuple[float, int]] = {}

    def __call__(self, event: Event) -> None:
        suppressed = 0
        if event.kind in _REPEATING:
            key = (event.source, event.kind)
            told_at, suppressed = self._told.get(key, (float("-inf"), 0))
            if event.time - told_at < _PAUSE_S:
                self._told[key] = (told_at, suppressed + 1)
                return
            if len(self._told) >= _MOST_KEYS:
                self._told.clear()
            self._told[key] = (event.time, 0)
        more = f" ({suppressed} more of this kind since)" if suppressed else ""
        _log.log(_level(event.severity), "%s: %s%s", event.source, event.message, more)


def _level(severity: int) -> int:
    """Severities are OPC UA's: 1 … 1000."""
    if severity >= 700:
        return logging.ERROR
    return logging.WARNING if severity >= 300 else logging.INFO
