"""What connections may have under way: little before there is a session, and all together a fixed sum."""

from __future__ import annotations

import asyncio
import struct
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import pytest
from asyncua import Client, ua

from bridge.northbound.opcua.server import OpcUaServer
from bridge.uaserver import connection_limits
from bridge.uaserver.connections import acceptor
from bridge.uaserver.connections.transport import MOST_BEFORE_SESSION
from tests.support.opcua_site import OPEN, LocalView, break_off, connected, serving
from tests.support.quiet import quiet_log
from tests.support.zenoh_peer import until

CHUNK = 60_000
ENDED = "bridge/opcua_broken_connections"


def chunk(client: Client, size: int = CHUNK) -> bytes:
    """Of a message that does not end."""
    connection: Any = client.uaclient.protocol._connection
    connection._sequence_number += 1
    token = connection.security_token
    head = b"MSGC", 24 + size, token.ChannelId, token.TokenId, connection._sequence_number, 77
    return struct.pack("<4sIIIII", *head) + bytes(size)


@asynccontextmanager
async def channel(server: OpcUaServer) -> AsyncIterator[Client]:
    client = Client(server.endpoint_url, timeout=5)
    await client.connect_socket()
    await client.send_hello()
    await client.open_secure_channel(renew=False)
    try:
        yield client
    finally:
        break_off(client)


@asynccontextmanager
async def session(server: OpcUaServer) -> AsyncIterator[Client]:
    async with channel(server) as client:
        await client.create_session()
        await client.activate_session()
        yield client


def is_closed(client: Client) -> bool:
    protocol: Any = client.uaclient.protocol
    return protocol is None or protocol.transport is None or protocol.transport.is_closing()


def send(client: Client, content: bytes) -> None:
    if not is_closed(client):
        client.uaclient.protocol.transport.write(content)


async def test_a_message_without_end_before_a_session_ends_soon(tmp_path: Path) -> None:
    async with serving(OPEN, tmp_path) as (server, view), connected(server) as other:
        before = ended(view)
        with quiet_log() as log:
            async with channel(server) as client:
                for _ in range(MOST_BEFORE_SESSION // CHUNK):
                    send(client, chunk(client))
                    await asyncio.sleep(0.02)
                assert not is_closed(client)
                send(client, chunk(client))
                await until(lambda: is_closed(client), "the end of the connection")
        assert any("messages too large from 127.0.0.1" in line for line in log.lines), log.lines
        assert ended(view) == before + 1
        await other.nodes.server_state.read_value()


@pytest.mark.landing
async def test_messages_that_wait_before_a_session_are_few(tmp_path: Path) -> None:
    """All at once: nobody looks at them in between."""
    async with serving(OPEN, tmp_path) as (server, view), channel(server) as client:
        before = ended(view)
        chunks = b"".join(chunk(client) for _ in range(2 * MOST_BEFORE_SESSION // CHUNK))
        send(client, chunks)
        await until(lambda: is_closed(client), "the end of the connection")
        await asyncio.sleep(0.1)
        assert ended(view) == before + 1, "one connection, whatever is left of its messages"


@pytest.mark.landing
async def test_with_a_session_a_large_message_may_come(tmp_path: Path) -> None:
    async with serving(OPEN, tmp_path) as (server, _), connected(server) as client:
        request = ua.ReadRequest()
        request.RequestHeader.AuditEntryId = "x" * (4 * MOST_BEFORE_SESSION)
        with pytest.raises(ua.uaerrors.BadNothingToDo):
            await client.uaclient.protocol.send_request(request)


@pytest.mark.landing
async def test_all_together_hold_a_fixed_sum(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connection_limits, "MOST_HELD", 1_000_000)
    monkeypatch.setattr(acceptor, "_UNWEIGHED", 100_000)
    async with serving(OPEN, tmp_path) as (server, view), connected(server) as bystander:
        before = ended(view)
        async with session(server) as small, session(server) as large:
            for client, chunks in ((small, 6), (large, 12)):
                for _ in range(chunks):
                    send(client, chunk(client))
                    await asyncio.sleep(0.02)
            await until(lambda: is_closed(large), "the end of who holds the most")
            assert ended(view) == before + 1
            assert not is_closed(small)
            await bystander.nodes.server_state.read_value()


@pytest.mark.landing
async def test_answers_that_nobody_reads_are_part_of_the_sum(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(connection_limits, "MOST_HELD", 1_000_000)
    async with serving(OPEN, tmp_path) as (server, view), connected(server) as bystander:
        before = ended(view)
        async with session(server) as client:
            client.uaclient.protocol.transport.pause_reading()
            wanted = ua.ReadValueId(
                NodeId=ua.NodeId(ua.ObjectIds.OpcUa_XmlSchema), AttributeId=ua.AttributeIds.Value
            )
            request = ua.ReadRequest()
            request.Parameters.NodesToRead = [wanted] * 40
            answer = asyncio.create_task(client.uaclient.protocol.send_request(request))
            await until(lambda: ended(view) == before + 1, "the end of the connection")
            answer.cancel()
            await bystander.nodes.server_state.read_value()


def ended(view: LocalView) -> Any:
    return view.image.read(ENDED).value
