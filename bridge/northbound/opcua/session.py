"""A client's session: its identity, and the services that asyncua does too freely.

Corrected here, each with a test in ``tests/wire/opcua/test_security.py``: sequential session tokens,
writes of anything anywhere, methods that are not executable, reads of what is not readable, calls
without end, subscriptions of others.
"""

from __future__ import annotations

import asyncio
import secrets
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final

from asyncua.crypto.permission_rules import User, UserRole
from asyncua.server.address_space import AddressSpace
from asyncua.server.internal_server import InternalServer
from asyncua.server.internal_session import InternalSession
from asyncua.server.subscription_service import SubscriptionService

from bridge.command.request import Action, Identity, Role, Source
from bridge.guard import Guard
from bridge.northbound.opcua.admission import MOST_CONNECTIONS
from bridge.northbound.opcua.library import (
    AttributeIds,
    ServiceError,
    StatusCodes,
    data_value,
    get,
    make,
    node_id,
    status,
    ua,
    variant,
)
from bridge.northbound.opcua.methods import Caller
from bridge.northbound.opcua.nodes import pascal_case
from bridge.northbound.opcua.notices import Notices
from bridge.northbound.opcua.security import Users
from bridge.northbound.opcua.shares import make_room
from bridge.northbound.opcua.structures import READ
from bridge.northbound.opcua.subscriptions import Subscriptions
from bridge.northbound.opcua.writes import Writer

MOST_OPERATIONS: Final = 10_000
MOST_CALLS: Final = 100
_BATCH: Final = 500
_LONGEST_SESSION_MS: Final = 120_000.0

_FOR_ENGINEERS: Final = tuple(
    f"/{pascal_case(action)}" for action in (Action.WRITE_PARAMETER, Action.SAVE_PARAMETERS)
)

_TOKEN_BYTES: Final = 32
_OBSERVER_ACCESS: Final = data_value(variant(READ, ua.VariantType.Byte))
_OBSERVER_EXECUTABLE: Final = data_value(variant(False, ua.VariantType.Boolean))
_NOT_READABLE: Final = data_value(variant(None, ua.VariantType.Null), status(StatusCodes.BadNotReadable))


@dataclass(frozen=True, slots=True)
class Services:
    """What sessions need of the bridge."""

    users: Users
    writer: Writer
    caller: Caller


