"""What the profiles of the standard ask for beside services: limits, and methods of the Server object."""

from __future__ import annotations

import asyncio

import pytest
from asyncua import Client, ua
from asyncua.ua.ua_binary import struct_from_binary

from bridge.northbound.opcua.server import OpcUaServer
from bridge.uaserver.conformance import claimed
from tests.support.opcua_raw import answered, ask, asking, item, monitored, published, subscribed, values
from tests.support.opcua_services import LOAD, client, load, point, served, server, view
from tests.support.opcua_site import LocalView, connected

__all__ = ["client", "served", "server", "view"]

pytestmark = pytest.mark.asyncio(loop_scope="module")
Codes, Ids = ua.StatusCodes, ua.ObjectIds


async def call(client: Client, method: int, *arguments: ua.Variant) -> ua.CallMethodResult:
    wanted = ua.CallMethodRequest(ua.NodeId(Ids.Server), ua.NodeId(method), list(arguments))
    (result,) = (await ask(client, "Call", MethodsToCall=[wanted])).Results
    return result


def number(value: int) -> ua.Variant:
    return ua.Variant(value, ua.VariantType.UInt32)


async def test_the_server_claims_no_more_than_is_held(client: Client) -> None:
    told = await client.get_node(Ids.Server_ServerCapabilities_ServerProfileArray).read_value()
    assert told == claimed()


async def test_a_request_is_answered_by_its_handle_with_what_it_asks_for(client: Client) -> None:
    """Every service: the session's token, the request's handle, its diagnostics and its time-out."""
    too_many = [ua.ReadValueId(ua.NodeId(Ids.Server), ua.AttributeIds.NodeId)] * 10_001
    for request, code in (
        (asking("Read", NodesToRead=too_many[:1]), Codes.Good),
        (asking("Read", 0x07, NodesToRead=too_many), Codes.BadTooManyOperations),
        (asking("Read", NodesToRead=too_many), Codes.BadTooManyOperations),
    ):
        header = (await answered(client, request)).ResponseHeader
        assert (header.RequestHandle, header.ServiceResult.value) == (
            request.RequestHeader.RequestHandle,
            code,
        )
        info, table = header.ServiceDiagnostics, header.StringTable
        is_explained = bool(code and request.RequestHeader.ReturnDiagnostics)
        assert (info.AdditionalInfo is not None, info.LocalizedText is not None) == (is_explained,) * 2
        if is_explained:
            assert "too many operations" in table[info.LocalizedText]
            assert info.AdditionalInfo == "10001 operations, where one request may have 10000"
    await subscribed(client, 5000)
    hasty = asking("Publish")
    future = client.uaclient.protocol._send_request(hasty, 0.2)  # pyright: ignore[reportPrivateUsage]
    own = client.uaclient.protocol.authentication_token
    client.uaclient.session.restore_authentication_token(ua.NodeId(b"x" * 32, 0, ua.NodeIdType.ByteString))
    wrong = await answered(client, asking("Read", NodesToRead=too_many[:1]))
    assert wrong.ResponseHeader.ServiceResult.value == Codes.BadSessionIdInvalid
    client.uaclient.session.restore_authentication_token(own)
    fault = struct_from_binary(ua.ServiceFault, await asyncio.wait_for(future, 8))
    assert fault.ResponseHeader.RequestHandle == hasty.RequestHeader.RequestHandle
    assert fault.ResponseHeader.ServiceResult.value == Codes.BadTimeout


async def test_a_client_that_has_forgotten_its_items_asks_for_them(
    client: Client, server: OpcUaServer
) -> None:
    found = (await subscribed(client)).SubscriptionId
    node = await point(client, LOAD)
    made = await monitored(client, found, [item(node, ClientHandle=handle) for handle in (3, 9)])
    result = await call(client, Ids.Server_GetMonitoredItems, number(found))
    servers, clients = (one.Value for one in result.OutputArguments)
    assert (servers, clients) == ([one.MonitoredItemId for one in made], [3, 9])
    for arguments, code in (
        ((number(4711),), Codes.BadSubscriptionIdInvalid),
        ((), Codes.BadArgumentsMissing),
        ((number(found), number(found)), Codes.BadTooManyArguments),
        ((ua.Variant("x"),), Codes.BadInvalidArgument),
    ):
        result = await call(client, Ids.Server_GetMonitoredItems, *arguments)
        assert result.StatusCode.value == code
    async with connected(server) as other:
        for method in (Ids.Server_GetMonitoredItems, Ids.Server_ResendData):
            result = await call(other, method, number(found))
            assert result.StatusCode.value == Codes.BadUserAccessDenied


async def test_values_are_sent_again_to_who_asks(client: Client, view: LocalView) -> None:
    load(view, 7.0)
    found = (await subscribed(client)).SubscriptionId
    await monitored(client, found, [item(await point(client, LOAD))])
    assert [one.Value.Value for one in values((await published(client)).NotificationMessage)] == [7.0]
    assert (await call(client, Ids.Server_ResendData, number(found))).StatusCode.is_good()
    assert [one.Value.Value for one in values((await published(client)).NotificationMessage)] == [7.0]


async def test_ten_publish_requests_may_wait(client: Client) -> None:
    found = (await subscribed(client, 5000)).SubscriptionId
    await published(client)  # that it is there
    waiting = [asyncio.create_task(published(client)) for _ in range(10)]
    await asyncio.sleep(0.2)
    assert not any(one.done() for one in waiting)
    await ask(client, "DeleteSubscriptions", SubscriptionIds=[found])
    codes = await asyncio.gather(*waiting, return_exceptions=True)
    assert {getattr(one, "code", None) for one in codes} == {Codes.BadNoSubscription}


async def test_there_is_room_for_what_the_standard_profile_asks(client: Client) -> None:
    """Five subscriptions of a session with five hundred items each, with a queue of five."""
    node = await point(client, LOAD)
    for nodes in (node, ua.NodeId(Ids.Server_NamespaceArray)) * 2 + (ua.NodeId(Ids.Server_ServerArray),):
        found = (await subscribed(client, 10_000)).SubscriptionId
        made = await monitored(client, found, [item(nodes, QueueSize=5)] * 500)
        assert all(one.StatusCode.is_good() and one.RevisedQueueSize == 5 for one in made)


@pytest.mark.landing(8)
async def test_fifty_sessions_are_served_at_a_time(server: OpcUaServer) -> None:
    clients = [Client(server.endpoint_url, timeout=20, watchdog_intervall=20) for _ in range(49)]
    try:
        for one in clients:
            await one.connect()
        states = [await one.nodes.server_state.read_value() for one in clients]
        assert states == [0] * 49
    finally:
        for one in clients:
            await one.disconnect()
