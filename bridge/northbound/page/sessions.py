"""Who is logged in to the page. Sans-IO: times are monotonic seconds.

A session is known by two secrets: its id, which only the cookie has, and its token, which every change has to
name. What another site makes a browser send has the cookie and not the token (OWASP, cross-site request
forgery). An id is never one that a browser has brought along: each login begins a session with another one.
"""

from __future__ import annotations

import hmac
import secrets
from dataclasses import dataclass
from typing import Final

from bridge.command import Role

IDLE_S: Final = 1800.0
"""A session that nobody has used for this long ends."""
LONGEST_S: Final = 12 * 3600.0
MOST: Final = 256
MOST_OF_ONE: Final = 16
"""Sessions of one user, or of visitors from one address, beside those with an open tab."""
MOST_VISITORS: Final = 128
"""Anybody may become one by asking: they leave room for who logs in."""
_BYTES: Final = 32


@dataclass(slots=True, eq=False)
class Session:
    """``user`` is empty for who reads without a login, from ``address``; ``tabs`` are those that are open."""

    id: str
    token: str
    user: str
    role: Role
    began: float
    used: float
    address: str = ""
    tabs: int = 0

    def is_over(self, now: float) -> bool:
        return now >= self.used + IDLE_S or now >= self.began + LONGEST_S

    def has(self, token: str) -> bool:
        """Whether this is its token; takes the same time for each."""
        return hmac.compare_digest(self.token.encode(), token.encode("utf-8", "surrogatepass"))


class Sessions:
    """All sessions of one front."""

    def __init__(self) -> None:
        self._sessions: dict[str, Session] = {}

    def __len__(self) -> int:
        return len(self._sessions)

    def begin(self, user: str, role: Role, now: float, address: str = "") -> Session:
        """A new one; where there are too many, the one goes that has been idle longest, of the same user or
        visitor's address first. One with an open tab never goes: it may control a drive."""
        self._drop_old(now)
        everybody = list(self._sessions.values())
        own = [one for one in everybody if one.user == user and (user or one.address == address)]
        visitors = [] if user else [one for one in everybody if not one.user]
        for sessions, most in ((own, MOST_OF_ONE), (visitors, MOST_VISITORS), (everybody, MOST)):
            if len(sessions) >= most and self._drop_idle(sessions):
                break
        session_id, token = (secrets.token_urlsafe(_BYTES) for _ in range(2))
        session = self._sessions[session_id] = Session(session_id, token, user, role, now, now, address)
        return session

    def find(self, session_id: str, now: float) -> Session | None:
        """The session with this id, which has been used now; None where there is none any more."""
        session = self._sessions.get(session_id)
        if session is None:
            return None
        if session.is_over(now):
            self.end(session)
            return None
        session.used = max(now, session.used)
        return session

    def end(self, session: Session) -> None:
        """May be called again."""
        self._sessions.pop(session.id, None)

    def _drop_old(self, now: float) -> None:
        for session in [one for one in self._sessions.values() if one.is_over(now)]:
            self.end(session)

    def _drop_idle(self, sessions: list[Session]) -> bool:
        """End the one that has been idle longest; False where each of them has an open tab."""
        idle = [one for one in sessions if not one.tabs]
        if idle:
            self.end(min(idle, key=lambda one: one.used))
        return bool(idle)
