"""A plain OPC UA client: bytes on a socket, with a channel and a session where they are wanted.

Markers in a message stand for what only a running connection knows: the ids of the channel and its security
token, the next sequence number, the session's authentication token, and the id of its subscription.
"""

from __future__ import annotations

import contextlib
import select
import socket
import struct
import time
from typing import Any, Final

from asyncua import ua
from asyncua.common.connection import SecureConnection, TransportLimits
from asyncua.common.utils import Buffer
from asyncua.crypto.security_policies import SecurityPolicyNone
from asyncua.ua.ua_binary import (
    header_from_binary,
    nodeid_from_binary,
    struct_from_binary,
    struct_to_binary,
    uatcp_to_binary,
)

from tests.fuzz.rig import STRANGER

CHANNEL: Final = b"\xc5\x01\xc5\x01"
TOKEN: Final = b"\xc5\x02\xc5\x02"
SEQUENCE: Final = b"\xc5\x03\xc5\x03"
SUBSCRIPTION: Final = b"\xc5\x05\xc5\x05"
SESSION: Final = b"\xc5\x04" * 16
HEAD: Final = struct.Struct("<4sI4s4s4sI")
"""Message type with its chunk flag, size, channel, token, sequence number, request id."""
_ANSWER_S: Final = 5.0
_SESSION_MS: Final = 10_000.0
_GOODBYE_S: Final = 0.1


def chunk(body: bytes, kind: bytes = b"MSGF", request: int = 1) -> bytes:
    """A chunk on the present channel, with markers."""
    return HEAD.pack(kind, HEAD.size + len(body), CHANNEL, TOKEN, SEQUENCE, request) + body


class Closed(Exception):
    """The server has closed the connection, or has not answered."""


