"""Connections to our port that do not become a session. Sans-IO."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Final

PATIENCE_S: Final = 2.0
"""Longer than a connection may take to become a session (``zenoh_config.py``)."""
_MORE: Final = re.compile(r"%[^\]]*|[?#].*")


class Strangers:
    """Places are the remote ends of connections, ``10.0.0.1:40000`` or ``[fe80::1]:40000``. ``came`` may be
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
        """Strangers whose time is up, each once."""
        gone = [place for place, since in tuple(self._waiting.items()) if now - since >= PATIENCE_S]
        for place in gone:
            self._waiting.pop(place, None)
        return [place for place in gone if place not in self._links]


def _bare(place: str) -> str:
    """Without zenoh's link type and the interface of an IPv6 address, which is a name in one place and a
    number in the other."""
    return _MORE.sub("", place)
