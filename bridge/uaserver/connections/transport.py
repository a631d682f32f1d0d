"""A connection's messages: what may pass a channel, who may open a session on it, answers out of turn.

Corrected here (``tests/wire/opcua/test_security.py``, ``test_sessions.py``): sessions on a channel without
security that no endpoint offers, a session taken over from another channel, a Call of three
seconds that held up its own session's keep-alives, connections left hanging after an error, buffers of
any size, a session that ended with a connection it had left.
"""

# asyncua's UaProcessor has no types:
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false, reportUnknownArgumentType=false
# pyright: reportPrivateUsage=false

from __future__ import annotations

import asyncio
import logging
from collections import deque
from collections.abc import Coroutine, Sequence
from datetime import UTC, datetime
from functools import partial
from typing import Any, Final

from asyncua.common.connection import TransportLimits
from asyncua.common.utils import Buffer
from asyncua.server.internal_session import SessionState
from asyncua.server.uaprocessor import UaProcessor
from asyncua.ua.ua_binary import nodeid_from_binary, struct_from_binary, uatcp_to_binary
from cryptography.hazmat.primitives.serialization import Encoding

from bridge.base import clock
from bridge.base.sources import source_of
from bridge.uaserver import decoding
from bridge.uaserver.application import LoginAttempt, UserIdentity
from bridge.uaserver.arrivals import NEVER, received_at
from bridge.uaserver.client_notices import tell
from bridge.uaserver.connection_limits import ConnectionStage
from bridge.uaserver.connections.security import SecureChannel, check_policy
from bridge.uaserver.encoding import encode
from bridge.uaserver.explanations import fault
from bridge.uaserver.inner_server import InnerServer
from bridge.uaserver.languages import speaking
from bridge.uaserver.library import (
    ExplainedFault,
    InvalidSignature,
    ServiceError,
    StatusCodes,
    UaStatusCodeError,
    first_certificate,
    get,
    make,
    status,
    ua,
)
from bridge.uaserver.routes import ROUTES, Route, ServiceRequest
from bridge.uaserver.services import NAMES, REFUSED, request_type
from bridge.uaserver.session import Session
from bridge.uaserver.states import REFUSALS, Need, RequestSession, need_of
from bridge.uaserver.subscriptions.quotas import make_room_for_session
from bridge.uaserver.undertakings import Undertakings, finish

_SLOW: Final = (request_type("Write"), request_type("Call"))
"""Services that may take seconds."""

_ERROR: Final[Any] = ua.MessageType.Error
_LEAST_BUFFER: Final = 8192
"""Part 6 §7.1.2.3. Answers are cut into chunks that small."""
MOST_BEFORE_SESSION: Final = 256 * 1024
"""Bytes of messages of a connection; what comes before a session is some kilobytes."""
_MOST_UNDER_WAY: Final = 16 * 1024 * 1024
"""Bytes of messages that may wait for their turn, and of answers for a client to read them."""
_MALFORMED_KIND: Final = "malformed messages"