class Channel:
    """One connection. Raises ``OSError`` or ``Closed`` where it does not come about."""

    def __init__(self, port: int) -> None:
        self._url = f"opc.tcp://127.0.0.1:{port}"
        self.socket = socket.create_connection(("127.0.0.1", port), timeout=2.0, source_address=(STRANGER, 0))
        self._connection = SecureConnection(SecurityPolicyNone(), TransportLimits(65535, 65535, 0, 0))
        self._session: bytes = SESSION
        self._subscription = 0
        self._authentication = ua.NodeId()
        self._request = 0
        self._sequence = 0
        self._rest = b""

    def close(self) -> None:
        with contextlib.suppress(OSError):
            self.socket.close()

    # up to a session

    def hello(self) -> None:
        hello = ua.Hello()
        hello.EndpointUrl = self._url
        self.socket.sendall(uatcp_to_binary(ua.MessageType.Hello, hello))
        self._receive()

    def open(self) -> None:
        request = ua.OpenSecureChannelRequest()
        request.Parameters.ClientNonce = b""
        request.Parameters.SecurityMode = ua.MessageSecurityMode.None_
        request.Parameters.RequestedLifetime = 60_000
        answer = self._ask(request, ua.OpenSecureChannelResponse, ua.MessageType.SecureOpen)
        self._connection.set_channel(answer.Parameters, request.Parameters.RequestType, b"")

    def activate(self) -> None:
        """Make a session as ``anonymous``, with a subscription."""
        create = ua.CreateSessionRequest()
        create.Parameters.EndpointUrl = self._url
        create.Parameters.SessionName = "fuzz"
        create.Parameters.RequestedSessionTimeout = _SESSION_MS
        made = self._ask(create, ua.CreateSessionResponse)
        activate = ua.ActivateSessionRequest()
        activate.RequestHeader.AuthenticationToken = made.Parameters.AuthenticationToken
        anonymous = ua.AnonymousIdentityToken()
        anonymous.PolicyId = next(
            policy.PolicyId
            for endpoint in made.Parameters.ServerEndpoints
            for policy in endpoint.UserIdentityTokens
            if policy.TokenType is ua.UserTokenType.Anonymous
        )
        activate.Parameters.UserIdentityToken = anonymous
        self._ask(activate, ua.ActivateSessionResponse)
        identifier = made.Parameters.AuthenticationToken.Identifier
        self._session = identifier if isinstance(identifier, bytes) else SESSION
        self._authentication = made.Parameters.AuthenticationToken
        with contextlib.suppress(Closed):  # there may be as many as there can be
            self._subscribe()

    def _subscribe(self) -> None:
        subscribe = ua.CreateSubscriptionRequest()
        subscribe.RequestHeader.AuthenticationToken = self._authentication
        subscribe.Parameters.RequestedPublishingInterval = 50.0
        subscribe.Parameters.RequestedLifetimeCount = 100
        subscribe.Parameters.RequestedMaxKeepAliveCount = 10
        self._subscription = self._ask(subscribe, ua.CreateSubscriptionResponse).Parameters.SubscriptionId

    def leave(self) -> None:
        """Close the session and the connection, as a client does that comes to its end."""
        with contextlib.suppress(OSError, Closed):
            if self._session == SESSION:
                raise Closed("there is no session")
            request = ua.CloseSessionRequest()
            request.RequestHeader.AuthenticationToken = self._authentication
            request.DeleteSubscriptions = True
            self.send(chunk(struct_to_binary(request)))
            self.listen(_GOODBYE_S)
        self.close()

    def _ask(
        self, request: Any, answer_type: type[Any], kind: ua.MessageType = ua.MessageType.SecureMessage
    ) -> Any:
        self._request += 1
        request.RequestHeader.RequestHandle = self._request
        request.RequestHeader.TimeoutHint = 5000
        raw = self._connection.message_to_binary(struct_to_binary(request), kind, self._request)
        self._sequence += 1
        self.socket.sendall(raw)
        body = self._receive().body()
        if "Fault" in type_name(bytes(body.copy())):
            raise Closed("a fault instead of an answer")
        return struct_from_binary(answer_type, body)

    def _receive(self) -> Any:
        end = time.monotonic() + _ANSWER_S
        while time.monotonic() < end:
            buffer = Buffer(self._rest)
            with contextlib.suppress(ua.utils.NotEnoughData):
                header = header_from_binary(buffer)
                if len(buffer) >= header.body_size:
                    message = self._connection.receive_from_header_and_body(header, buffer)
                    self._rest = bytes(buffer)
                    if isinstance(message, ua.ErrorMessage):
                        raise Closed(str(message))
                    if message is not None:
                        return message
                    continue
            try:
                data = self.socket.recv(65536)
            except TimeoutError:
                break
            if not data:
                break
            self._rest += data
        raise Closed("no answer")

    # whatever is wanted

    def send(self, raw: bytes) -> None:
        """Send these bytes, with what their markers stand for."""
        token = self._connection.security_token
        raw = raw.replace(CHANNEL, struct.pack("<I", token.ChannelId))
        raw = raw.replace(SUBSCRIPTION, struct.pack("<I", self._subscription))
        raw = raw.replace(TOKEN, struct.pack("<I", token.TokenId)).replace(SESSION, self._session)
        while SEQUENCE in raw:
            self._sequence += 1
            raw = raw.replace(SEQUENCE, struct.pack("<I", self._sequence), 1)
        self.socket.sendall(raw)

    def listen(self, wait_s: float, quiet_s: float = 0.005) -> None:
        """Take what comes until it is quiet. Raises ``Closed``."""
        while select.select([self.socket], [], [], wait_s)[0]:
            if not self.socket.recv(65536):
                raise Closed("closed")
            wait_s = quiet_s


def type_name(body: bytes) -> str:
    """The name of a message's type by its NodeId, or nothing."""
    try:
        found = nodeid_from_binary(Buffer(body))
        return ua.ObjectIdNames.get(found.Identifier, "").partition("_")[0]  # type: ignore[arg-type]
    except Exception:  # noqa: BLE001 - asyncua raises anything for what is none
        return ""
