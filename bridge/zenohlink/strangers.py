"""Connections to our port that come to no session. Sans-IO."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Final

PATIENCE_S: Final = 2.0
"""More than a connection is given to come to a session (``settings.py``)."""
_MORE: Final = re.compile(r"%[^\]]*|[?#].*")


class Strangers:
    """Places are the other ends of connections, ``10.0.0.1:40000`` or ``[fe80::1]:40000``."""

    def __init__(self) -> None:
        self._links: set[str] = set()
        self._waiting: dict[str, float] = {}

    def on_link(self, place: str, *, is_there: bool) -> None:
        """A session has a connection to this place, or has it no longer."""
        place = _bare(place)
        if is_there:
            self._links.add(place)
            self._waiting.pop(place, None)
        else:
            self._links.discard(place)

    def on_connections(self, places: Iterable[str], now: float) -> None:
        """These are new."""
        self._waiting |= dict.fromkeys({_bare(place) for place in places} - self._links, now)

    def take(self, now: float) -> list[str]:
        """Those that have had their time, each once."""
        gone = [place for place, since in self._waiting.items() if now - since >= PATIENCE_S]
        for place in gone:
            del self._waiting[place]
        return gone


def _bare(place: str) -> str:
    """Without what zenoh says of a link, and the interface of an IPv6 address, which has a name here and a
    number there."""
    return _MORE.sub("", place)
