"""Sessions across a restart of the page's front: a file in the runtime folder, for us alone.

It holds no secret. Of a session's id only the hash is kept, the token is made of the id that the browser
brings, and of a user's password hash again a hash: who reads the file cannot become anybody.
"""

from __future__ import annotations

import hashlib
import logging
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Final

import msgspec

from bridge.command import Role
from bridge.northbound.page.sessions import PageSession

_log = logging.getLogger(__name__)
_BOOT: Final = Path("/proc/sys/kernel/random/boot_id")


class _StoredSession(msgspec.Struct, forbid_unknown_fields=True):
    key: str
    user: str
    role: int
    began: float
    used: float
    address: str
    credential: str


class _SessionFile(msgspec.Struct, forbid_unknown_fields=True):
    boot: str
    sessions: list[_StoredSession]


def credential_of(role: str, password_hash: str) -> str:
    """Hash of the role and password that a session rests on: when either changes, the user has to log in
    again."""
    return hashlib.sha256(f"{role} {password_hash}".encode()).hexdigest()


class SessionFile:
    """``credentials`` by user, visitors under the empty name; times in it are monotonic, of this boot."""

    def __init__(self, path: Path, credentials: Mapping[str, str]) -> None:
        self._path = path
        self._credentials = credentials

    def load(self, now: float) -> list[PageSession]:
        """Sessions that are still valid. A file that cannot be read counts as none: everybody logs in
        again."""
        try:
            kept = msgspec.json.decode(self._path.read_bytes(), type=_SessionFile)
        except FileNotFoundError:
            return []
        except (OSError, msgspec.DecodeError) as error:
            _log.warning("page: the sessions of before are not known: %s", error)
            return []
        if kept.boot != _boot():
            return []
        return [
            PageSession(one.key, one.user, Role(one.role), one.began, one.used, one.address)
            for one in kept.sessions
            if self._credentials.get(one.user) == one.credential and one.began <= one.used <= now
        ]

    def save(self, sessions: list[PageSession]) -> None:
        """Replace the file, whole or not at all."""
        kept = [
            _StoredSession(one.key, one.user, int(one.role), one.began, one.used, one.address, credential)
            for one in sessions
            if (credential := self._credentials.get(one.user)) is not None
        ]
        new = self._path.with_suffix(".new")
        try:
            file = os.open(new, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_NOFOLLOW, 0o600)
            with os.fdopen(file, "wb") as opened:
                opened.write(msgspec.json.encode(_SessionFile(_boot(), kept)))
            new.replace(self._path)
        except OSError as error:
            _log.warning("page: its sessions are not kept: %s", error.strerror)


def _boot() -> str:
    try:
        return _BOOT.read_text().strip()
    except OSError:
        return ""
