"""What was wrong and is over: a fault that comes and goes leaves a trace. Sans-IO, times in ms since 1970."""

from __future__ import annotations

from typing import Any, Final

KEPT_MS: Final = 600_000.0
_MOST: Final = 50
_Key = tuple[str, str]


class Recent:
    """Troubles that have ended in the last ten minutes, each kind at each place once."""

    def __init__(self) -> None:
        self._present: dict[_Key, dict[str, Any]] = {}
        self._ended: dict[_Key, dict[str, Any]] = {}

    def see(self, troubles: list[dict[str, Any]], now_ms: float) -> None:
        """``troubles`` is all that is wrong now, as ``Troubles`` says it."""
        present = {(one["kind"], one["place"]): one for one in troubles}
        for key, one in self._present.items():
            if key not in present:
                times = self._ended.pop(key, {"times": 0})["times"] + 1
                self._ended[key] = {**one, "until": round(now_ms), "times": times}
        self._present = present
        for key in [key for key, one in self._ended.items() if now_ms - one["until"] >= KEPT_MS]:
            del self._ended[key]
        while len(self._ended) > _MOST:
            del self._ended[next(iter(self._ended))]

    @property
    def shown(self) -> list[dict[str, Any]]:
        """For JSON: those that are not back, as troubles with ``until``, and ``times`` how often they ended;
        the latest first."""
        return [one for key, one in reversed(self._ended.items()) if key not in self._present]
