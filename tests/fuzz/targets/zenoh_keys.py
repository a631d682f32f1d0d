"""Keys that one session declares: ``python -m tests.fuzz.targets.zenoh_keys PORT MODE KEYS``.

In a process of its own: a key of thousands of words can end the process of the library that declares it, too.
KEYS are ``DOING:NAME:WORDS``, one an argument.
"""

from __future__ import annotations

import contextlib
import subprocess
import sys
from collections.abc import Sequence
from typing import Final

import zenoh

from tests.fuzz.targets.zenoh_config import configure

DOINGS: Final = ("token", "queryable", "subscriber", "alias", "publisher")
_LIMIT_S: Final = 30.0
_OF_THE_LIBRARY: Final = ("ZError", "PanicException")


def declare_keys(port: int, mode: str, keys: Sequence[tuple[str, str, int]]) -> None:
    """Declare keys: what to declare, the first word of the key, and how many it has. Whether the library
    itself bears it is none of the bridge's; raises ``RuntimeError`` where nothing was declared for another
    reason."""
    arguments = [":".join(map(str, key)) for key in keys]
    command = [sys.executable, "-m", "tests.fuzz.targets.zenoh_keys", str(port), mode, *arguments]
    with contextlib.suppress(subprocess.TimeoutExpired):
        done = subprocess.run(command, timeout=_LIMIT_S, check=False, capture_output=True, text=True)
        if done.returncode > 0 and not any(text in done.stderr for text in _OF_THE_LIBRARY):
            raise RuntimeError(done.stderr)


def _declare(session: zenoh.Session, doing: str, key: str) -> object:
    ignored = zenoh.handlers.Callback(lambda _: None, indirect=False)
    match doing:
        case "token":
            return session.liveliness().declare_token(key)
        case "queryable":
            return session.declare_queryable(key, ignored)
        case "subscriber":
            return session.declare_subscriber(key, ignored)
        case "alias":
            return session.declare_keyexpr(key)
        case _:
            return session.declare_publisher(key)


def main(port: int, mode: str, *keys: str) -> None:
    with zenoh.open(configure(port, mode)) as session:
        for key in keys:
            doing, name, words = key.split(":")
            with contextlib.suppress(zenoh.ZError):
                _declare(session, doing, "/".join([name, *"k" * (int(words) - 1)]))


if __name__ == "__main__":
    main(int(sys.argv[1]), *sys.argv[2:])
