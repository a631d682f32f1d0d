"""Meeting point of the bus process and its fronts: a Unix socket in the runtime folder."""

from __future__ import annotations

import os
import stat
from pathlib import Path
from typing import Final

from bridge.base.errors import Unavailable

LEASE_MS: Final = 10_000
"""More than a front or the bus process may hang before it is killed (``bridge/service/front_process.py``,
``WatchdogSec``). Where zenoh ends the connection of one that only stood still, what was asked over it is
lost, and its client waits for its time-out. Who hangs is noticed by the deltas and signs that do not come."""

_LONGEST_PATH: Final = 100
"""A socket's path has room for 107 bytes (``unix(7)``); zenoh puts a lock file beside it."""


def socket_endpoint(runtime_dir: Path, site: str) -> str:
    """The zenoh endpoint of a site's socket. Raises Unavailable where the path cannot be one."""
    path = str(runtime_dir.absolute() / f"{site}.sock")
    if len(os.fsencode(path)) > _LONGEST_PATH:
        raise Unavailable(f"{path} is too long for a socket; choose a shorter runtime_dir")
    if any(sign in path for sign in "?#;"):
        raise Unavailable(f"{path}: runtime_dir must not contain ? # or ;")
    return f"unixsock-stream/{path}"


def tap_path(runtime_dir: Path, site: str, bus: str) -> Path:
    """Socket on which the bus process passes on the frames of a bus that only it can hear."""
    return runtime_dir.absolute() / f"{site}-{bus}.frames"


def prepare_folder(endpoint: str) -> None:
    """See that the socket's folder is there and that only we can put something into it.

    Raises Unavailable with what would help. A socket left behind by a killed process is no obstacle:
    zenoh holds a lock beside it as long as it is in use.
    """
    folder = socket_path(endpoint).parent
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        found = folder.stat()
    except OSError as error:
        raise Unavailable(f"the runtime folder {folder} cannot be made: {error.strerror}") from None
    if found.st_uid != os.geteuid() or stat.S_IMODE(found.st_mode) & 0o022:
        raise Unavailable(
            f"others may write to the runtime folder {folder}; it must be ours alone (chmod 700), "
            "or runtime_dir another one"
        )


def close_to_others(endpoint: str) -> None:
    """Only our own user may connect, whatever the umask."""
    socket_path(endpoint).chmod(0o600)


def socket_path(endpoint: str) -> Path:
    return Path(endpoint.removeprefix("unixsock-stream/"))
