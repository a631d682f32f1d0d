"""Gets that take long, and whose turn it is. Sans-IO."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import Final, Generic, TypeVar

AT_ONCE: Final = 16
"""Gets across drives that are answered at the same time."""
_SLOW_S: Final = 5.0
"""After this time one of them makes room for another."""

Get = TypeVar("Get")


@dataclass(frozen=True, slots=True)
class _Answered(Generic[Get]):
    get: Get
    asker: str
    since: float


class Gets(Generic[Get]):
    """Gets that are being answered. Whoever has the most of them makes room for who has at least two less,
    and one that is read slowly for anybody; so no asker keeps another waiting, and each gets the same share.

    ``asker`` is what the client's zenoh session says it is. One that lies shares its turns with another, or
    has more of them: as many as it may open sessions.
    """

    def __init__(self) -> None:
        self._answered: list[_Answered[Get]] = []
        """The oldest first."""

    @property
    def all(self) -> tuple[Get, ...]:
        return tuple(one.get for one in self._answered)

    def has_room(self, asker: str, now: float) -> bool:
        """True where one more of ``asker`` may be added."""
        return len(self._answered) < AT_ONCE or self._ending(asker, now) is not None

    def add(self, get: Get, asker: str, now: float) -> Get | None:
        """Add a get where there is room. Returns the one that has to end for it, which is forgotten."""
        ending = self._ending(asker, now) if len(self._answered) >= AT_ONCE else None
        if ending:
            self._answered.remove(ending)
        self._answered.append(_Answered(get, asker, now))
        return ending.get if ending else None

    def done(self, get: Get) -> None:
        """Remove a get, which may have been forgotten already."""
        self._answered = [one for one in self._answered if one.get != get]

    def _ending(self, asker: str, now: float) -> _Answered[Get] | None:
        counts = Counter(one.asker for one in self._answered)
        greediest, most = counts.most_common(1)[0]
        if most >= counts[asker] + 2:
            return next(one for one in self._answered if one.asker == greediest)
        oldest = self._answered[0]
        return oldest if now - oldest.since >= _SLOW_S else None
