"""Connections: what may pass a channel, who may open a session on it, and answers out of turn.

Corrected here (``tests/wire/opcua/test_security.py``): sessions on a channel without security that
no endpoint offers, a session taken over from another channel, a Call of three
seconds that held up its own session's keep-alives, connections left hanging after an error, chunks of
any size.
"""

# asyncua's UaProcessor has no types:
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false, reportUnknownArgumentType=false

from __future__ import annotations

import asyncio
import logging
import socket
import struct
import time
from collections import deque
from typing import Any, Final

from asyncua.common.connection import TransportLimits
from asyncua.common.utils import Buffer
from asyncua.server.binary_server_asyncio import BinaryServer, OPCUAProtocol
from asyncua.server.internal_session import SessionState
from asyncua.server.uaprocessor import UaProcessor
from asyncua.ua.ua_binary import nodeid_from_binary, struct_from_binary, uatcp_to_binary
from cryptography.hazmat.primitives.serialization import Encoding

from bridge import clock
from bridge.command.freshness import NEVER, Inflow
from bridge.command.request import Identity
from bridge.northbound.opcua.library import (
    InvalidSignature,
    ObjectIds,
    ServiceError,
    StatusCodes,
    UaError,
    UaStatusCodeError,
    first_certificate,
    get,
    make,
    node_id,
    status,
    ua,
)
from bridge.northbound.opcua.routes import ROUTES, Request, carry_out
from bridge.northbound.opcua.security import read_password
from bridge.northbound.opcua.services import REFUSED
from bridge.northbound.opcua.session import Server, Session
from bridge.northbound.opcua.writes import received_at
from bridge.northbound.pulse import Pulse

_log = logging.getLogger(__name__)

_CREATE: Final = node_id(ObjectIds.CreateSessionRequest_Encoding_DefaultBinary)
_ACTIVATE: Final = node_id(ObjectIds.ActivateSessionRequest_Encoding_DefaultBinary)
_CLOSE_CHANNEL: Final = node_id(ObjectIds.CloseSecureChannelRequest_Encoding_DefaultBinary)
_DISCOVERY: Final = frozenset(
    (
        node_id(ObjectIds.GetEndpointsRequest_Encoding_DefaultBinary),
        node_id(ObjectIds.FindServersRequest_Encoding_DefaultBinary),
        _CLOSE_CHANNEL,
    )
)
_SLOW: Final = frozenset(
    (
        node_id(ObjectIds.WriteRequest_Encoding_DefaultBinary),
        node_id(ObjectIds.CallRequest_Encoding_DefaultBinary),
    )
)
"""Services that wait for the bus process."""

_ERROR: Final[Any] = ua.MessageType.Error
_MOST_WAITING: Final = 32
_MOST_UNREAD: Final = 64
"""Messages that a client which waits for its answers has under way at most."""
_READ_MOST: Final = 64 * 1024
"""Bytes that are read at once from such a client."""
WINDOW: Final = 2 * _READ_MOST
"""Bytes that may wait in the kernel: more than that, so that who fills it is noticed."""

_MALFORMED: Final = (
    UaError,
    InvalidSignature,
    ValueError,
    TypeError,
    LookupError,
    AttributeError,
    ArithmeticError,
    RecursionError,
    struct.error,
)
"""What asyncua's decoders raise for bytes that are not OPC UA."""


