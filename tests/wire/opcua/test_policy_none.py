"""SecurityPolicy None, byte by byte: nothing is signed, nothing is encrypted, and nobody needs a nonce."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import pytest
import pytest_asyncio
from asyncua import Client, ua
from asyncua.common.utils import Buffer
from asyncua.ua.ua_binary import nodeid_from_binary, struct_from_binary, struct_to_binary

from bridge.northbound.opcua.server import OpcUaServer
from tests.support.opcua_site import OPEN, break_off, serving

pytestmark = pytest.mark.asyncio(loop_scope="module")
HELLO = b"HELF\x20\0\0\0" + bytes(4) + (65535).to_bytes(4, "little") * 2 + bytes(12)
POLICY = b"http://opcfoundation.org/UA/SecurityPolicy#None"
NULL = b"\xff\xff\xff\xff"
NONCES = {"null": None, "empty": b"", "one byte": b"\1", "32 bytes": bytes(range(32))}


def number(value: int) -> bytes:
    return value.to_bytes(4, "little")


ASYMMETRIC = number(len(POLICY)) + POLICY + NULL + NULL
"""Security header of an OPN message (Part 6 §6.7.2.3): the policy, no certificate, no thumbprint."""


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def server(tmp_path_factory: pytest.TempPathFactory) -> AsyncIterator[OpcUaServer]:
    async with serving(OPEN, tmp_path_factory.mktemp("state")) as (found, _):
        yield found


class Connection:
    def __init__(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._reader, self._writer = reader, writer
        self._sequence = 0

    async def hello(self) -> None:
        self._writer.write(HELLO)
        assert (await self._reader.readexactly(28))[:4] == b"ACKF"

    async def sent(self, kind: bytes, channel: int, security: bytes, request: Any) -> bytes:
        """What the answer holds behind the number of its channel."""
        self._sequence += 1
        body = number(channel) + security + number(self._sequence) + number(7) + struct_to_binary(request)
        self._writer.write(kind + b"F" + number(len(body) + 8) + body)
        async with asyncio.timeout(3):
            head = await self._reader.readexactly(12)
            assert head[:4] == kind + b"F"
            return await self._reader.readexactly(int.from_bytes(head[4:8], "little") - 12)


@asynccontextmanager
async def connection(server: OpcUaServer) -> AsyncIterator[Connection]:
    reader, writer = await asyncio.open_connection("127.0.0.1", server.port)
    try:
        made = Connection(reader, writer)
        await made.hello()
        yield made
    finally:
        writer.close()


def whole(content: bytes, kind: Any) -> Any:
    """The response behind a security header; the message ends with it: no padding, no signature."""
    buffer = Buffer(content)
    assert buffer.read(8)[4:] == number(7), "the request id"
    nodeid_from_binary(buffer.copy())
    response = struct_from_binary(kind, buffer)
    assert len(buffer) == 0
    return response


def opened(answer: bytes) -> Any:
    """Response to OpenSecureChannel, whose security header is that of the policy, without any key."""
    assert answer[: len(ASYMMETRIC)] == ASYMMETRIC
    return whole(answer[len(ASYMMETRIC) :], ua.OpenSecureChannelResponse).Parameters


def opening(nonce: bytes | None, kind: ua.SecurityTokenRequestType) -> ua.OpenSecureChannelRequest:
    params = ua.OpenSecureChannelParameters(
        RequestType=kind,
        SecurityMode=ua.MessageSecurityMode.None_,
        ClientNonce=nonce,
        RequestedLifetime=60_000,
    )
    return ua.OpenSecureChannelRequest(Parameters=params)


@pytest.mark.parametrize("nonce", NONCES.values(), ids=NONCES)
async def test_a_channel_has_no_nonce_and_no_keys(server: OpcUaServer, nonce: bytes | None) -> None:
    """Part 6 §6.7.4: nonces are ignored, and ours is null. Its tokens are given and renewed all the same."""
    async with connection(server) as one:
        issuing = opening(nonce, ua.SecurityTokenRequestType.Issue)
        answer = await one.sent(b"OPN", 0, ASYMMETRIC, issuing)
        first = opened(answer)
        assert answer[-4:] == NULL, "the nonce is the last field"
        token = first.SecurityToken
        renewing = opening(nonce, ua.SecurityTokenRequestType.Renew)
        answer = await one.sent(b"OPN", token.ChannelId, ASYMMETRIC, renewing)
        second = opened(answer)
        assert answer[-4:] == NULL
        assert second.SecurityToken.ChannelId == token.ChannelId
        assert second.SecurityToken.TokenId != token.TokenId


async def test_messages_are_as_they_are(server: OpcUaServer) -> None:
    async with connection(server) as one:
        request = opening(None, ua.SecurityTokenRequestType.Issue)
        token = opened(await one.sent(b"OPN", 0, ASYMMETRIC, request)).SecurityToken
        asked = ua.GetEndpointsRequest()
        answer = await one.sent(b"MSG", token.ChannelId, number(token.TokenId), asked)
        assert answer[:4] == number(token.TokenId)
        (endpoint, *_) = whole(answer[4:], ua.GetEndpointsResponse).Endpoints
        assert endpoint.SecurityPolicyUri.encode() in answer, "in clear text"


async def test_a_session_needs_no_nonce_no_certificate_and_no_signature(server: OpcUaServer) -> None:
    client = Client(server.endpoint_url, timeout=5)
    await client.connect_socket()
    try:
        await client.send_hello()
        await client.open_secure_channel()
        params = ua.CreateSessionParameters(RequestedSessionTimeout=60_000)
        params.ClientNonce = params.ClientCertificate = None
        await client.uaclient.create_session(params)
        activating = ua.ActivateSessionParameters()
        activating.UserIdentityToken = ua.AnonymousIdentityToken(PolicyId="anonymous")
        assert (activating.ClientSignature.Algorithm, activating.ClientSignature.Signature) == (None, None)
        await client.uaclient.activate_session(activating)
        assert await client.nodes.server_state.read_value() == 0
    finally:
        break_off(client)
