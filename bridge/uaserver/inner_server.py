"""asyncua's inner server with our sessions, subscriptions and limits."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from typing import Any, Final, cast

from asyncua.crypto.permission_rules import User
from asyncua.server.internal_server import InternalServer
from asyncua.server.internal_session import InternalSession
from asyncua.server.subscription_service import SubscriptionService
from cryptography.hazmat.primitives.serialization import Encoding

from bridge.base.guard import Guard
from bridge.uaserver.application import ServedApplication
from bridge.uaserver.conditions.conditions import Conditions
from bridge.uaserver.connection_limits import MOST_CONNECTIONS
from bridge.uaserver.counts import ServerCounts
from bridge.uaserver.diagnostics.diagnosticnodes import DiagnosticNodes
from bridge.uaserver.garbage import GarbageCollector
from bridge.uaserver.library import change, get, ua
from bridge.uaserver.own_addresses import OwnAddresses
from bridge.uaserver.serverstatus import ServerStatus
from bridge.uaserver.session import Session, ShownCertificate
from bridge.uaserver.subscriptions.subscription import Subscription
from bridge.uaserver.subscriptions.subscriptions import Subscriptions

_LONGEST_SESSION_MS: Final = 120_000.0


class InnerServer(InternalServer):
    """asyncua's inner server with our sessions, subscriptions and limits.

    ``application`` is set once the address space is built, before the first client is let in.
    """

    application: ServedApplication[Any]
    locales: Sequence[str] = ("en",)
    """LocaleIds of the texts in the address space."""
    conditions: Conditions | None = None
    """Conditions of the application; None where it has none."""

    def __init__(self, *, no_security: bool) -> None:
        super().__init__()
        self.guard = Guard("OPC UA")
        self.no_security = no_security
        self.addresses = OwnAddresses()
        # asyncua's own lets `admin` in with any password, as Admin. Logins are checked in the processor.
        self.user_manager = None  # pyright: ignore[reportAttributeAccessIssue]
        self.allow_remote_admin = False
        self.max_session_timeout_ms = _LONGEST_SESSION_MS
        # Who is let in, and how long one may wait, is decided before asyncua is asked.
        self.max_connections = 10 * MOST_CONNECTIONS
        self.max_pending_activation_seconds = 0
        self.status = ServerStatus(self.aspace)
        self.subscriptions = Subscriptions(self.aspace)
        # asyncua only looks through it for the subscriptions of a session.
        self.subscription_service = cast("SubscriptionService", self.subscriptions)
        self.diagnostics = DiagnosticNodes(self.aspace, self)
        self.garbage = GarbageCollector()

    @property
    def counts(self) -> ServerCounts:
        return self.subscriptions.counts

    @property
    def diagnosed_subscriptions(self) -> dict[int, Subscription]:
        return self.subscriptions.subscriptions

    def create_session(self, name: str, user: User | None = None, external: bool = False) -> InternalSession:
        return Session(self, self.aspace, self.subscription_service, name)

    def _mangle_endpoint_url(
        self, ep_url: str, params_ep_url: str | None = None, sockname: tuple[str, int] | None = None
    ) -> str:
        return self.addresses.answer(ep_url, params_ep_url, str(sockname[0]) if sockname else "")

    async def get_endpoints(
        self, params: ua.GetEndpointsParameters | None = None, sockname: tuple[str, int] | None = None
    ) -> list[ua.EndpointDescription]:
        """Endpoints of the transport profiles that are asked for."""
        endpoints = await super().get_endpoints(params, sockname)
        profiles: list[str] = (get(params, "ProfileUris") if params else None) or []
        return [one for one in endpoints if not profiles or get(one, "TransportProfileUri") in profiles]

    def find_servers(
        self, params: ua.FindServersParameters, sockname: tuple[str, int] | None = None
    ) -> list[ua.ApplicationDescription]:
        """This server, where it is asked for: asyncua takes each URI for the beginning of one."""
        wanted: list[str] = get(params, "ServerUris") or []
        change(params, ServerUris=[])
        found = super().find_servers(params, sockname)
        return [one for one in found if not wanted or get(one, "ApplicationUri") in wanted]

    @property
    def shown(self) -> ShownCertificate:
        """Certificate that the server shows at present, and its key."""
        certificate = self.certificate.public_bytes(Encoding.DER) if self.certificate else b""
        return ShownCertificate(certificate, self.private_key)

    @property
    def sessions(self) -> list[Session]:
        """Sessions of clients."""
        return [one for one in self._external_sessions.values() if isinstance(one, Session)]

    async def stop(self) -> None:
        self.garbage.end()
        # asyncua waits for its clock's next tick, up to a second.
        task, self.time_task = self.time_task, None
        if task:
            task.cancel()
            await asyncio.gather(task, return_exceptions=True)
        for session in list(self._external_sessions.values()):
            await session.close_session()
        await super().stop()