class Processor(UaProcessor):
    """One connection's messages."""

    def __init__(self, server: Server, transport: asyncio.Transport, limits: TransportLimits) -> None:
        super().__init__(server, transport, limits)
        self._server = server
        self._waiting: set[asyncio.Task[Any]] = set()
        self.arrivals: deque[float] = deque()
        """When the messages that are still to be processed can have come at the earliest, in their order."""

    async def process(self, header: Any, body: Buffer) -> bool:
        """False closes the connection; the client is told why first."""
        # For what is carried out from here on, the tasks that are made for it included.
        received_at.set(self.arrivals.popleft() if self.arrivals else NEVER)
        try:
            return bool(await super().process(header, body))
        except (ServiceError, UaStatusCodeError) as error:
            code = int(error.code)
        except _MALFORMED as error:
            _log.warning("closed the connection from %s: malformed message: %r", self.name, error)
            is_open = self._connection.is_open()
            code = StatusCodes.BadTcpInternalError if is_open else StatusCodes.BadSecurityChecksFailed
        message = make(ua.ErrorMessage, Error=status(code))
        self._transport.write(uatcp_to_binary(_ERROR, message))
        return False

    async def process_message(self, seqhdr: Any, body: Buffer) -> bool:
        """Requests that wait for a drive are answered when it has; the others go on meanwhile."""
        if nodeid_from_binary(body.copy()) not in _SLOW:
            return bool(await super().process_message(seqhdr, body))
        if len(self._waiting) >= _MOST_WAITING:
            await asyncio.wait(self._waiting, return_when=asyncio.FIRST_COMPLETED)
        task = asyncio.create_task(super().process_message(seqhdr, body))
        self._waiting.add(task)
        task.add_done_callback(self._waiting.discard)
        # One turn, so that it is on its way before the client's next request is looked at.
        await asyncio.sleep(0)
        return True

    async def _process_message(self, typeid: ua.NodeId, requesthdr: Any, seqhdr: Any, body: Buffer) -> Any:
        self._check(typeid, requesthdr)
        if typeid == _CREATE:
            params = struct_from_binary(ua.CreateSessionParameters, body.copy())
            certificate = self._channel_certificate()
            self._check_client_certificate(params, certificate)
            answer = await super()._process_message(typeid, requesthdr, seqhdr, body)
            if isinstance(self.session, Session):
                self.session.channel_certificate = certificate
                self.session.holder = self
            return answer
        if typeid == _ACTIVATE:
            session = self._session_to_activate(requesthdr)
            params = struct_from_binary(ua.ActivateSessionParameters, body.copy())
            # Nothing awaits between here and activate_session, so this login is for this call.
            session.admitted = await self._login(session, get(params, "UserIdentityToken"))
        if typeid in ROUTES:
            return await self._carry_out(typeid, requesthdr, seqhdr, body)
        try:
            answer = await super()._process_message(typeid, requesthdr, seqhdr, body)
        except InvalidSignature:
            raise ServiceError(StatusCodes.BadApplicationSignatureInvalid) from None
        if typeid == _ACTIVATE and isinstance(self.session, Session):
            self.session.holder = self
        return answer

    async def _carry_out(self, typeid: ua.NodeId, requesthdr: Any, seqhdr: Any, body: Buffer) -> bool:
        """A service that asyncua's processor does not leave to the session."""
        session = self.session
        if not isinstance(session, Session):
            raise ServiceError(StatusCodes.BadSessionIdInvalid)
        if not session.is_activated():
            raise ServiceError(StatusCodes.BadSessionNotActivated)
        self.session_last_activity = time.monotonic()
        session.touch()

        def send(response: Any) -> None:
            self.send_response(requesthdr.RequestHandle, seqhdr, response)

        def is_open() -> bool:
            return session.holder is self and not self._transport.is_closing()

        await carry_out(session, typeid, Request(requesthdr, body, send, is_open))
        return True

    async def close(self) -> None:
        for task in list(self._waiting):
            task.cancel()
        await super().close()

    def _should_close_session_on_transport_loss(self) -> bool:
        # It may have been activated on another connection meanwhile.
        if isinstance(self.session, Session) and self.session.holder is not self:
            return False
        return super()._should_close_session_on_transport_loss()

    # what may pass

    def _check(self, typeid: ua.NodeId, requesthdr: Any) -> None:
        """Raises ServiceError for a request that has no business on this channel or in this session."""
        if typeid in REFUSED:
            raise ServiceError(REFUSED[typeid])
        if typeid in _DISCOVERY:
            return
        if not self._is_secured() and not self._server.no_security:
            raise ServiceError(StatusCodes.BadSecurityPolicyRejected)
        session = self.session
        if isinstance(session, Session) and session.holder is not self:
            # Activated on another connection; this one has lost it (Part 4 §5.6.3).
            session = self.session = None
        if session is None or session.state is SessionState.Closed:
            return
        if typeid == _CREATE:
            raise ServiceError(StatusCodes.BadTooManySessions)
        if requesthdr.AuthenticationToken != session.auth_token:
            raise ServiceError(StatusCodes.BadSessionIdInvalid)

    def _is_secured(self) -> bool:
        return self._connection.security_policy.Mode is not ua.MessageSecurityMode.None_

    def _channel_certificate(self) -> bytes | None:
        """The certificate whose key the client has shown to have, in DER."""
        return self._connection.security_policy.peer_certificate if self._is_secured() else None

    def _check_client_certificate(self, params: Any, channel: bytes | None) -> None:
        if channel is None or not params.ClientCertificate:
            return
        named = first_certificate(params.ClientCertificate)
        if named is None or named.public_bytes(Encoding.DER) != channel:
            raise ServiceError(StatusCodes.BadSecurityChecksFailed)

    def _session_to_activate(self, requesthdr: Any) -> Session:
        session = self.session or self._server.lookup_external_session(requesthdr.AuthenticationToken)
        if not isinstance(session, Session) or session.state is SessionState.Closed:
            raise ServiceError(StatusCodes.BadSessionIdInvalid)
        if session.channel_certificate != self._channel_certificate():
            _log.warning("refused %s: the session was made with another certificate", self.name)
            raise ServiceError(StatusCodes.BadSecurityChecksFailed)
        return session

    async def _login(self, session: Session, token: Any) -> Identity:
        users = self._server.services.users
        if isinstance(token, ua.UserNameIdentityToken):
            key = self._server.private_key
            password = read_password(token, session.nonce or b"", key, encrypted=self._is_secured())
            return await users.login(get(token, "UserName") or "", password, session.address)
        is_null = isinstance(token, ua.ExtensionObject) and token.TypeId == node_id(ObjectIds.Null)
        if is_null or isinstance(token, ua.AnonymousIdentityToken):
            return users.anonymous(session.address)
        raise ServiceError(StatusCodes.BadIdentityTokenRejected)


