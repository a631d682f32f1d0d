"""Troubles that are over: a fault that comes and goes leaves a trace. Sans-IO, times in ms."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass, replace
from typing import Final

from bridge.condition.causes import Key, TroubleLine

KEPT_MS: Final = 600_000.0
_MOST: Final = 50


@dataclass(frozen=True, slots=True)
class Ended:
    """A trouble that ended ``times`` times, the last time at ``until_ms``, in ms since 1970."""

    shown: TroubleLine
    until_ms: float
    times: int
    forgotten_ms: float
    """Time of the monotonic clock from which it is not shown any more."""


class Recent:
    """Troubles that have ended in the last ten minutes, each kind at each place once."""

    def __init__(self) -> None:
        self._present: dict[Key, TroubleLine] = {}
        self._ended: dict[Key, Ended] = {}

    def see(
        self, troubles: Iterable[TroubleLine], explained: Collection[Key], now_ms: float, epoch_ms: float
    ) -> None:
        """``troubles`` is all that is shown now; what a cause ``explained`` meanwhile has not ended."""
        present = {one.key: one for one in troubles}
        for key, one in self._present.items():
            if key not in present and key not in explained:
                before = self._ended.pop(key, None)
                until_ms = epoch_ms if one.until_ms is None else one.until_ms
                times = before.times + 1 if before else 1
                shown = replace(one, explains=(), until_ms=None)
                self._ended[key] = Ended(shown, until_ms, times, now_ms + KEPT_MS)
        self._present = present
        for key in [key for key, one in self._ended.items() if now_ms >= one.forgotten_ms]:
            del self._ended[key]
        while len(self._ended) > _MOST:
            del self._ended[next(iter(self._ended))]

    @property
    def shown(self) -> list[Ended]:
        """Ended troubles that are not back, the latest first."""
        return [one for key, one in reversed(self._ended.items()) if key not in self._present]
