"""A client's session: its identity, what it may see, and what it holds.

Corrected here, each with a test in ``tests/wire/opcua/test_security.py``: sequential session tokens, and
reads of what is not readable, subscriptions that end with a session's time-out.
"""

from __future__ import annotations

import asyncio
import math
import secrets
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, Protocol, cast

from asyncua.crypto.permission_rules import User, UserRole
from asyncua.server.address_space import AddressSpace
from asyncua.server.internal_server import InternalServer
from asyncua.server.internal_session import InternalSession, SessionState
from asyncua.server.subscription_service import SubscriptionService
from cryptography.hazmat.primitives.asymmetric.rsa import RSAPrivateKey

from bridge.base.sources import source_of
from bridge.uaserver.application import NOBODY, ServedApplication, UserIdentity
from bridge.uaserver.browsing import Browser
from bridge.uaserver.client_notices import tell
from bridge.uaserver.conditions.calls import METHODS
from bridge.uaserver.conditions.conditions import Conditions
from bridge.uaserver.counts import RequestCounts, ServerCounts
from bridge.uaserver.diagnostics.diagnosticnodes import DiagnosticNodes
from bridge.uaserver.diagnostics.diagnostics import SessionFacts
from bridge.uaserver.encoding import Results
from bridge.uaserver.explanations import Explain, Explanation
from bridge.uaserver.garbage import GarbageCollector
from bridge.uaserver.history.historyread import HistoryReader
from bridge.uaserver.library import (
    AttributeIds,
    ServiceError,
    StatusCodes,
    change,
    data_value,
    get,
    node_id,
    status,
    ua,
    variant,
)
from bridge.uaserver.loop import loop_time
from bridge.uaserver.reading import checked_times, window
from bridge.uaserver.servermethods import SERVER_METHODS, ServerCalls
from bridge.uaserver.subscriptions.publishing import PublishQueue
from bridge.uaserver.subscriptions.quotas import make_room
from bridge.uaserver.subscriptions.subscriptions import Subscriptions
from bridge.uaserver.undertakings import Undertakings

_TOKEN_BYTES: Final = 32
_NAME_BYTES: Final = 4
"""Length of the name by which a session is told from others of its user, also from those before a restart."""
_MOST_LOCALES: Final = 10
_READ: Final = 1
_READ_HISTORY: Final = 4
"""Bits of an access level."""
_BY_USER: Final = {
    AttributeIds.UserAccessLevel: _READ | _READ_HISTORY,
    AttributeIds.UserExecutable: False,
}
"""Attributes that depend on who looks, with what is left of them for who may only read."""
_NOTHING: Final = variant(None, ua.VariantType.Null)
_NOT_FOR_HIM: Final = data_value(_NOTHING, status(StatusCodes.BadUserAccessDenied))
_NOT_READABLE: Final = data_value(_NOTHING, status(StatusCodes.BadNotReadable))


class SessionConnection(Protocol):
    """Connection that a session is activated on."""

    def end(self, code: int) -> None:
        """Close it, and tell the client why."""
        ...


@dataclass(frozen=True, slots=True)
class ShownCertificate:
    """Certificate of the server, in DER, with its key."""

    certificate: bytes
    key: RSAPrivateKey


class SessionServer(Protocol):
    """Server of a session, as far as a session needs it."""

    application: ServedApplication[Any]
    conditions: Conditions | None
    subscriptions: Subscriptions
    diagnostics: DiagnosticNodes
    garbage: GarbageCollector

    @property
    def counts(self) -> ServerCounts: ...

    @property
    def shown(self) -> ShownCertificate: ...

    @property
    def sessions(self) -> Sequence[Session]:
        """Sessions of clients."""
        ...

    def register_external_session(self, session: InternalSession) -> None: ...


