"""Sessions that begin and end: each request has the answer that is true, and nothing stays behind."""

from __future__ import annotations

import asyncio
from collections import Counter

import pytest
from asyncua import Client, ua

from bridge.northbound.opcua.server import OpcUaServer
from tests.support.opcua_site import LocalView, break_off, connected

pytestmark = pytest.mark.asyncio(loop_scope="module")
Served = tuple[OpcUaServer, LocalView]


async def with_a_channel(served: Served) -> Client:
    client = Client(served[0].endpoint_url, timeout=5)
    await client.connect_socket()
    await client.send_hello()
    await client.open_secure_channel()
    return client


async def close_session(client: Client) -> None:
    """asyncua's own says nothing of what it is answered."""
    await client.uaclient.protocol.send_request(ua.CloseSessionRequest())


async def test_no_session_no_good_answer_to_its_close(served: Served) -> None:
    client = await with_a_channel(served)
    try:
        for _ in range(2):
            with pytest.raises(ua.uaerrors.BadSessionIdInvalid):
                await close_session(client)
        await client.create_session()
        await client.activate_session()
        await close_session(client)
        with pytest.raises(ua.uaerrors.BadSessionIdInvalid):
            await close_session(client)
    finally:
        break_off(client)


async def test_a_session_is_closed_by_the_channel_that_has_it_alone(served: Served) -> None:
    """Who has lost its connection first activates it on the new one (Part 4 §5.6.3)."""
    async with connected(served[0]) as owner:
        stranger = await with_a_channel(served)
        try:
            stranger.uaclient.protocol.authentication_token = owner.uaclient.protocol.authentication_token
            with pytest.raises(ua.uaerrors.BadSessionIdInvalid):
                await close_session(stranger)
        finally:
            break_off(stranger)
        await owner.nodes.server_state.read_value()


async def test_sessions_of_one_connection_leave_no_task_behind(served: Served) -> None:
    client = await with_a_channel(served)
    try:
        counts: list[Counter[str]] = []
        for _ in range(3):
            for _ in range(5):
                await client.create_session()
                await client.activate_session()
                await client.close_session()
            client._closing = False
            await asyncio.sleep(0)
            names = [getattr(task.get_coro(), "__qualname__", "") for task in asyncio.all_tasks()]
            counts.append(Counter(name for name in names if not name.startswith("Client.")))
        assert counts[2] == counts[0]
    finally:
        break_off(client)
