"""asyncua's outer server, on a socket that is bound already and with checked channels."""

from __future__ import annotations

import asyncio
import socket
from typing import Final

from asyncua.common.connection import TransportLimits
from asyncua.server.server import Server as LibraryServer
from cryptography import x509
from cryptography.hazmat.primitives.asymmetric.rsa import RSAPrivateKey
from cryptography.hazmat.primitives.serialization import Encoding

from bridge.uaserver.connections.acceptor import TcpAcceptor
from bridge.uaserver.connections.security import CheckedPolicy, Trust
from bridge.uaserver.inner_server import InnerServer
from bridge.uaserver.library import change
from bridge.uaserver.selfdescription import describe

_CHUNK: Final = 65535
_MOST_CHUNKS: Final = 256


class BoundServer(LibraryServer):
    """asyncua's server on a socket that is bound already, with checked channels."""

    def __init__(self, inner: InnerServer, bound: socket.socket, trusted: Trust) -> None:
        super().__init__(iserver=inner)
        self._inner = inner
        self._bound = bound
        self._trusted = trusted
        self._diagnosing: asyncio.Task[None] | None = None
        self.limits = TransportLimits(_CHUNK, _CHUNK, _MOST_CHUNKS, _CHUNK * _MOST_CHUNKS)

    async def start(self) -> None:
        await self._setup_server_nodes()
        policies = [CheckedPolicy(policy, self._trusted) for policy in self._policies]
        await self._inner.start()
        describe(self._inner.aspace, self._inner.locales)
        self._inner.diagnostics.install()
        self._diagnosing = asyncio.create_task(self._inner.diagnostics.run(), name="opcua diagnostics")
        self.bserver = TcpAcceptor(self._inner, self._bound, self.limits)
        self.bserver.set_policies(policies)
        await self.bserver.start()

    def renew(self, certificate: x509.Certificate, private_key: RSAPrivateKey) -> None:
        """Use another certificate of our own for channels that are opened from here on; those that are open
        go on with theirs, also when they are renewed."""
        self._inner.certificate, self._inner.private_key = certificate, private_key
        for policy in self._policies:
            change(policy, certificate=certificate, private_key=private_key)
        for endpoint in self._inner.endpoints:
            change(endpoint, ServerCertificate=certificate.public_bytes(Encoding.DER))

    async def stop(self) -> None:
        task, self._diagnosing = self._diagnosing, None
        if task:
            task.cancel()
            await asyncio.gather(task, return_exceptions=True)
        await super().stop()
