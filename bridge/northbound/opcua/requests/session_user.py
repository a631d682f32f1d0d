"""User of a session, as the bridge knows him."""

from __future__ import annotations

from dataclasses import dataclass

from bridge.command.messages.request import Identity
from bridge.northbound.passwords import ANONYMOUS


@dataclass(frozen=True, slots=True)
class SessionUser:
    """User of a session; ``identity`` names the session as its connection.
    ``encrypted`` says whether its channel is."""

    identity: Identity
    encrypted: bool = False

    @property
    def name(self) -> str:
        return self.identity.user

    @property
    def is_anonymous(self) -> bool:
        return self.identity.user == ANONYMOUS

    @property
    def rank(self) -> int:
        return int(self.identity.role)

    def is_same(self, other: object) -> bool:
        return isinstance(other, SessionUser) and self.identity.is_same(other.identity)