class _Protocol(OPCUAProtocol):
    """Notes with each message when it can have come: it may wait here, or in the bus process."""

    def __init__(self, pulse: Pulse, **settings: Any) -> None:
        super().__init__(**settings)
        self._pulse = pulse
        self._inflow = Inflow(clock.now(), pulse.look)

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        super().connection_made(transport)
        # Its task has not run yet, so no message has seen the other processor.
        if self.transport is not None and isinstance(self.iserver, Server):
            self.processor = Processor(self.iserver, self.transport, self.limits)
            self.processor.set_policies(self.policies)

    def data_received(self, data: bytes) -> None:
        before = self.messages.qsize()
        super().data_received(data)
        waiting = self.messages.qsize()
        crowded = len(data) >= _READ_MOST or waiting > _MOST_UNREAD
        came_at = self._inflow.arrive(clock.now(), self._pulse.look, crowded=crowded)
        if isinstance(self.processor, Processor):
            self.processor.arrivals += [came_at] * (waiting - before)
        # What is left is part of one chunk. asyncua would wait for the 4 GiB that a header may ask for.
        if len(self._buffer) > self.limits.max_recv_buffer and self.transport is not None:
            _log.warning("closed the connection from %s: a chunk without end", self.peer_name)
            self._buffer = b""
            self.transport.close()


class Listener(BinaryServer):
    """Takes connections on a socket that is bound already."""

    def __init__(self, server: Server, bound: socket.socket, limits: TransportLimits, pulse: Pulse) -> None:
        host, port = bound.getsockname()[:2]
        super().__init__(server, host, port, limits)
        self._socket = bound
        self._pulse = pulse

    def _make_protocol(self) -> OPCUAProtocol:
        return _Protocol(
            self._pulse,
            iserver=self.iserver,
            policies=self._policies,
            clients=self.clients,
            closing_tasks=self.closing_tasks,
            limits=self.limits,
        )

    async def start(self) -> None:
        loop = asyncio.get_running_loop()
        self._server = await loop.create_server(self._make_protocol, sock=self._socket)
        self.cleanup_task = asyncio.create_task(self._close_task_loop())
