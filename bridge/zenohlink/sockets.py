"""The sockets of zenoh's connections, as far as zenoh does not leave them as we need them."""

from __future__ import annotations

import os
import socket
import stat
import struct
from contextlib import suppress
from pathlib import Path
from typing import Final

_OFF: Final = struct.pack("ii", 0, 0)
_IP: Final = (socket.AF_INET, socket.AF_INET6)
_SO_DOMAIN: Final = 39
"""asm-generic/socket.h; Python's socket has no name for it."""
_FILES: Final = Path("/proc/self/fd")


def close_without_waiting() -> list[str]:
    """Let no connection of this process wait when it is closed; gives where those lead that would have, each
    of zenoh's once: ``10.0.0.1:40000`` or ``[fe80::1]:40000``.

    zenoh has ``close`` wait for 10 s until the peer has read everything (SO_LINGER, socket(7)), on one of the
    two threads that read for all connections: two clients that hang, and nobody is heard any more.
    """
    found: list[str] = []
    for file in list(_FILES.iterdir()):
        with suppress(OSError):
            found += _stop_waiting(int(file.name))
    return found


def _stop_waiting(number: int) -> list[str]:
    # It may be closed, and its number be another's, at any moment: what is asked and set is our own copy's.
    copy = os.dup(number)
    try:
        if not stat.S_ISSOCK(os.fstat(copy).st_mode):
            return []
        family = _let_go(copy)
        return [_far_end(copy, family)] if family else []
    finally:
        # Always: a copy of the broadcast manager's socket would keep its bursts on the bus.
        os.close(copy)


def _let_go(copy: int) -> int:
    """The family of a connection that would have waited; else 0."""
    # Family and type are named, or Python would ask for the address, which not every socket has.
    connection = socket.socket(socket.AF_INET, socket.SOCK_STREAM, 0, fileno=copy)
    try:
        family = connection.getsockopt(socket.SOL_SOCKET, _SO_DOMAIN)
        if family not in _IP:
            return 0
        if connection.getsockopt(socket.SOL_SOCKET, socket.SO_TYPE) != socket.SOCK_STREAM:
            return 0
        state = connection.getsockopt(socket.SOL_SOCKET, socket.SO_LINGER, len(_OFF))
        if state[: len(_OFF) // 2] == _OFF[: len(_OFF) // 2]:
            return 0
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, _OFF)
        return family
    finally:
        connection.detach()


def _far_end(copy: int, family: int) -> str:
    connection = socket.socket(family, socket.SOCK_STREAM, 0, fileno=copy)
    try:
        host, port = connection.getpeername()[:2]
    finally:
        connection.detach()
    return f"[{host}]:{port}" if family == socket.AF_INET6 else f"{host}:{port}"
