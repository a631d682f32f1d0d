"""A TCP proxy that keeps what goes through it."""

from __future__ import annotations

import contextlib
import select
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager


class Link:
    """One connection: what the client has sent, and what it was answered."""

    def __init__(self) -> None:
        self.sent = b""
        self.received = b""


class Proxy:
    """Listens on ``port``; each connection goes on to ``target``."""

    def __init__(self, target: int) -> None:
        self._target = target
        self._server = socket.create_server(("127.0.0.1", 0))
        self.port: int = self._server.getsockname()[1]
        self.links: list[Link] = []
        threading.Thread(target=self._accept, daemon=True).start()

    def _accept(self) -> None:
        with contextlib.suppress(OSError):
            while True:
                client = self._server.accept()[0]
                link = Link()
                self.links.append(link)
                threading.Thread(target=self._carry, args=(client, link), daemon=True).start()

    def _carry(self, client: socket.socket, link: Link) -> None:
        with client, socket.create_connection(("127.0.0.1", self._target)) as server:
            while True:
                for sock in select.select([client, server], [], [])[0]:
                    data = sock.recv(65536)
                    if not data:
                        return
                    if sock is client:
                        link.sent += data
                        server.sendall(data)
                    else:
                        link.received += data
                        client.sendall(data)

    def close(self) -> None:
        self._server.close()


@contextmanager
def recording(target: int) -> Iterator[Proxy]:
    proxy = Proxy(target)
    try:
        yield proxy
    finally:
        proxy.close()