class Session(InternalSession):
    """One client. ``channel_certificate`` is that of the channel the session was made on."""

    def __init__(
        self, server: Server, aspace: AddressSpace, subscriptions: SubscriptionService, name: str
    ) -> None:
        # Registered below, under a token that nobody can guess.
        super().__init__(server, aspace, subscriptions, name, User(UserRole.Anonymous), external=False)
        self._server = server
        self.auth_token = node_id(secrets.token_bytes(_TOKEN_BYTES), 0, ua.NodeIdType.ByteString)
        self.external = True
        server.register_external_session(self)
        self.address = str(name[0]) if isinstance(name, tuple) else str(name)
        self.identity = Identity(Source.OPCUA, "", Role.OBSERVER, self.address)
        self.channel_certificate: bytes | None = None
        self.holder: object | None = None
        """The processor of the connection that it is activated on."""
        self.left_at = 0.0
        """When it lost its last connection; monotonic."""
        self.admitted: Identity | None = None
        """Who ``activate_session`` is for; set by the processor once the login has been checked."""

    def activate_session(
        self, params: ua.ActivateSessionParameters, peer_certificate: bytes | None
    ) -> ua.ActivateSessionResult:
        admitted, self.admitted = self.admitted, None
        if admitted is None:
            raise ServiceError(StatusCodes.BadIdentityTokenRejected)
        result = super().activate_session(params, peer_certificate)
        self.identity = admitted
        # Never Admin: that role may change the address space and write anything.
        self.user = User(UserRole.User, admitted.user)
        return result

    def leave(self, now: float) -> None:
        """Its connection has ended."""
        self.holder, self.left_at = None, now

    # services

    async def read(self, params: ua.ReadParameters) -> list[ua.DataValue]:
        wanted: list[ua.ReadValueId] = get(params, "NodesToRead")
        _limit(wanted, MOST_OPERATIONS)
        results: list[ua.DataValue] = []
        for start in range(0, len(wanted), _BATCH):
            batch = wanted[start : start + _BATCH]
            values = self.iserver.attribute_service.read(make(ua.ReadParameters, NodesToRead=batch))
            results += [self._seen(*pair) for pair in zip(batch, values, strict=True)]
            await asyncio.sleep(0)
        return results

    def _seen(self, wanted: ua.ReadValueId, value: ua.DataValue) -> ua.DataValue:
        """``value`` as this user may see it."""
        attribute = get(wanted, "AttributeId")
        if attribute == AttributeIds.Value:
            node = self.aspace.get(get(wanted, "NodeId"))
            access = node.attributes.get(AttributeIds.AccessLevel) if node else None
            held = access.value.Value if access and access.value else None
            return value if held is None or held.Value & READ else _NOT_READABLE
        if value.Value is None or not value.Value.Value or self._may(get(wanted, "NodeId")):
            return value
        if attribute == AttributeIds.UserAccessLevel:
            return _OBSERVER_ACCESS
        if attribute == AttributeIds.UserExecutable:
            return _OBSERVER_EXECUTABLE
        return value

    def _may(self, where: ua.NodeId) -> bool:
        """Whether this user may write or call ``where``, in so far as roles decide."""
        name = str(where.Identifier)
        if name.endswith(f"/{pascal_case(Action.READ_PARAMETER)}"):
            return True
        for_engineers = "/parameter/" in name or name.endswith(_FOR_ENGINEERS)
        return self.identity.role >= (Role.ENGINEER if for_engineers else Role.OPERATOR)

    async def write(self, params: ua.WriteParameters) -> list[ua.StatusCode]:
        writes: list[ua.WriteValue] = get(params, "NodesToWrite")
        _limit(writes, MOST_OPERATIONS)
        return await self._server.services.writer.write(self.identity, writes)

    async def call(self, params: list[ua.CallMethodRequest]) -> list[ua.CallMethodResult]:
        _limit(params, MOST_CALLS)
        return await self._server.services.caller.call(self.identity, params)

    async def browse(self, params: ua.BrowseParameters) -> list[ua.BrowseResult]:
        _limit(get(params, "NodesToBrowse"), MOST_OPERATIONS)
        return await super().browse(params)

    # subscriptions, each its own session's

    def _own(self, *ids: int) -> None:
        self._server.subscriptions.check_owner(self.session_id, ids)

    async def create_subscription(
        self,
        params: ua.CreateSubscriptionParameters,
        callback: Callable[..., Any],
        request_callback: Callable[..., Any] | None = None,
    ) -> ua.CreateSubscriptionResult:
        await make_room(self, self._server.sessions, self.subscription_service)
        return await super().create_subscription(params, callback, request_callback)

    async def create_monitored_items(
        self, params: ua.CreateMonitoredItemsParameters
    ) -> list[ua.MonitoredItemCreateResult]:
        self._own(get(params, "SubscriptionId"))
        _limit(get(params, "ItemsToCreate"), MOST_OPERATIONS)
        return await super().create_monitored_items(params)

    async def modify_monitored_items(
        self, params: ua.ModifyMonitoredItemsParameters
    ) -> list[ua.MonitoredItemModifyResult]:
        self._own(get(params, "SubscriptionId"))
        return await super().modify_monitored_items(params)

    async def delete_monitored_items(self, params: ua.DeleteMonitoredItemsParameters) -> list[ua.StatusCode]:
        self._own(get(params, "SubscriptionId"))
        return await super().delete_monitored_items(params)

    async def set_monitoring_mode(self, params: ua.SetMonitoringModeParameters) -> list[ua.StatusCode]:
        self._own(get(params, "SubscriptionId"))
        return await super().set_monitoring_mode(params)

    async def set_publishing_mode(self, params: ua.SetPublishingModeParameters) -> list[ua.StatusCode]:
        self._own(*get(params, "SubscriptionIds"))
        return await super().set_publishing_mode(params)

    def modify_subscription(self, params: ua.ModifySubscriptionParameters) -> ua.ModifySubscriptionResult:
        self._own(get(params, "SubscriptionId"))
        return super().modify_subscription(params)

    def republish(self, params: ua.RepublishParameters) -> ua.NotificationMessage:
        self._own(get(params, "SubscriptionId"))
        return super().republish(params)

    async def delete_subscriptions(self, ids: list[int]) -> list[ua.StatusCode]:
        own = self._server.subscriptions.of(self.session_id)
        deleted = iter(await super().delete_subscriptions([number for number in ids if number in own]))
        unknown = status(StatusCodes.BadSubscriptionIdInvalid)
        return [next(deleted) if number in own else unknown for number in ids]

    async def transfer_subscriptions(
        self, params: ua.TransferSubscriptionsParameters, callback: Callable[..., Any]
    ) -> list[ua.TransferResult]:
        """Only from a session of the same user, so that a name is worth what its password is."""
        mine = {session.session_id for session in self._server.sessions_of(self.identity)}
        for number in get(params, "SubscriptionIds"):
            found = self._server.subscriptions.subscriptions.get(number)
            if found is not None and found.session_id not in mine:
                raise ServiceError(StatusCodes.BadUserAccessDenied)
        return await super().transfer_subscriptions(params, callback)


class Server(InternalServer):
    """asyncua's inner server with our sessions, subscriptions and limits.

    ``services`` is set once the address space is built, before the first client is let in.
    """

    services: Services

    def __init__(self, notices: Notices, *, no_security: bool) -> None:
        super().__init__()
        self.notices = notices
        self.guard = Guard("OPC UA")
        self.no_security = no_security
        # asyncua's own lets `admin` in with any password, as Admin. Logins are checked in the processor.
        self.user_manager = None  # pyright: ignore[reportAttributeAccessIssue]
        self.allow_remote_admin = False
        self.max_session_timeout_ms = _LONGEST_SESSION_MS
        # Who is let in, and how long one may wait, is decided before asyncua is asked.
        self.max_connections = 10 * MOST_CONNECTIONS
        self.max_pending_activation_seconds = 0
        self.subscriptions = Subscriptions(self.aspace, self)
        self.subscription_service = self.subscriptions
        self.isession.subscription_service = self.subscriptions

    def create_session(self, name: str, user: User | None = None, external: bool = False) -> InternalSession:
        return Session(self, self.aspace, self.subscription_service, name)

    @property
    def sessions(self) -> list[Session]:
        """Those of clients."""
        return [one for one in self._external_sessions.values() if isinstance(one, Session)]

    def sessions_of(self, identity: Identity) -> list[Session]:
        return [session for session in self.sessions if session.identity.is_same(identity)]

    async def stop(self) -> None:
        # asyncua waits for its clock's next tick, up to a second.
        task, self.time_task = self.time_task, None
        if task:
            task.cancel()
            await asyncio.gather(task, return_exceptions=True)
        for session in list(self._external_sessions.values()):
            await session.close_session()
        await super().stop()


def _limit(operations: Sequence[object] | None, most: int) -> None:
    if not operations:
        raise ServiceError(StatusCodes.BadNothingToDo)
    if len(operations) > most:
        raise ServiceError(StatusCodes.BadTooManyOperations)
