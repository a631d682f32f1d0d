"""Passwords as Argon2id hashes: made by `drivebridge hash-password`, checked at each login."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Final

from argon2 import PasswordHasher, extract_parameters
from argon2.exceptions import InvalidHashError, VerificationError

from bridge.base.errors import Fault, FileFaults
from bridge.config import UserTable
from bridge.text import Text

ANONYMOUS: Final = "anonymous"
_HASHER = PasswordHasher()


def hash_password(password: str) -> str:
    """The line for ``password_hash`` in the site file (Argon2id, RFC 9106; its own salt each time)."""
    return _HASHER.hash(password)


def is_password_hash(line: str) -> bool:
    try:
        extract_parameters(line)
    except InvalidHashError:
        return False
    return True


def verify_password(password_hash: str | None, password: str) -> bool:
    """Whether ``password`` is the one behind the hash; takes tens of ms and 64 MiB.

    None stands for a user that does not exist: it takes as long and is never right, so that nobody
    learns from the time which users there are.
    """
    try:
        matches = _HASHER.verify(password_hash or _nobody(), password)
    except (VerificationError, InvalidHashError):
        return False
    return matches and password_hash is not None


@cache
def _nobody() -> str:
    return hash_password("nobody")


def check_users(users: Sequence[UserTable]) -> None:
    """Raises ``FileFaults`` for names that are taken, lines that are no hash, and users without a
    credential, or with two."""
    faults: list[Fault] = []
    seen: set[str] = set()
    for position, user in enumerate(users):
        key = f"opcua.user[{position}]"
        if user.name in seen or user.name == ANONYMOUS:
            said = Text.of("site.user_name_taken", name=user.name)
            faults.append(Fault("site file", 0, f"{key}.name", said))
        seen.add(user.name)
        if bool(user.password_hash) is bool(user.certificate):
            said, advice = Text.of("site.user_credential"), Text.of("site.user_credential_advice")
            faults.append(Fault("site file", 0, key, said, advice))
        elif user.password_hash and not is_password_hash(user.password_hash):
            said, advice = Text.of("site.password_hash"), Text.of("site.password_hash_advice")
            faults.append(Fault("site file", 0, f"{key}.password_hash", said, advice))
    if faults:
        raise FileFaults(faults)
