"""Settings of the sockets of zenoh's connections that zenoh itself does not offer."""

from __future__ import annotations

import os
import socket
import struct
from contextlib import suppress
from typing import Final

_OFF: Final = struct.pack("ii", 0, 0)
_IP: Final = (socket.AF_INET, socket.AF_INET6)
_SO_DOMAIN: Final = 39
"""Constant of asm-generic/socket.h; Python's socket module has no name for it."""


class TcpConnections:
    """The TCP connections of this process that are made to wait when they are closed: zenoh's.

    zenoh has ``close`` wait for 10 s until the peer has read everything (SO_LINGER, socket(7)), on one of the
    two threads that read for all connections: two clients that hang, and nobody is heard any more.
    """

    def __init__(self) -> None:
        self._settled: set[int] = set()
        """Inodes. What has been settled stays so, and is not looked at again: there may be hundreds."""

    def settle(self) -> list[str]:
        """Let none of them wait; gives the other ends of those that would have: ``10.0.0.1:40000`` or
        ``[fe80::1]:40000``."""
        found: list[str] = []
        still: set[int] = set()
        for name in os.listdir("/proc/self/fd"):  # noqa: PTH208 - a third of its time
            with suppress(OSError):
                inode = os.fstat(int(name)).st_ino
                if inode not in self._settled:
                    end = _stop_waiting(int(name))
                    if not end:
                        continue
                    found.append(end)
                still.add(inode)
        self._settled = still
        return found


def _stop_waiting(number: int) -> str:
    """The other end of a connection that would have waited; else nothing. Raises OSError."""
    # It may be closed and its number reused at any moment, so we work on a copy of our own.
    copy = os.dup(number)
    try:
        return _let_go(copy)
    finally:
        # Always: a copy of the broadcast manager's socket would keep its bursts on the bus.
        os.close(copy)


def _let_go(copy: int) -> str:
    # With family and type given, Python does not ask for the address, which not every socket has. An IPv4
    # socket tells its address all the same.
    connection = socket.socket(socket.AF_INET6, socket.SOCK_STREAM, 0, fileno=copy)
    try:
        family = connection.getsockopt(socket.SOL_SOCKET, _SO_DOMAIN)
        kind = connection.getsockopt(socket.SOL_SOCKET, socket.SO_TYPE)
        if family not in _IP or kind != socket.SOCK_STREAM:
            return ""
        state = connection.getsockopt(socket.SOL_SOCKET, socket.SO_LINGER, len(_OFF))
        if state[: len(_OFF) // 2] == _OFF[: len(_OFF) // 2]:
            return ""
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, _OFF)
        host, port = connection.getpeername()[:2]
    finally:
        connection.detach()
    return f"[{host}]:{port}" if family == socket.AF_INET6 else f"{host}:{port}"
