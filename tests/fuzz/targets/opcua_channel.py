"""A plain OPC UA client: bytes on a socket, with a channel and a session where they are wanted.

Markers in a message stand for what only a running connection knows: the ids of the channel and its security
token, the next sequence number, the session's authentication token, the ids of its subscription and of the
first item there, the handles of files that it has open, and the latest event of an alarm.
"""

from __future__ import annotations

import contextlib
import os
import select
import socket
import struct
import time
from typing import Any, Final

from asyncua import ua
from asyncua.common.connection import SecureConnection, TransportLimits
from asyncua.common.utils import Buffer
from asyncua.crypto.security_policies import SecurityPolicy, SecurityPolicyNone
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
ITEM: Final = b"\xc5\x06\xc5\x06"
HANDLE: Final = b"\xc5\x07\xc5\x07"
"""Of a file to be read."""
OTHER_HANDLE: Final = b"\xc5\x08\xc5\x08"
"""Of a file to be written, where the session has one."""
EVENT: Final = b"\xc5\x09" * 8
SESSION: Final = b"\xc5\x04" * 16
ALARM: Final = "conveyor/fu1/Alarm"
"""Active from the beginning: that fu1 stops without the bridge is not proven."""
FILE: Final = "conveyor/fu1/BlackBox/1"
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

    def __init__(self, port: int, policy: SecurityPolicy | None = None) -> None:
        self._url = f"opc.tcp://127.0.0.1:{port}"
        self.socket = socket.create_connection(("127.0.0.1", port), timeout=2.0, source_address=(STRANGER, 0))
        self._policy = policy or SecurityPolicyNone()
        self._connection = SecureConnection(self._policy, TransportLimits(65535, 65535, 0, 0))
        self._session: bytes = SESSION
        self._known: dict[bytes, bytes] = {}
        """Bytes for markers, where there are any."""
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
        nonce = os.urandom(self._policy.secure_channel_nonce_length)
        request = ua.OpenSecureChannelRequest()
        request.Parameters.ClientNonce = nonce
        request.Parameters.SecurityMode = self._policy.Mode
        request.Parameters.RequestedLifetime = 60_000
        answer = self._ask(request, ua.OpenSecureChannelResponse, ua.MessageType.SecureOpen)
        self._connection.set_channel(answer.Parameters, request.Parameters.RequestType, nonce)

    def activate(self) -> None:
        """Make a session, and what the markers stand for."""
        create = ua.CreateSessionRequest()
        create.Parameters.EndpointUrl = self._url
        create.Parameters.SessionName = "fuzz"
        create.Parameters.RequestedSessionTimeout = _SESSION_MS
        self._describe(create.Parameters)
        made = self._ask(create, ua.CreateSessionResponse).Parameters
        self._authentication = made.AuthenticationToken
        activate = ua.ActivateSessionRequest()
        self._identify(made, activate.Parameters)
        self._ask(activate, ua.ActivateSessionResponse)
        identifier = made.AuthenticationToken.Identifier
        self._session = identifier if isinstance(identifier, bytes) else SESSION
        self._prepare()

    def _describe(self, create: ua.CreateSessionParameters) -> None:
        """Say who this client is."""

    def _identify(self, made: ua.CreateSessionResult, activate: ua.ActivateSessionParameters) -> None:
        """As ``anonymous``."""
        anonymous = ua.AnonymousIdentityToken()
        anonymous.PolicyId = next(
            policy.PolicyId
            for endpoint in made.ServerEndpoints
            for policy in endpoint.UserIdentityTokens
            if policy.TokenType is ua.UserTokenType.Anonymous
        )
        activate.UserIdentityToken = anonymous

    def _prepare(self) -> None:
        """A subscription with two items, a file, and the event of an alarm."""
        with contextlib.suppress(Closed):  # there may be as many as there can be
            self._subscribe()
            self._monitor()
        spaces: list[str] = self._read(ua.NodeId(ua.ObjectIds.Server_NamespaceArray))
        space = spaces.index("urn:drivebridge:points")
        event = self._read(ua.NodeId(f"{ALARM}/EventId", space))
        self._known[EVENT] = event if event else EVENT
        file, method = ua.NodeId(FILE, space), ua.NodeId(ua.ObjectIds.FileType_Open)
        self._open_file(HANDLE, file, method, 1)

    def _subscribe(self) -> None:
        subscribe = ua.CreateSubscriptionRequest()
        subscribe.Parameters.RequestedPublishingInterval = 50.0
        subscribe.Parameters.RequestedLifetimeCount = 100
        subscribe.Parameters.RequestedMaxKeepAliveCount = 10
        made = self._ask(subscribe, ua.CreateSubscriptionResponse).Parameters
        self._known[SUBSCRIPTION] = struct.pack("<I", made.SubscriptionId)

    def _monitor(self) -> None:
        state = ua.ReadValueId(ua.NodeId(ua.ObjectIds.Server_ServerStatus_CurrentTime), ua.AttributeIds.Value)
        events = ua.ReadValueId(ua.NodeId(ua.ObjectIds.Server), ua.AttributeIds.EventNotifier)
        message = ua.SimpleAttributeOperand(
            ua.NodeId(ua.ObjectIds.BaseEventType), [ua.QualifiedName("Message", 0)], ua.AttributeIds.Value
        )
        wanted = ua.EventFilter([message], ua.ContentFilter([]))
        request = ua.CreateMonitoredItemsRequest()
        request.Parameters.SubscriptionId = int.from_bytes(self._known[SUBSCRIPTION], "little")
        request.Parameters.ItemsToCreate = [
            ua.MonitoredItemCreateRequest(node, ua.MonitoringMode.Reporting, settings)
            for node, settings in (
                (events, ua.MonitoringParameters(1, Filter=wanted)),
                (state, ua.MonitoringParameters(2)),
            )
        ]
        first = self._ask(request, ua.CreateMonitoredItemsResponse).Results[0]
        self._known[ITEM] = struct.pack("<I", first.MonitoredItemId)

    def _read(self, node: ua.NodeId) -> Any:
        request = ua.ReadRequest()
        request.Parameters.NodesToRead = [ua.ReadValueId(node, ua.AttributeIds.Value)]
        return self._ask(request, ua.ReadResponse).Results[0].Value.Value

    def _open_file(self, marker: bytes, file: ua.NodeId, method: ua.NodeId, mode: int) -> None:
        """Keep the handle for the marker, if there is one to be had."""
        result = self._call(file, method, ua.Variant(mode, ua.VariantType.Byte))
        if result.OutputArguments:
            self._known[marker] = struct.pack("<I", result.OutputArguments[0].Value)

    def _call(self, where: ua.NodeId, method: ua.NodeId, given: ua.Variant) -> ua.CallMethodResult:
        request = ua.CallRequest()
        request.Parameters.MethodsToCall = [ua.CallMethodRequest(where, method, [given])]
        return self._ask(request, ua.CallResponse).Results[0]

    def leave(self) -> None:
        """Close the session and the connection, as a client does that comes to its end."""
        with contextlib.suppress(OSError, Closed):
            if self._session == SESSION:
                raise Closed("there is no session")
            request = ua.CloseSessionRequest()
            request.RequestHeader.AuthenticationToken = self._authentication
            request.DeleteSubscriptions = True
            self.send_body(struct_to_binary(request))
            self.listen(_GOODBYE_S)
        self.close()

    def _ask(
        self, request: Any, answer_type: type[Any], kind: ua.MessageType = ua.MessageType.SecureMessage
    ) -> Any:
        self._request += 1
        request.RequestHeader.AuthenticationToken = self._authentication
        request.RequestHeader.RequestHandle = self._request
        request.RequestHeader.TimeoutHint = 5000
        raw = self._connection.message_to_binary(struct_to_binary(request), kind, self._request)
        self._sequence += 1
        self.socket.sendall(raw)
        while True:
            body = self._receive().body()
            found = type_name(bytes(body.copy()))
            if "Fault" in found:
                raise Closed("a fault instead of an answer")
            if found == answer_type.__name__:
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
        raw = self._with_known(raw).replace(TOKEN, struct.pack("<I", token.TokenId))
        while SEQUENCE in raw:
            self._sequence += 1
            raw = raw.replace(SEQUENCE, struct.pack("<I", self._sequence), 1)
        self.socket.sendall(raw)

    def send_body(self, body: bytes) -> None:
        """Send a request, with what its markers stand for."""
        self.send(chunk(body))

    def answered(self, body: bytes) -> bytes:
        """Body of the answer to a request that asks for none of what the subscription has to tell."""
        self.send_body(body)
        return bytes(self._receive().body())

    def _with_known(self, raw: bytes) -> bytes:
        for marker, known in self._known.items():
            raw = raw.replace(marker, known)
        return raw.replace(SESSION, self._session)

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
