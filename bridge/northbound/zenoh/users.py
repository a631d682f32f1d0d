"""Identity of a zenoh client: with users, the user that its link has authenticated as.

zenoh does not tell which link a query came by, but it can restrict the keys that a link may use. So each user
has command keys of its own, ``…/@/controller/<user>/…``, which tell the bridge who asks.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from bridge.base.errors import Unavailable
from bridge.config import ZenohTable
from bridge.text import Text

ANONYMOUS: Final = "anonymous"
NAME: Final = re.compile(r"[A-Za-z0-9_.\-]{1,64}")
WANTED_NAME: Final = Text.of("zenoh.controller_name")

_OWN_KEYS: Final = "@/controller/"


@dataclass(frozen=True, slots=True)
class Login:
    """Our own user, and the file with a line ``user:password`` for each user."""

    user: str
    password: str
    file: str
    everybody: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Users:
    """Users of a site. If links authenticate, ``controllers`` have command keys of their own; otherwise
    clients are who they say they are. ``sole`` is the only user beside the bridge's own, if there can be no
    other."""

    login: Login | None = None
    are_proved: bool = False
    controllers: tuple[str, ...] = ()
    sole: str = ""

    def owner(self, tail: str) -> tuple[str, str]:
        """User whose command key ``tail`` (without prefix and site) is, and the plain key it stands for. A
        plain key belongs to nobody, ``""``, or to the sole user."""
        if not self.are_proved or not tail.startswith(_OWN_KEYS):
            return self.sole, tail
        name, _, rest = tail.removeprefix(_OWN_KEYS).partition("/")
        return name, rest


def own_keys(name: str) -> str:
    """The keys of a controller, without prefix and site."""
    return f"{_OWN_KEYS}{name}/**"


def read_users(settings: ZenohTable) -> Users:
    """Raises Unavailable if the password file cannot be used."""
    login = _read_login(settings)
    if settings.mode != "peer" or not settings.listen:
        # Without a port of our own, the router that we connect to authenticates its clients.
        return Users(login)
    if settings.controllers is not None:
        return Users(login, True, tuple(settings.controllers))
    if login is None:
        return Users()
    others = tuple(name for name in login.everybody if name != login.user) or login.everybody
    is_sole = len(others) == 1 and not settings.connect
    return Users(login, True, others, others[0] if is_sole else "")


def _read_login(settings: ZenohTable) -> Login | None:
    user, file = settings.user, settings.password_file
    if user is None and file is None:
        return None
    if user is None or file is None:
        raise Unavailable("zenoh: user and password_file belong together; give both or neither")
    try:
        lines = Path(file).read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise Unavailable(f"zenoh: password_file cannot be read: {error}") from None
    passwords = {name: password for name, colon, password in (line.partition(":") for line in lines) if colon}
    for name in passwords:
        if not NAME.fullmatch(name) or name == ANONYMOUS:
            raise Unavailable(f"zenoh: {file}: {name!r} cannot be a user here: {WANTED_NAME}")
    if user not in passwords:
        raise Unavailable(f"zenoh: {file} has no line {user}:<password>")
    return Login(user, passwords[user], file, tuple(passwords))
