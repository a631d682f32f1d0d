"""Secure channels that are not offered: refused with the code that says so, and told as such."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from pathlib import Path

import pytest
from asyncua import Client, ua
from asyncua.common.connection import SecureConnection, TransportLimits
from asyncua.crypto.security_policies import SecurityPolicyNone
from asyncua.crypto.uacrypto import CertProperties
from asyncua.ua.ua_binary import struct_to_binary

from bridge.config import OpcUaTable
from bridge.northbound.opcua.server import OpcUaServer
from tests.support.opcua_peers import make_peer, make_users
from tests.support.opcua_site import break_off, serving
from tests.support.quiet import quiet_log

NO_POLICY, NO_MODE = ua.StatusCodes.BadSecurityPolicyRejected, ua.StatusCodes.BadSecurityModeRejected
HELLO = b"HELF\x20\0\0\0" + bytes(4) + (65535).to_bytes(4, "little") * 2 + bytes(12)
LIMITS = TransportLimits(65535, 65535, 1, 65535)


@pytest.fixture
async def server(tmp_path: Path) -> AsyncIterator[OpcUaServer]:
    """No open endpoint, nobody without a name."""
    async with serving(OpcUaTable(listen="127.0.0.1:0", user=make_users()), tmp_path) as (found, _):
        yield found


class Deprecated(SecurityPolicyNone):
    URI = "http://opcfoundation.org/UA/SecurityPolicy#Basic128Rsa15"


@pytest.mark.landing(3)
@pytest.mark.parametrize(
    ("policy", "mode", "code", "what"),
    [
        (Deprecated, ua.MessageSecurityMode.SignAndEncrypt, NO_POLICY, "Basic128Rsa15"),
        (SecurityPolicyNone, ua.MessageSecurityMode.Sign, NO_MODE, "mode Sign with None"),
        (SecurityPolicyNone, ua.MessageSecurityMode.Invalid, NO_MODE, "mode Invalid with None"),
    ],
)
async def test_what_is_not_offered_is_refused_by_its_name(
    server: OpcUaServer, policy: type[SecurityPolicyNone], mode: ua.MessageSecurityMode, code: int, what: str
) -> None:
    request = ua.OpenSecureChannelRequest()
    request.Parameters.SecurityMode = mode
    channel = SecureConnection(policy(), LIMITS)
    content = channel.message_to_binary(struct_to_binary(request), ua.MessageType.SecureOpen, 1)
    reader, writer = await asyncio.open_connection("127.0.0.1", server.port)
    with quiet_log() as log:
        writer.write(HELLO + content)
        async with asyncio.timeout(3):
            answer = await reader.read(-1)
    writer.close()
    assert int.from_bytes(answer[answer.index(b"ERRF") + 8 :][:4], "little") == code
    assert [line for line in log.lines if "refused channels" in line and what in line], log.lines


async def test_signing_alone_is_not_offered(server: OpcUaServer, tmp_path: Path) -> None:
    scada = make_peer("scada")
    scada.trusted_in(tmp_path)
    client = Client(server.endpoint_url, timeout=5)
    (endpoint, *_) = await client.connect_and_get_server_endpoints()
    await scada.secure(
        client,
        server_certificate=CertProperties(endpoint.ServerCertificate, "der"),
        mode=ua.MessageSecurityMode.Sign,
    )
    await client.connect_socket()
    await client.send_hello()
    with quiet_log() as log, pytest.raises((ua.UaError, ConnectionError, TimeoutError)):
        await client.open_secure_channel()
    break_off(client)
    assert [line for line in log.lines if "mode Sign with Basic256Sha256 is not offered" in line], log.lines


async def test_a_session_on_an_open_channel_that_is_for_endpoints_alone_is_told_as_such(
    server: OpcUaServer,
) -> None:
    client = Client(server.endpoint_url, timeout=5)
    await client.connect_socket()
    await client.send_hello()
    await client.open_secure_channel()
    with quiet_log() as log, pytest.raises(ua.uaerrors.BadSecurityPolicyRejected):
        await client.create_session()
    break_off(client)
    assert [line for line in log.lines if "refused channels" in line], log.lines
