"""Limits of repeated reports: events that anybody can cause at will must not fill a disk. Sans-IO."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass
from typing import Final, Generic, TypeVar

Item = TypeVar("Item")

PAUSE_S: Final = 60.0
_MOST_SOURCES: Final = 200
"""Sources of each kind: a bus has no more nodes. Further ones count as one."""
_MOST_KINDS: Final = 200


class RateLimit:
    """At most ``burst`` at once and one every ``every_s`` seconds after that."""

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

    def charge(self, count: int) -> None:
        """Take so many tokens for what was reported anyway; those that come next pay for it."""
        self._tokens -= count


class PerSecond:
    """At most ``most`` within a second, which begins with the first of them."""

    def __init__(self, most: int) -> None:
        self._most = most
        self._begin = float("-inf")
        self._count = 0

    def allows(self, now: float) -> bool:
        if now - self._begin >= 1.0:
            self._begin, self._count = now, 0
        self._count += 1
        return self._count <= self._most


class Pauses:
    """Admits one of each key, and no other of that key for ``pause_s``."""

    def __init__(self, pause_s: float = PAUSE_S) -> None:
        self._pause_s = pause_s
        self._told: dict[Hashable, tuple[float, int]] = {}

    def take(self, now: float, key: Hashable = None) -> int | None:
        """None if this one is left out; else how many were left out since the last one."""
        at, left_out = self._told.get(key, (float("-inf"), 0))
        if now - at < self._pause_s:
            self._told[key] = at, left_out + 1
            return None
        self._told[key] = now, 0
        return left_out

    def end(self, key: Hashable = None) -> int:
        """The one that has just been left out is told after all: how many were left out before it. Another
        pause does not begin with it."""
        at, left_out = self._told[key]
        self._told[key] = at, 0
        return left_out - 1


@dataclass(slots=True)
class _LimitState(Generic[Item]):
    """State of one kind and source since ``at``: ``lines`` is the number of those reported, ``last`` the
    newest of those that were not."""

    at: float
    lines: int = 1
    left_out: int = 0
    last: Item | None = None


class Repeats(Generic[Item]):
    """Reports the first of each kind and source, then only their number: once every ``PAUSE_S``, as long as
    there are more."""

    def __init__(self) -> None:
        self._told: dict[Hashable, dict[Hashable, _LimitState[Item]]] = {}

    def admits(self, kind: Hashable, source: Hashable, item: Item, now: float, first: int = 1) -> bool:
        """Whether ``item`` is reported now, as one of the ``first``; else it is counted."""
        if kind not in self._told and len(self._told) >= _MOST_KINDS:
            self._forget(now)
            kind = kind if len(self._told) < _MOST_KINDS else None
        sources = self._told.setdefault(kind, {})
        if source not in sources and len(sources) >= _MOST_SOURCES:
            source = None
        told = sources.get(source)
        if told is None or self._is_over(told, now):
            sources[source] = _LimitState(now)
            return True
        if told.lines < first:
            told.lines += 1
            return True
        told.left_out += 1
        told.last = item
        return False

    def due(self, now: float) -> list[tuple[Item, int]]:
        """The last of each that was left out, with their number, if a report is due by ``now``."""
        self._forget(now)
        found: list[tuple[Item, int]] = []
        for sources in self._told.values():
            for source, told in sources.items():
                if told.last is not None and now - told.at >= PAUSE_S:
                    found.append((told.last, told.left_out))
                    sources[source] = _LimitState(now)
        return found

    def _is_over(self, told: _LimitState[Item], now: float) -> bool:
        return told.last is None and now - told.at >= PAUSE_S

    def _forget(self, now: float) -> None:
        """Forget those of which there were no more."""
        for kind, sources in list(self._told.items()):
            for source in [source for source, told in sources.items() if self._is_over(told, now)]:
                del sources[source]
            if not sources:
                del self._told[kind]

    def next_due(self) -> float | None:
        """Time of the next report; None if nothing was left out."""
        waiting = (told.at for sources in self._told.values() for told in sources.values() if told.left_out)
        first = min(waiting, default=None)
        return None if first is None else first + PAUSE_S
