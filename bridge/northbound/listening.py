"""Listening sockets: opening them, with advice if that fails, watching them, and turning clients away while
this process has no descriptor left."""

from __future__ import annotations

import asyncio
import errno
import logging
import os
import socket
from typing import Any, Final

from bridge.base.errors import OperationFailed, Unavailable, is_exhausted
from bridge.base.quietlog import log_source

_log = logging.getLogger(__name__)

_BACKLOG: Final = 64
_LOOK_EVERY_S: Final = 1.0


class ListeningSocket(socket.socket):
    """A listening socket on which running out of descriptors is one trouble with one line in the log.

    While there are none, whoever connects is turned away at once with one that is held for that: otherwise
    the kernel would go on reporting the connection, and asyncio try again without a pause. Where even that
    one does not help, as when the whole machine has none, asyncio leaves the socket alone for a second.
    """

    def __init__(self, descriptor: int, name: str) -> None:
        """Takes over a socket that listens; ``name`` is for the log."""
        super().__init__(fileno=descriptor)
        self._name = name
        self._spare: int | None = _spare()
        self._has_failed = False

    def accept(self) -> tuple[socket.socket, Any]:
        """Accept like ``socket``; raises BlockingIOError where a client was turned away."""
        if self._has_failed:
            # asyncio asks again, up to its backlog, also after an error.
            self._has_failed = False
            raise BlockingIOError
        try:
            return super().accept()
        except OSError as error:
            if not is_exhausted(error):
                raise
            _log.error(
                "%s: no client can connect: %s", self._name, error.strerror, extra=log_source(self._name)
            )
            if self._turn_away():
                raise BlockingIOError from error
            self._has_failed = True
            raise

    def _turn_away(self) -> bool:
        """Accept the next client with the spare descriptor and close it. False where that fails."""
        if self._spare is None:
            self._spare = _spare()
        if self._spare is None:
            return False
        os.close(self._spare)
        try:
            client, _ = super().accept()
            client.close()
        except OSError as error:
            return not is_exhausted(error)
        finally:
            self._spare = _spare()
        return True

    def close(self) -> None:
        super().close()
        spare, self._spare = self._spare, None
        if spare is not None:
            os.close(spare)


def _spare() -> int | None:
    try:
        return os.open(os.devnull, os.O_RDONLY | os.O_CLOEXEC)
    except OSError:
        return None


def listen(endpoint: str, key: str) -> ListeningSocket:
    """A socket that listens on ``endpoint``, which is ``key`` of the site file. Raises ``Unavailable``.

    It listens at once, because two processes may bind one port as long as neither does.
    """
    host, _, port = endpoint.rpartition(":")
    host = host.strip("[]")
    is_v6 = ":" in host
    try:
        bound = socket.create_server(
            (host, int(port)),
            family=socket.AF_INET6 if is_v6 else socket.AF_INET,
            backlog=_BACKLOG,
            dualstack_ipv6=host == "::" and socket.has_dualstack_ipv6(),
        )
    except OSError as error:
        raise Unavailable(f"{key} = {endpoint!r}: {_advice(error, host, port)}") from error
    return ListeningSocket(bound.detach(), key)


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
        """Open the socket, awaitable like the other things that a server opens."""
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
