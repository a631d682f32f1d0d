"""Sessions of the page. Sans-IO: times are monotonic seconds.

A session is known by two secrets: its id, which only the cookie has, and its token, which every change has to
name. What another site makes a browser send has the cookie and not the token (OWASP, cross-site request
forgery). An id is never one that a browser has brought along: each login begins a session with another one.
Neither is kept here: of the id there is a hash, and the token is made of the id.
"""

from __future__ import annotations

import hashlib
import hmac
import secrets
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

from bridge.command import Role

IDLE_S: Final = 1800.0
"""Time after which an unused session ends, seconds."""
LONGEST_S: Final = 12 * 3600.0
MOST: Final = 256
MOST_OF_ONE: Final = 16
"""Sessions of one user, or of visitors from one address, beside those with an open tab."""
MOST_VISITORS: Final = 128
"""Most sessions of visitors: anybody may become one by asking, and they leave room for users."""
KEEP_EVERY_S: Final = 60.0
_BYTES: Final = 32


@dataclass(slots=True, eq=False)
class PageSession:
    """``key`` is the hash of its id. ``user`` is empty for who reads without a login, from ``address``;
    ``tabs`` are those that are open. ``id`` and ``token`` are empty until its browser has brought the id."""

    key: str
    user: str
    role: Role
    began: float
    used: float
    address: str = ""
    tabs: int = 0
    id: str = ""
    token: str = ""

    def is_over(self, now: float) -> bool:
        return now >= self.used + IDLE_S or now >= self.began + LONGEST_S

    def has(self, token: str) -> bool:
        """True for its token; takes the same time for each."""
        return bool(self.token) and hmac.compare_digest(
            self.token.encode(), token.encode("utf-8", "surrogatepass")
        )


class PageSessions:
    """All sessions of one front."""

    def __init__(self) -> None:
        self._sessions: dict[str, PageSession] = {}
        self._is_changed = False
        self._kept_at = 0.0

    def restore(self, sessions: Iterable[PageSession]) -> None:
        """Take over the sessions of the front before this one."""
        self._sessions.update((one.key, one) for one in sessions)

    def take_changed(self, now: float) -> list[PageSession] | None:
        """All sessions, to be kept, if any has begun or ended since the last call or a minute has passed;
        else None."""
        if not self._is_changed and now < self._kept_at + KEEP_EVERY_S:
            return None
        self._is_changed, self._kept_at = False, now
        self._drop_old(now)
        return list(self._sessions.values())

    def __len__(self) -> int:
        return len(self._sessions)

    def begin(self, user: str, role: Role, now: float, address: str = "") -> PageSession:
        """Begin a session. Where there are too many, the one that has been idle longest ends, of the same
        user or visitor's address first. One with an open tab never ends: it may control a drive."""
        self._drop_old(now)
        everybody = list(self._sessions.values())
        own = [one for one in everybody if one.user == user and (user or one.address == address)]
        visitors = [] if user else [one for one in everybody if not one.user]
        for sessions, most in ((own, MOST_OF_ONE), (visitors, MOST_VISITORS), (everybody, MOST)):
            if len(sessions) >= most and self._drop_idle(sessions):
                break
        session = PageSession("", user, role, now, now, address)
        _known_by(session, secrets.token_urlsafe(_BYTES))
        self._sessions[session.key] = session
        self._is_changed = True
        return session

    def find(self, session_id: str, now: float) -> PageSession | None:
        """The session with this id, which has been used now; None where there is none any more."""
        session = self._sessions.get(_key_of(session_id))
        if session is None:
            return None
        if session.is_over(now):
            self.end(session)
            return None
        _known_by(session, session_id)
        session.used = max(now, session.used)
        return session

    def end(self, session: PageSession) -> None:
        """End the session. May be called again."""
        if self._sessions.pop(session.key, None):
            self._is_changed = True

    def _drop_old(self, now: float) -> None:
        for session in [one for one in self._sessions.values() if one.is_over(now)]:
            self.end(session)

    def _drop_idle(self, sessions: list[PageSession]) -> bool:
        """End the one that has been idle longest; False where each of them has an open tab."""
        idle = [one for one in sessions if not one.tabs]
        if idle:
            self.end(min(idle, key=lambda one: one.used))
        return bool(idle)


def _key_of(session_id: str) -> str:
    return hashlib.sha256(session_id.encode("utf-8", "surrogatepass")).hexdigest()


def _known_by(session: PageSession, session_id: str) -> None:
    """The session with its id and token: the token cannot be made from what is kept, but needs the id, which
    only the browser has."""
    if session.id != session_id:
        session.key = _key_of(session_id)
        session.id = session_id
        made = hmac.digest(session_id.encode("utf-8", "surrogatepass"), b"token of the page", "sha256")
        session.token = made.hex()
