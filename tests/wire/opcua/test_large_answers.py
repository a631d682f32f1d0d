"""Small requests with large answers: none is made that is larger than a client may have."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest
from asyncua import Client, ua

from bridge.northbound.opcua.server import OpcUaServer
from tests.support.opcua_site import LocalView, break_off, connected

pytestmark = pytest.mark.asyncio(loop_scope="module")
Served = tuple[OpcUaServer, LocalView]

LARGE = (ua.ObjectIds.OpcUa_XmlSchema, ua.ObjectIds.OpcUa_BinarySchema)
"""Some hundred kilobytes each, and readable for everybody."""


def reads(node: int, times: int) -> ua.ReadRequest:
    wanted = ua.ReadValueId(NodeId=ua.NodeId(node), AttributeId=ua.AttributeIds.Value)
    request = ua.ReadRequest()
    request.Parameters.NodesToRead = [wanted] * times
    return request


def browses(node: int, times: int) -> ua.BrowseRequest:
    wanted = ua.BrowseDescription(
        NodeId=ua.NodeId(node), BrowseDirection=ua.BrowseDirection.Both, ResultMask=63
    )
    request = ua.BrowseRequest()
    request.Parameters.NodesToBrowse = [wanted] * times
    return request


TOO_LARGE = {
    "Read of one large value": reads(LARGE[0], 200),
    "Read of another": reads(LARGE[1], 200),
    "Read of many": reads(ua.ObjectIds.Server_NamespaceArray, 2_000),
    "Browse": browses(ua.ObjectIds.Structure, 300),
}


@pytest.mark.parametrize("what", TOO_LARGE)
async def test_what_is_larger_than_the_client_takes_is_refused(served: Served, what: str) -> None:
    client = Client(served[0].endpoint_url, timeout=30)
    client.max_messagesize = 100_000
    await client.connect_socket()
    try:
        await client.send_hello()
        await client.open_secure_channel()
        await client.create_session()
        await client.activate_session()
        with pytest.raises(ua.uaerrors.BadResponseTooLarge):
            await client.uaclient.protocol.send_request(TOO_LARGE[what])
        await client.nodes.server_state.read_value()
    finally:
        break_off(client)


@pytest.mark.parametrize("what", ["Read of one large value", "Read of another"])
async def test_what_nobody_could_read_is_refused_before_it_is_made(served: Served, what: str) -> None:
    async with connected(served[0]) as client:
        with pytest.raises(ua.uaerrors.BadResponseTooLarge):
            await client.uaclient.protocol.send_request(TOO_LARGE[what])
        await client.nodes.server_state.read_value()


class Sizes:
    def __init__(self) -> None:
        self.values = 0

    def datachange_notification(self, node: object, value: Any, data: object) -> None:
        self.values += 1


async def test_a_message_of_a_subscription_is_no_larger_than_the_client_takes(
    served: Served, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with connected(served[0]) as client:
        sizes: list[int] = []
        protocol: Any = client.uaclient.protocol
        received = protocol._process_received_message

        def process(message: Any) -> None:
            if isinstance(message, ua.Message):
                sizes.append(len(message.body()))
            received(message)

        monkeypatch.setattr(protocol, "_process_received_message", process)
        seen = Sizes()
        subscription = await client.create_subscription(50, seen)
        nodes = [client.get_node(ua.NodeId(LARGE[0]))] * 40
        await subscription.subscribe_data_change(nodes)
        for _ in range(200):
            await asyncio.sleep(0.05)
            if seen.values == len(nodes):
                break
        assert seen.values == len(nodes)
        assert max(sizes) < 2 * 1024 * 1024
