"""The server's side of whom it serves: who may log in and do what, and who carries out writes and calls."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar

from cryptography.hazmat.primitives.asymmetric.rsa import RSAPrivateKey

from bridge.uaserver.arrivals import Arrivals
from bridge.uaserver.explanations import Explain, Explanation
from bridge.uaserver.history.history import EventHistory, ValueHistory
from bridge.uaserver.library import ua


class UserIdentity(Protocol):
    """User of a session, as its identity token has told."""

    @property
    def name(self) -> str: ...

    @property
    def is_anonymous(self) -> bool:
        """Anybody can come as this one."""
        ...

    @property
    def rank(self) -> int:
        """Height of its role; 0 may only read. Where there is not room for all, the lowest one yields."""
        ...

    def is_same(self, other: Any) -> bool:
        """The same user, in whatever session."""
        ...


class Nobody:
    """User of a session that was never activated."""

    name = ""
    is_anonymous = True
    rank = -1

    def is_same(self, other: object) -> bool:
        return self is other


NOBODY = Nobody()


@dataclass(frozen=True, slots=True)
class LoginAttempt:
    """Identity token of a session, and the ``signature`` that came with it.

    ``nonce`` is the server's last one to this session, ``key`` and ``certificate``, in DER, are those that
    the server has shown to it; ``encrypted`` says whether the channel is. ``session`` is the session's name.
    """

    token: object
    signature: object
    nonce: bytes
    key: RSAPrivateKey
    certificate: bytes
    address: str
    session: str
    encrypted: bool


U = TypeVar("U", bound=UserIdentity)


class ServedApplication(Protocol[U]):
    """Application that a server serves. Its users are those that ``identify`` gives."""

    async def identify(self, login: LoginAttempt) -> U:
        """Raises ServiceError for who is not let in."""
        ...

    @property
    def highest_rank(self) -> int:
        """Rank that no user exceeds."""
        ...

    def may(self, user: U, where: ua.NodeId) -> bool:
        """Whether this user may write or call ``where``, in so far as roles decide."""
        ...

    def roles(self, user: U) -> Sequence[ua.NodeId]:
        """Role objects of namespace 0 that this user has been granted."""
        ...

    def may_diagnose(self, user: U) -> bool:
        """Whether this user may see the diagnostics of others' sessions."""
        ...

    def refreshable(self, nodes: Iterable[ua.NodeId]) -> Sequence[ua.NodeId]:
        """Nodes of these whose values ``refresh`` can bring, as many as one request may have brought."""
        ...

    async def refresh(
        self, user: U, nodes: Sequence[ua.NodeId]
    ) -> Mapping[ua.NodeId, tuple[ua.StatusCode, Explanation]]:
        """Bring the values of these nodes from where they come from. Returns those that were refused; of one
        that takes too long the value of before stays."""
        ...

    async def write(
        self, user: U, writes: Sequence[ua.WriteValue], explain: Explain
    ) -> list[ua.StatusCode]: ...

    async def call(
        self, user: U, calls: Sequence[ua.CallMethodRequest], explain: Explain
    ) -> list[ua.CallMethodResult]: ...

    def value_history(self, where: ua.NodeId) -> ValueHistory | None:
        """History of a variable; None where it has none."""
        ...

    def event_history(self, where: ua.NodeId) -> EventHistory | None:
        """Past events of an object; None where none are kept."""
        ...

    def on_connection(self, user: U, *, is_there: bool, has_others: bool) -> None:
        """A session of ``user`` can be used, or cannot. ``has_others``: there are others of the same user."""
        ...

    def on_refused(self) -> None:
        """A connection, a session or a login was refused."""
        ...

    def on_broken(self) -> None:
        """A connection was ended."""
        ...

    def arrivals(self) -> Arrivals:
        """Arrival times of a new connection."""
        ...
