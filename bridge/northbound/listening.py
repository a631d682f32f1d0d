"""Listening sockets: opening them, with advice if that fails, and watching them."""

from __future__ import annotations

import asyncio
import errno
import os
import socket
from typing import Final

from bridge.errors import OperationFailed, Unavailable

_BACKLOG: Final = 64
_LOOK_EVERY_S: Final = 1.0


def listen(endpoint: str, key: str) -> socket.socket:
    """A socket that listens on ``endpoint``, which is ``key`` of the site file. Raises ``Unavailable``.

    It listens at once, because two processes may bind one port as long as neither does.
    """
    host, _, port = endpoint.rpartition(":")
    host = host.strip("[]")
    is_v6 = ":" in host
    try:
        return socket.create_server(
            (host, int(port)),
            family=socket.AF_INET6 if is_v6 else socket.AF_INET,
            backlog=_BACKLOG,
            dualstack_ipv6=host == "::" and socket.has_dualstack_ipv6(),
        )
    except OSError as error:
        raise Unavailable(f"{key} = {endpoint!r}: {_advice(error, host, port)}") from error


def _advice(error: OSError, host: str, port: str) -> str:
    match error.errno:
        case errno.EADDRINUSE:
            return f"port {port} is taken by another program; `ss -ltnp` shows which, or choose another port"
        case errno.EACCES:
            where = "start it as drivebridge.service, or choose a port from 1024 on"
            return f"port {port} needs CAP_NET_BIND_SERVICE: {where}"
        case errno.EADDRNOTAVAIL:
            return f"no interface of this machine has the address {host}"
        case _:
            return os.strerror(error.errno) if error.errno else str(error)


def is_listening(bound: socket.socket) -> bool:
    """False if it was closed, or ended from outside (``ss --kill``)."""
    try:
        return bool(bound.getsockopt(socket.SOL_SOCKET, socket.SO_ACCEPTCONN))
    except OSError:
        return False


async def until_deaf(bound: socket.socket, key: str) -> None:
    """Wait until the socket no longer listens, then raise ``OperationFailed``."""
    while is_listening(bound):  # noqa: ASYNC110 - the kernel notifies nobody
        await asyncio.sleep(_LOOK_EVERY_S)
    raise OperationFailed(f"{key}: its socket listens no more")


class Port:
    """A port that is held for a server in another process, also while that is not running."""

    def __init__(self, endpoint: str, key: str) -> None:
        self._endpoint = endpoint
        self._key = key
        self._socket: socket.socket | None = None

    async def open(self) -> None:
        """As ``socket``, for who opens several things."""
        self.socket()

    def socket(self) -> socket.socket:
        """The listening socket, a new one if the old one has ended. Raises ``Unavailable``."""
        if self._socket is None or not is_listening(self._socket):
            self.close()
            self._socket = listen(self._endpoint, self._key)
        return self._socket

    def close(self) -> None:
        bound, self._socket = self._socket, None
        if bound:
            bound.close()
