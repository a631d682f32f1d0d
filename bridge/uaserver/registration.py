"""Registration with a discovery server, by which clients find this one (OPC 10000-4 §5.5.5 and §5.5.6)."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

from asyncua.client.client import Client
from asyncua.crypto.security_policies import SecurityPolicyBasic256Sha256
from asyncua.crypto.uacrypto import CertProperties

from bridge.base.quietlog import log_source
from bridge.uaserver.library import StatusCodes, UaStatusCodeError, get, make, ua

_EVERY_S: Final = 600.0
"""A discovery server forgets who has not registered again within 10 minutes (Part 12 §4.2.2)."""
_AGAIN_S: Final = 60.0
"""Pause after a registration that has failed."""
_LIMIT_S: Final = 10.0
_END_LIMIT_S: Final = 2.0
"""Longest wait at the end: the service does not end later because a discovery server is away."""
_CAPABILITIES: Final = ("DA",)
"""Live data (Part 12, Annex D)."""
_NOT_DONE: Final = (StatusCodes.BadServiceUnsupported, StatusCodes.BadNotImplemented)

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class RegisteredServer:
    """Server as discovery servers know it. ``certificate`` (DER) and ``private_key`` (PEM) are its own: they
    take registrations on encrypted channels only."""

    application_uri: str
    product_uri: str
    name: str
    endpoint_url: str
    certificate: bytes
    private_key: bytes


class Registration:
    """Registers ``server`` with the discovery server at ``url``: at once, and every ten minutes."""

    def __init__(
        self, url: str, server: RegisteredServer, sleep: Callable[[float], Any] = asyncio.sleep
    ) -> None:
        self._url = url
        self._server = server
        self._sleep = sleep
        self._is_registered = False

    async def run(self) -> None:
        """Keep it registered until cancelled. What fails is logged, and tried again a minute later."""
        while True:
            await self._sleep(_EVERY_S if await self._try(is_online=True, limit_s=_LIMIT_S) else _AGAIN_S)

    async def end(self) -> None:
        """Tell the discovery server that this one is gone, where it knows it."""
        if self._is_registered:
            await self._try(is_online=False, limit_s=_END_LIMIT_S)

    async def _try(self, *, is_online: bool, limit_s: float) -> bool:
        try:
            async with asyncio.timeout(limit_s):
                await self._register(is_online=is_online)
        except Exception as error:  # noqa: BLE001 - asyncua raises what it likes; nobody waits for this
            what = "registered" if is_online else "taken off"
            _log.warning("OPC UA: not %s at %s: %r", what, self._url, error, extra=log_source("discovery"))
            return False
        if is_online and not self._is_registered:
            _log.info("OPC UA: registered at %s", self._url)
        self._is_registered = is_online
        return True

    async def _register(self, *, is_online: bool) -> None:
        client = Client(self._url, timeout=_LIMIT_S / 2)
        client.application_uri = self._server.application_uri
        await client.set_security(
            SecurityPolicyBasic256Sha256,
            CertProperties(self._server.certificate, "der"),
            CertProperties(self._server.private_key, "pem"),
        )
        await client.connect_sessionless()
        try:
            await self._ask(client, is_online=is_online)
        finally:
            await client.disconnect_sessionless()

    async def _ask(self, client: Client, *, is_online: bool) -> None:
        """RegisterServer where the discovery server does not know RegisterServer2."""
        known = self._server
        server = make(
            ua.RegisteredServer,
            ServerUri=known.application_uri,
            ProductUri=known.product_uri,
            ServerNames=[ua.LocalizedText(known.name, "en")],
            ServerType=ua.ApplicationType.Server,
            DiscoveryUrls=[known.endpoint_url],
            IsOnline=is_online,
        )
        on_network = make(
            ua.MdnsDiscoveryConfiguration,
            MdnsServerName=known.name,
            ServerCapabilities=list(_CAPABILITIES),
        )
        params = make(ua.RegisterServer2Parameters, Server=server, DiscoveryConfiguration=[on_network])
        connection: Any = get(client, "uaclient")
        try:
            await connection.register_server2(params)
        except UaStatusCodeError as error:
            if error.code not in _NOT_DONE:
                raise
            await connection.register_server(server)