class Processor(UaProcessor):
    """One connection's messages."""

    def __init__(self, server: InnerServer, transport: asyncio.Transport, limits: TransportLimits) -> None:
        super().__init__(server, transport, limits)
        self._server = server
        self._connection: SecureChannel = SecureChannel(self._connection.security_policy, self._limits)
        self._undertakings = Undertakings()
        self._source = source_of(str(self.name[0]) if isinstance(self.name, tuple) else str(self.name))
        self._connection.source = self._source
        self._was_greeted = False
        self.arrivals: deque[float] = deque()
        """Earliest times at which the messages that are still to be processed can have come, in their
        order."""

    @property
    def stage(self) -> ConnectionStage:
        session = self.session
        if isinstance(session, Session) and session.holder is self and session.is_activated():
            return ConnectionStage.SESSION
        if self._connection.is_open():
            return ConnectionStage.CHANNEL
        return ConnectionStage.GREETED if self._was_greeted else ConnectionStage.CONNECTED

    @property
    def most_bytes(self) -> int:
        """Limit for messages that wait for their turn: little as long as nobody has a session."""
        return _MOST_UNDER_WAY if self.stage is ConnectionStage.SESSION else MOST_BEFORE_SESSION

    @property
    def _incoming(self) -> int:
        """Bytes of a message of which chunks are still to come."""
        return self._connection._incoming_size

    @property
    def held(self) -> int:
        """Bytes of messages and answers that are neither complete nor sent."""
        answer = self.session.answer if isinstance(self.session, Session) else None
        return self._incoming + (len(answer.encoded) if answer else 0)

    @property
    def _locales(self) -> Sequence[str]:
        return self.session.locales if isinstance(self.session, Session) else ()

    def _begin(self) -> None:
        most = (
            decoding.MOST_ELEMENTS if self.stage is ConnectionStage.SESSION else decoding.MOST_BEFORE_SESSION
        )
        decoding.begin(most)

    def _check_size(self, header: Any) -> None:
        """asyncua's own limits, and less before there is a session. Raises ServiceError."""
        is_too_large = (
            header.packet_size > self._limits.max_recv_buffer
            or self._incoming + header.body_size > min(self.most_bytes, self._limits.max_message_size)
            or len(self._connection._incoming_parts) >= self._limits.max_chunk_count
        )
        if is_too_large:
            tell("messages too large", self._source, "connection closed")
            raise ServiceError(StatusCodes.BadRequestTooLarge)

    async def process(self, header: Any, body: Buffer) -> bool:
        """False closes the connection, after telling the client why."""
        # For what is carried out from here on, the tasks that are made for it included.
        received_at.set(self.arrivals.popleft() if self.arrivals else NEVER)
        self._begin()
        try:
            self._check_size(header)
            goes_on = bool(await super().process(header, body))
            if header.MessageType == ua.MessageType.Hello:
                self._greeted()
            return goes_on
        except (ServiceError, UaStatusCodeError) as error:
            code = int(error.code)
            is_too_large = code == StatusCodes.BadRequestTooLarge
            self._count(is_broken=is_too_large)
        except decoding.MALFORMED as error:
            self._count(is_broken=True)
            tell(_MALFORMED_KIND, self._source, f"connection closed: {error!r}")
            code = StatusCodes.BadSecurityChecksFailed
            if self._connection.is_open():
                is_malformed = decoding.is_malformed(error)
                code = StatusCodes.BadDecodingError if is_malformed else StatusCodes.BadTcpInternalError
        except Exception as error:  # noqa: BLE001 - nor may one message end the others' connections
            self._count(is_broken=True)
            self._server.guard.note(error)
            code = StatusCodes.BadTcpInternalError
        self._say(code)
        return False

    def end(self, code: int) -> None:
        """Close the connection, and tell the client why."""
        self._count(is_broken=True)
        self._say(code)
        self._transport.close()

    def _say(self, code: int) -> None:
        message = make(ua.ErrorMessage, Error=status(code))
        self._transport.write(uatcp_to_binary(_ERROR, message))

    def _count(self, *, is_broken: bool) -> None:
        """A connection that ends, once: what came before it was closed is still looked at."""
        if not self._transport.is_closing():
            application = self._server.application
            (application.on_broken if is_broken else application.on_refused)()

    def _greeted(self) -> None:
        if min(self._limits.max_send_buffer, self._limits.max_message_size) < _LEAST_BUFFER:
            raise ServiceError(StatusCodes.BadConnectionRejected)
        self._was_greeted = True

    async def process_message(self, seqhdr: Any, body: Buffer) -> bool:
        """Requests that may take seconds are answered when they are done; the others go on meanwhile."""
        typeid = nodeid_from_binary(body)
        header = body.copy()
        try:
            requesthdr = struct_from_binary(ua.RequestHeader, body)
        except decoding.MALFORMED as error:
            unread = make(ua.RequestHeader, RequestHandle=decoding.request_handle(header))
            self._refuse(unread, seqhdr, self._fault(error))
            return True
        if typeid not in _SLOW:
            try:
                return await self._serve(typeid, requesthdr, seqhdr, body)
            finally:
                if isinstance(self.session, Session):
                    self.session.answer = None
        await self._undertakings.room()
        self._undertakings.begin(self._serve(typeid, requesthdr, seqhdr, body))
        # One turn, so that it is on its way before the client's next request is looked at.
        await asyncio.sleep(0)
        return True

    async def _serve(self, typeid: ua.NodeId, requesthdr: Any, seqhdr: Any, body: Buffer) -> bool:
        """Carry out a request. Whatever is wrong with it is its answer, and ends nothing."""
        try:
            goes_on = bool(await self._process_message(typeid, requesthdr, seqhdr, body))
            self._note(typeid, StatusCodes.Good)
            return goes_on
        except (ServiceError, UaStatusCodeError) as error:
            code, why = int(error.code), error.why if isinstance(error, ExplainedFault) else ""
        except Exception as error:  # noqa: BLE001 - asyncua logs a traceback for each
            code, why = self._fault(error), str(error) if decoding.is_malformed(error) else ""
        self._note(typeid, code)
        self._refuse(requesthdr, seqhdr, code, why)
        return True

    def _note(self, typeid: ua.NodeId, code: int) -> None:
        """Count a request for the diagnostics."""
        if code:
            is_of_session = need_of(typeid) in (Need.CREATE, Need.ACTIVATE)
            self._server.counts.refuse(code, of_session=is_of_session)
        session = self.session
        if isinstance(session, Session) and session.holder is self and typeid in NAMES:
            session.counts.note(NAMES[typeid], code)
            session.facts.seen_at = datetime.now(UTC)

    def _refuse(self, requesthdr: Any, seqhdr: Any, code: int, why: str = "") -> None:
        self.send_response(requesthdr.RequestHandle, seqhdr, fault(requesthdr, code, why))

    def _fault(self, error: Exception) -> int:
        if decoding.is_malformed(error):
            tell(_MALFORMED_KIND, self._source, repr(error))
            return StatusCodes.BadDecodingError
        # Ours or asyncua's fault: its place instead of a traceback, which would cost twenty lines.
        detail = f"{error!r} {decoding.place(error)}"
        tell("requests that failed", self._source, detail, logging.ERROR)
        return StatusCodes.BadInternalError

    def send_response(
        self, requesthandle: Any, seqhdr: Any, response: Any, msgtype: Any = ua.MessageType.SecureMessage
    ) -> None:
        """Raises ServiceError for an answer that is larger than the client takes it."""
        if self._transport.get_write_buffer_size() > _MOST_UNDER_WAY:
            self._server.application.on_broken()
            tell("answers not read", self._source, "connection closed")
            self._transport.abort()
            return
        response.ResponseHeader.RequestHandle = requesthandle
        with speaking(self._locales):
            body = encode(response)
        if len(body) > self._limits.max_message_size:
            raise ServiceError(StatusCodes.BadResponseTooLarge)
        self._transport.write(self._connection.message_to_binary(body, msgtype, seqhdr.RequestId))

    async def _process_message(self, typeid: ua.NodeId, requesthdr: Any, seqhdr: Any, body: Buffer) -> Any:
        need = need_of(typeid)
        try:
            self._check(typeid, need, requesthdr)
        except ServiceError as error:
            # Part 4 §5.7.3.1: who uses a session before it is activated has none any more.
            if error.code == StatusCodes.BadSessionNotActivated and isinstance(self.session, Session):
                await self.session.abort()
            raise
        self._begin()
        if need is Need.CREATE:
            params = struct_from_binary(ua.CreateSessionParameters, body.copy())
            certificate = self._channel_certificate()
            self._check_client_certificate(params, certificate)
            self._connection.judge_again(get(get(params, "ClientDescription"), "ApplicationUri") or "")
            await self._make_room()
            answer = await super()._process_message(typeid, requesthdr, seqhdr, body)
            if isinstance(self.session, Session):
                self.session.channel_certificate = certificate
                self._hold(self.session)
            return answer
        if need is Need.ACTIVATE:
            session = self._session_to_activate(requesthdr)
            params = struct_from_binary(ua.ActivateSessionParameters, body.copy())
            # Nothing awaits between here and activate_session, so this login is for this call.
            try:
                session.admitted = await self._login(session, params)
            except ServiceError:
                self._server.application.on_refused()
                raise
            self._begin()
        if typeid in ROUTES:
            return await self._carry_out(ROUTES[typeid], requesthdr, seqhdr, body)
        try:
            answer = await super()._process_message(typeid, requesthdr, seqhdr, body)
        except InvalidSignature:
            raise ServiceError(StatusCodes.BadApplicationSignatureInvalid) from None
        if need is Need.ACTIVATE and isinstance(self.session, Session):
            self._hold(self.session)
        return answer

    def open_secure_channel(self, algohdr: Any, seqhdr: Any, body: Any) -> None:
        """Raises ServiceError, also for a renewal by a client that has lost its trust meanwhile."""
        if self._connection.is_open():
            self._connection.judge_again()
        super().open_secure_channel(algohdr, seqhdr, body)

    async def _make_room(self) -> None:
        try:
            await make_room_for_session(
                self._source, self._server.sessions, self._server.application.highest_rank
            )
        except ServiceError:
            self._server.application.on_refused()
            tell("refused sessions", self._source, "all that it may have, or all there are, are in use")
            raise

    def _hold(self, session: Session) -> None:
        if session.holder is not self:
            session.shown = self._server.shown
        session.holder, session.most_bytes = self, self._limits.max_message_size
        session.undertakings = self._undertakings
        session.facts.note_channel(self._connection.security_policy)

    async def _session_watchdog_loop(self) -> None:
        """Not needed: a session watches its own time-out, or ends with the connection it was made on.
        asyncua's loop would stay behind for each session that was closed."""

    async def _carry_out(self, route: Route, requesthdr: Any, seqhdr: Any, body: Buffer) -> bool:
        session = self.session
        assert isinstance(session, Session), "checked"
        session.touch()

        send = partial(self.send_response, requesthdr.RequestHandle, seqhdr)
        refuse = partial(self._refuse, requesthdr, seqhdr)

        def is_open() -> bool:
            return session.holder is self and not self._transport.is_closing()

        async def defer(work: Coroutine[Any, Any, None]) -> None:
            await self._undertakings.room()
            self._undertakings.begin(finish(work, is_open, refuse), requesthdr.RequestHandle)

        # Results are encoded as they are found.
        with speaking(session.locales):
            await route.carry_out(session, ServiceRequest(requesthdr, body, send, is_open, defer))
        return True

    async def close(self) -> None:
        self._undertakings.cancel_all()
        if isinstance(self.session, Session) and self._should_close_session_on_transport_loss():
            await self.session.abort()
        await super().close()
        if isinstance(self.session, Session) and self.session.holder is self:
            self.session.leave(clock.now())

    def _should_close_session_on_transport_loss(self) -> bool:
        # It may have been activated on another connection meanwhile.
        if isinstance(self.session, Session) and self.session.holder is not self:
            return False
        return super()._should_close_session_on_transport_loss()

    # what may pass

    def _check(self, typeid: ua.NodeId, need: Need, requesthdr: Any) -> None:
        """Raises ServiceError for a request that has no business on this channel or in this session."""
        if typeid in REFUSED:
            raise ServiceError(REFUSED[typeid])
        if need is Need.USE and typeid not in ROUTES:
            raise ServiceError(StatusCodes.BadServiceUnsupported)
        if need is Need.DISCOVER:
            return
        if not self._is_secured() and not self._server.no_security:
            tell("refused channels", self._source, "a session on one without security, which is not offered")
            raise ServiceError(StatusCodes.BadSecurityPolicyRejected)
        state = self._state(requesthdr)
        if state in (RequestSession.ENDED, RequestSession.MOVED):
            self.session = None
        if state in REFUSALS[need]:
            raise ServiceError(REFUSALS[need][state])

    def _state(self, requesthdr: Any) -> RequestSession:
        session = self.session
        if not isinstance(session, Session):
            return RequestSession.NONE
        if session.holder is not self:
            return RequestSession.MOVED  # and this one has lost it (Part 4 §5.6.3)
        if session.state is SessionState.Closed:
            return RequestSession.ENDED
        if requesthdr.AuthenticationToken != session.auth_token:
            return RequestSession.OTHER
        return RequestSession.ACTIVATED if session.is_activated() else RequestSession.CREATED

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
        if session.holder is not self and not session.is_activated():
            # Part 4 §5.6.3: for the first time on the channel that it was created on.
            raise ServiceError(StatusCodes.BadSecureChannelIdInvalid)
        if session.channel_certificate != self._channel_certificate():
            self._server.application.on_refused()
            tell("refused sessions", self._source, "made with another certificate")
            raise ServiceError(StatusCodes.BadSecurityChecksFailed)
        return session

    async def _login(self, session: Session, params: Any) -> UserIdentity:
        """Raises ServiceError, also for another user than that of a session which comes from another channel
        (Part 4 §5.6.3): whoever has its token and its certificate is not yet its user."""
        token = get(params, "UserIdentityToken")
        check_policy(token, self._server.endpoints)
        own = session.shown if session.holder is self else self._server.shown
        login = LoginAttempt(
            token,
            get(params, "UserTokenSignature"),
            session.nonce or b"",
            own.key,
            self._connection.security_policy.host_certificate or own.certificate,
            session.address,
            session.label,
            encrypted=self._is_secured(),
        )
        who: UserIdentity = await self._server.application.identify(login)
        if session.holder is not self and session.is_activated() and not who.is_same(session.identity):
            tell(
                "refused sessions", self._source, f"that of {session.identity.name}, activated by {who.name}"
            )
            raise ServiceError(StatusCodes.BadIdentityChangeNotSupported)
        return who
