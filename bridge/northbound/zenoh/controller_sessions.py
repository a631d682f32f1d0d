"""Sessions of controllers: which one asks, and that it has ended. zenoh itself does not tell. Sans-IO."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from bridge.command import Identity

UNNAMED: Final = "unnamed session"
"""All sessions of one name that do not tell themselves apart."""
_MOST: Final = 256
"""Sessions that are remembered; the one that has asked least recently is forgotten first."""


class ControllerSessions:
    """Sessions that have asked."""

    def __init__(self) -> None:
        self._seen: dict[tuple[str, str], Identity] = {}

    def of(self, identity: Identity, source: str) -> Identity:
        """``identity`` with the session that its attachment names, or else ``source``, the id of the zenoh
        session that the query gives as its own."""
        name = identity.connection or (f"session {source}" if source else UNNAMED)
        identity = replace(identity, connection=name)
        key = identity.user, name
        self._seen.pop(key, None)
        self._seen[key] = identity
        if len(self._seen) > _MOST:
            del self._seen[next(iter(self._seen))]
        return identity

    def ended(self, source: str) -> list[tuple[Identity, bool]]:
        """Identities of this session, each with whether the same user has been heard over others."""
        name = f"session {source}"
        gone = [self._seen.pop(key) for key in list(self._seen) if key[1] == name]
        return [(one, any(one.user == user for user, _ in self._seen)) for one in gone]