class Session(InternalSession):
    """One client. ``channel_certificate`` is that of the channel the session was made on."""

    def __init__(
        self, server: SessionServer, aspace: AddressSpace, subscriptions: SubscriptionService, name: str
    ) -> None:
        # Registered below, under a token that nobody can guess.
        inner = cast("InternalServer", server)
        super().__init__(inner, aspace, subscriptions, name, User(UserRole.Anonymous), external=False)
        self._server = server
        self.auth_token = node_id(secrets.token_bytes(_TOKEN_BYTES), 0, ua.NodeIdType.ByteString)
        self.external = True
        server.register_external_session(self)
        self.address = str(name[0]) if isinstance(name, tuple) else str(name)
        self.label = f"session {secrets.token_hex(_NAME_BYTES)}"
        self.identity: UserIdentity = NOBODY
        self.channel_certificate: bytes | None = None
        self.shown = server.shown
        """Certificate of the server when the session came to its connection: a client encrypts for it."""
        self.publishing = PublishQueue()
        self.browser = Browser(aspace)
        self.holder: SessionConnection | None = None
        self.history = HistoryReader(aspace, server.subscriptions.items.event_types)
        """The processor of the connection that it is activated on."""
        self.answer: Results | None = None
        """Answer that is being encoded for it."""
        self.most_bytes = 0
        """Largest answer that its client accepts on that connection, in bytes."""
        self.left_at = 0.0
        """Monotonic time at which it lost its last connection."""
        self.undertakings = Undertakings()
        """Requests under way on the connection that it is activated on."""
        self.refreshing = asyncio.Lock()
        """Held by the one request that has values brought: those of one client wait for each other."""
        self.counts = RequestCounts()
        self.facts = SessionFacts()
        self.locales: Sequence[str] = ()
        """LocaleIds of its client, the preferred one first."""
        self.admitted: UserIdentity | None = None
        """User for whom ``activate_session`` is; set by the processor once the login has been checked."""

    @property
    def is_gone(self) -> bool:
        return self.state is SessionState.Closed

    @property
    def subscriptions(self) -> Subscriptions:
        return self._server.subscriptions

    async def create_session(
        self, params: ua.CreateSessionParameters, sockname: tuple[str, int] | None = None
    ) -> ua.CreateSessionResult:
        if math.isnan(get(params, "RequestedSessionTimeout")):
            # asyncua's `min` and `max` let it pass, and the session would never end.
            change(params, RequestedSessionTimeout=0.0)
        self.facts = SessionFacts.of(params)
        self._server.counts.sessions += 1
        return await super().create_session(params, sockname)

    def activate_session(
        self, params: ua.ActivateSessionParameters, peer_certificate: bytes | None
    ) -> ua.ActivateSessionResult:
        admitted, self.admitted = self.admitted, None
        if admitted is None:
            raise ServiceError(StatusCodes.BadIdentityTokenRejected)
        result = super().activate_session(params, peer_certificate)
        if not admitted.is_same(self.identity):
            self._tell(is_there=False)  # for the user before
        self.identity = admitted
        mechanism = type(get(params, "UserIdentityToken")).__name__.removesuffix("IdentityToken")
        self.facts.note_user(admitted.name, mechanism)
        # Part 4 §5.6.3: who names none later on keeps those that he has named.
        self.locales = (get(params, "LocaleIds") or self.locales)[:_MOST_LOCALES]
        self._tell(is_there=True)
        # Never Admin: that role may change the address space and write anything.
        self.user = User(UserRole.User, admitted.name)
        return result

    @property
    def application(self) -> ServedApplication[Any]:
        return self._server.application

    def leave(self, now: float) -> None:
        """Note that its connection has ended. It may be activated on another one, and goes on then."""
        self.holder, self.left_at = None, now
        self._tell(is_there=False)

    def _tell(self, *, is_there: bool) -> None:
        """Say that the session can be used, or that it cannot."""
        if self.identity is NOBODY:
            return  # it never was
        others = (one for one in self._server.sessions if one is not self and one.holder is not None)
        has_others = any(self.identity.is_same(one.identity) for one in others)
        self.application.on_connection(self.identity, is_there=is_there, has_others=has_others)

    # services

    def cancel(self, handle: int) -> int:
        """Cancel the requests that the client calls so, where they change nothing; how many there were."""
        return self.publishing.cancel(handle) + self.undertakings.cancel(handle)

    def stale(self, params: ua.ReadParameters) -> Sequence[ua.NodeId]:
        """Nodes whose values are to be brought from where they come from before they are read: those that
        can be, where the client accepts no older ones (Part 4 §5.11.2.2)."""
        if get(params, "MaxAge") != 0:
            return ()
        wanted: list[ua.ReadValueId] = get(params, "NodesToRead")
        values = (get(one, "NodeId") for one in wanted if get(one, "AttributeId") == AttributeIds.Value)
        return self.application.refreshable(values)

    async def read_attributes(
        self,
        params: ua.ReadParameters,
        refused: Mapping[ua.NodeId, tuple[ua.StatusCode, Explanation]],
        explain: Explain,
    ) -> Results:
        """``refused`` are the nodes whose values could not be brought."""
        wanted: list[ua.ReadValueId] = get(params, "NodesToRead")
        times = checked_times(params)
        # `not >=` refuses NaN, too.
        if not get(params, "MaxAge") >= 0:
            raise ServiceError(StatusCodes.BadMaxAgeInvalid)
        results = self.answer = Results(self.most_bytes)
        for place, one in enumerate(wanted):
            where = get(one, "NodeId")
            if where in refused and get(one, "AttributeId") == AttributeIds.Value:
                code, why = refused[where]
                explain(place, why)
                await results.add(data_value(_NOTHING, code))
            else:
                await results.add(self._read(one, times))
        return results

    async def read_history(self, params: ua.HistoryReadParameters) -> Any:
        results = self.answer = Results(self.most_bytes)
        await self.history.read(params, self.application, results)
        return results

    def _read(self, wanted: ua.ReadValueId, times: ua.TimestampsToReturn) -> ua.DataValue:
        try:
            looked_at = window(wanted, times)
        except ServiceError as error:
            return data_value(_NOTHING, status(int(error.code)))
        where, attribute = get(wanted, "NodeId"), get(wanted, "AttributeId")
        value = self.aspace.read_attribute_value(where, attribute)
        return looked_at.timed(looked_at.part(self.seen(where, attribute, value)))

    def looks_alike(self, where: ua.NodeId, attribute: AttributeIds) -> bool:
        """Whether everybody sees the same of it: its values as they are."""
        if attribute == AttributeIds.Value:
            return self._is_readable(where) and not self._server.diagnostics.is_about_someone(where)
        return attribute not in _BY_USER

    def seen(self, where: ua.NodeId, attribute: AttributeIds, value: ua.DataValue) -> ua.DataValue:
        """``value`` as this user may see it."""
        if attribute == AttributeIds.Value:
            if self._is_hidden(where):
                return _NOT_FOR_HIM
            return value if self._is_readable(where) else _NOT_READABLE
        held = value.Value
        if attribute == AttributeIds.UserRolePermissions:
            return _granted(value, self.application.roles(self.identity))
        if attribute not in _BY_USER or held is None or not held.Value:
            return value
        if self.application.may(self.identity, where):
            return value
        left = variant(held.Value & _BY_USER[attribute], held.VariantType)
        return data_value(left, value.StatusCode, value.SourceTimestamp, value.ServerTimestamp)

    def _is_hidden(self, where: ua.NodeId) -> bool:
        diagnostics = self._server.diagnostics
        if not diagnostics.is_about_someone(where):
            return False
        return diagnostics.is_hidden(where, self, may_see_all=self.application.may_diagnose(self.identity))

    def _is_readable(self, where: ua.NodeId) -> bool:
        node = self.aspace.get(where)
        access = node.attributes.get(AttributeIds.AccessLevel) if node else None
        held = access.value.Value if access and access.value else None
        return held is None or bool(held.Value & _READ)

    async def call_methods(
        self, calls: Sequence[ua.CallMethodRequest], explain: Explain
    ) -> list[ua.CallMethodResult]:
        """One result for each of ``calls``, in their order: methods of conditions and of the Server object
        are this server's own, all others the application's."""
        conditions, turns = self._server.conditions, asyncio.Lock()
        own_calls = ServerCalls(self.subscriptions, self)

        async def call_one(place: int, one: ua.CallMethodRequest) -> ua.CallMethodResult:
            method = get(one, "MethodId")
            if method in SERVER_METHODS or (conditions is not None and method in METHODS):
                async with turns:  # one each time that the loop goes round: they do their work at once
                    await asyncio.sleep(0)
            if method in SERVER_METHODS:
                return own_calls.call(one)
            if conditions is not None and method in METHODS:
                return await conditions.call(self, one)
            (result,) = await self.application.call(self.identity, [one], lambda _, why: explain(place, why))
            return result

        return list(await asyncio.gather(*(call_one(place, one) for place, one in enumerate(calls))))

    async def subscribe(self, params: ua.CreateSubscriptionParameters) -> ua.CreateSubscriptionResult:
        await self.subscriptions.drop_left_behind()
        await make_room(self, self._server.sessions, self.subscriptions.subscriptions)
        return self.subscriptions.create(self, params)

    async def _timeout_loop(self) -> None:
        """Replacement of asyncua's loop, which deletes the subscriptions with the session: they are there for
        a transfer as long as they live (Part 4 §5.6.4)."""
        while self.state is not SessionState.Closed:
            left_s = (self.session_timeout or 0.0) + self._last_activity - loop_time()
            if left_s <= 0:
                self._server.counts.sessions_timed_out += 1
                await self.close_session(delete_subs=False)
                return
            await asyncio.sleep(left_s)

    async def evict(self) -> None:
        """End it, with its subscriptions and its connection, for somebody with a higher role."""
        holder = self.holder
        tell("sessions that made room for a higher role", source_of(self.address), self.identity.name)
        await self.close_session()
        if holder:
            holder.end(StatusCodes.BadTcpServerTooBusy)

    async def abort(self, *, delete_subs: bool = True) -> None:
        """End it for an error, of its client or of the network, and count that (Part 5 §12.9)."""
        self._server.counts.sessions_aborted += not self.is_gone
        await self.close_session(delete_subs)

    async def close_session(self, delete_subs: bool = True) -> None:
        # asyncua closes it again when its connection ends, and would have the subscriptions deleted then.
        if self.state is SessionState.Closed:
            return
        self._tell(is_there=False)
        self.publishing.close(loop_time())
        await super().close_session(delete_subs=False)
        self._server.garbage.note_end()
        await self.subscriptions.end(self, delete=delete_subs)


def _granted(value: ua.DataValue, roles: Sequence[ua.NodeId]) -> ua.DataValue:
    """The entries of RolePermissions that are for ``roles``."""
    if value.Value is None or not value.Value.Value:
        return value
    entries = [one for one in value.Value.Value if get(one, "RoleId") in roles]
    return data_value(variant(entries, ua.VariantType.ExtensionObject), value.StatusCode)
