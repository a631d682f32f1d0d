"""Connections to our port that come to no session. Sans-IO."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Final

PATIENCE_S: Final = 2.0
"""More than a connection is given to come to a session (``settings.py``)."""
_MORE: Final = re.compile(r"%[^\]]*|[?#].*")


class Strangers:
    """Places are the other ends of connections, ``10.0.0.1:40000`` or ``[fe80::1]:40000``. ``came`` may be
    called from another thread."""

    def __init__(self) -> None:
        self._links: set[str] = set()
        self._waiting: dict[str, float] = {}

    def came(self, place: str) -> None:
        """A session has a connection to this place."""
        place = _bare(place)
        self._links.add(place)
        self._waiting.pop(place, None)

    def went(self, place: str) -> None:
        self._links.discard(_bare(place))

    def on_connections(self, places: Iterable[str], now: float) -> None:
        """These are new."""
        self._waiting |= dict.fromkeys({_bare(place) for place in places} - self._links, now)

    def take(self, now: float) -> list[str]:
        """Those that have had their time, each once."""
        gone = [place for place, since in tuple(self._waiting.items()) if now - since >= PATIENCE_S]
        for place in gone:
            self._waiting.pop(place, None)
        return [place for place in gone if place not in self._links]


def _bare(place: str) -> str:
    """Without what zenoh says of a link, and the interface of an IPv6 address, which has a name here and a
    number there."""
    return _MORE.sub("", place)
