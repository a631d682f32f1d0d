"""A client's connection that sends every request as it is given, and tells every answer as it comes.

The channel has no security. Encoding is asyncua's; what its client corrects or adds is left out.
"""

from __future__ import annotations

import socket
import struct
import time
from collections.abc import Sequence
from typing import Any, Final

from asyncua import ua
from asyncua.common.utils import Buffer
from asyncua.ua.ua_binary import nodeid_from_binary, struct_from_binary, struct_to_binary

_NONE: Final = b"http://opcfoundation.org/UA/SecurityPolicy#None"
_FAULT: Final = ua.NodeId(ua.ObjectIds.ServiceFault_Encoding_DefaultBinary)
_HELLO: Final = struct.Struct("<4sIIIIII")
_HEAD: Final = struct.Struct("<4sI")
_SEQUENCE: Final = struct.Struct("<II")
_BUFFER: Final = 65535
_LIFETIME_MS: Final = 3_600_000


class ChannelClosedError(Exception):
    """The server has closed the connection; ``code`` is what it said, 0 for nothing."""

    def __init__(self, code: int = 0) -> None:
        super().__init__(f"closed with {code:#010x}")
        self.code = code


class Channel:
    """Blocking. Answers that nobody has asked for yet are kept."""

    def __init__(self, port: int, timeout_s: float = 10.0) -> None:
        self.url = f"opc.tcp://127.0.0.1:{port}"
        self._socket = socket.create_connection(("127.0.0.1", port), timeout_s)
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._received = b""
        self._parts: dict[int, bytes] = {}
        self._answers: dict[int, bytes] = {}
        self._services: dict[int, str] = {}
        self._number = 0
        self._channel = self._token = 0
        self._open()

    def _open(self) -> None:
        url = self.url.encode()
        size = _HELLO.size + 4 + len(url)
        hello = _HELLO.pack(b"HELF", size, 0, _BUFFER, _BUFFER, 0, 0)
        self._socket.sendall(hello + struct.pack("<i", len(url)) + url)
        kind, _ = self._message(time.monotonic() + 10)
        assert kind == b"ACKF", kind
        request = ua.OpenSecureChannelRequest()
        request.Parameters.SecurityMode = ua.MessageSecurityMode.None_
        request.Parameters.RequestedLifetime = _LIFETIME_MS
        policy = struct.pack("<Iiii", 0, len(_NONE), -1, -1)
        security = policy[:8] + _NONE + policy[8:]
        self._send(b"OPNF", security, struct_to_binary(request))
        kind, body = self._message(time.monotonic() + 10)
        assert kind == b"OPNF", kind
        head = 4 + 4 + len(_NONE) + 4 + 4 + _SEQUENCE.size
        opened = struct_from_binary(ua.OpenSecureChannelResponse, Buffer(body[head:]))
        security_token = opened.Parameters.SecurityToken
        self._channel, self._token = security_token.ChannelId, security_token.TokenId

    def send(self, service: str, request: Any, session: ua.NodeId) -> int:
        """Its number, by which the answer is asked for."""
        number = self._number + 1
        request.RequestHeader.AuthenticationToken = session
        request.RequestHeader.RequestHandle = number
        self._services[number] = service
        self._send(b"MSGF", struct.pack("<II", self._channel, self._token), struct_to_binary(request))
        return number

    def _send(self, kind: bytes, security: bytes, body: bytes) -> None:
        self._number += 1
        rest = security + _SEQUENCE.pack(self._number, self._number) + body
        try:
            self._socket.sendall(_HEAD.pack(kind, _HEAD.size + len(rest)) + rest)
        except OSError:
            self._raise()

    def receive(self, number: int, timeout_s: float = 10.0) -> Any:
        """The answer, a ServiceFault among them. Raises TimeoutError and ChannelClosedError."""
        return self.receive_any([number], timeout_s)[1]

    def receive_any(self, numbers: Sequence[int], timeout_s: float) -> tuple[int, Any]:
        """The first answer to one of these requests, with the request's number."""
        until = time.monotonic() + timeout_s
        while not (found := next((number for number in numbers if number in self._answers), 0)):
            kind, body = self._message(until)
            if kind[:3] != b"MSG":
                raise AssertionError(kind)
            request, content = struct.unpack_from("<I", body, 12)[0], body[16:]
            content = self._parts.pop(request, b"") + content
            if kind == b"MSGC":
                self._parts[request] = content
            else:
                self._answers[request] = content
        answer, service = self._answers.pop(found), self._services.pop(found)
        is_fault = nodeid_from_binary(Buffer(answer)) == _FAULT
        made = ua.ServiceFault if is_fault else getattr(ua, f"{service}Response")
        return found, struct_from_binary(made, Buffer(answer))

    def _message(self, until: float) -> tuple[bytes, bytes]:
        """Kind and content of the next message. What came before the time ran out is kept."""
        while True:
            if len(self._received) >= _HEAD.size:
                kind, size = _HEAD.unpack_from(self._received)
                if len(self._received) >= size:
                    body, self._received = self._received[_HEAD.size : size], self._received[size:]
                    if kind[:3] == b"ERR":
                        raise ChannelClosedError(struct.unpack_from("<I", body)[0])
                    return kind, body
            self._socket.settimeout(max(until - time.monotonic(), 0.001))
            try:
                more = self._socket.recv(_BUFFER)
            except OSError as error:
                if isinstance(error, TimeoutError):
                    raise
                more = b""
            if not more:
                raise ChannelClosedError
            self._received += more

    def _raise(self) -> None:
        """The server has closed: with what it said before, if it said something."""
        while True:
            self._message(time.monotonic() + 0.5)

    def close(self) -> None:
        self._socket.close()
