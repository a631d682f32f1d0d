"""What the conformance units of the profiles ask for, each as its text has it (OPC 10000-7 §5)."""

from __future__ import annotations

import asyncio
from functools import partial

import pytest
from asyncua import Client, ua
from asyncua.ua.ua_binary import struct_from_binary

from bridge.northbound.opcua.server import OpcUaServer
from bridge.uaserver.conformance import claimed
from tests.support.opcua_raw import (
    answered,
    ask,
    asking,
    item,
    monitored,
    published,
    subscribed,
    told,
    values,
)
from tests.support.opcua_services import LOAD, NAMESPACES, client, load, point, served, server, view
from tests.support.opcua_site import LocalView, break_off, connected, namespace

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


async def test_ten_publish_requests_may_wait_and_ten_messages_for_a_republish(
    client: Client, view: LocalView
) -> None:
    found = (await subscribed(client)).SubscriptionId
    await monitored(client, found, [item(await point(client, LOAD))])
    sent: list[list[ua.DataValue]] = []
    for percent in range(10):
        load(view, float(percent))
        message = (await published(client)).NotificationMessage
        assert message.SequenceNumber == percent + 1
        sent.append(values(message))
    for number, before in enumerate(sent, 1):
        again = await ask(client, "Republish", SubscriptionId=found, RetransmitSequenceNumber=number)
        assert values(again.NotificationMessage) == before
    waiting = [asyncio.create_task(published(client)) for _ in range(10)]
    await asyncio.sleep(0.2)
    assert not any(one.done() for one in waiting)
    await ask(client, "DeleteSubscriptions", SubscriptionIds=[found])
    codes = await asyncio.gather(*waiting, return_exceptions=True)
    assert {getattr(one, "code", None) for one in codes} == {Codes.BadNoSubscription}


async def test_of_too_many_publish_requests_the_oldest_is_answered(client: Client) -> None:
    found = (await subscribed(client, 5000)).SubscriptionId
    await published(client)  # that it is there
    waiting: list[asyncio.Task[ua.PublishResult]] = []
    while not (done := [one for one in waiting if one.done()]):
        assert len(waiting) < 100
        waiting.append(asyncio.create_task(published(client)))
        await asyncio.sleep(0.02)
    assert done == waiting[:1]
    with pytest.raises(ua.uaerrors.BadTooManyPublishRequests):
        await done[0]
    await ask(client, "DeleteSubscriptions", SubscriptionIds=[found])
    await asyncio.gather(*waiting, return_exceptions=True)


async def test_a_session_is_made_activated_used_and_closed(server: OpcUaServer) -> None:
    one = Client(server.endpoint_url, timeout=5)
    await one.connect_socket()
    try:
        await one.send_hello()
        await one.open_secure_channel()
        params = ua.CreateSessionParameters(RequestedSessionTimeout=60_000, SessionName="line 1")
        params.EndpointUrl, params.ClientNonce = server.endpoint_url, bytes(32)
        made = await one.uaclient.create_session(params)
        assert made.RevisedSessionTimeout == 60_000
        assert len(made.ServerNonce) >= 32
        assert made.SessionId not in (ua.NodeId(), made.AuthenticationToken)
        offered = (await ask(one, "GetEndpoints", EndpointUrl=server.endpoint_url)).Endpoints
        assert [end.EndpointUrl for end in made.ServerEndpoints] == [end.EndpointUrl for end in offered]
        activating = ua.ActivateSessionParameters()
        activating.UserIdentityToken = ua.AnonymousIdentityToken(PolicyId="anonymous")
        nonces = {made.ServerNonce}
        for _ in range(2):
            nonces.add((await one.uaclient.activate_session(activating)).ServerNonce)
            assert await one.nodes.server_state.read_value() == 0
        assert len(nonces) == 3, "each is used once"
        await ask(one, "CloseSession")
        with pytest.raises(ua.uaerrors.BadSessionIdInvalid):
            await one.nodes.server_state.read_value()
    finally:
        break_off(one)


async def test_attributes_of_several_nodes_are_read_together_and_arrays_in_part(
    client: Client, view: LocalView
) -> None:
    load(view, 7.0)
    node = await point(client, LOAD)
    wanted = [
        ua.ReadValueId(node, ua.AttributeIds.Value),
        ua.ReadValueId(node, ua.AttributeIds.NodeClass),
        ua.ReadValueId(ua.NodeId(Ids.Server), ua.AttributeIds.BrowseName),
        ua.ReadValueId(NAMESPACES, ua.AttributeIds.Value, "0"),
        ua.ReadValueId(NAMESPACES, ua.AttributeIds.Value, "0:1"),
        ua.ReadValueId(ua.NodeId(Ids.Server), ua.AttributeIds.Value),
    ]
    found = (await ask(client, "Read", NodesToRead=wanted)).Results
    whole = await client.get_namespace_array()
    assert [one.Value.Value for one in found[:5]] == [
        7.0,
        ua.NodeClass.Variable,
        ua.QualifiedName("Server", 0),
        whole[:1],
        whole[:2],
    ]
    assert found[5].StatusCode.value == Codes.BadAttributeIdInvalid


TREE = {
    Ids.RootFolder: "Objects Types Views",
    Ids.ObjectsFolder: "Server",
    Ids.TypesFolder: "ObjectTypes VariableTypes DataTypes ReferenceTypes",
    Ids.Server: "ServerArray NamespaceArray ServerStatus ServiceLevel Auditing ServerCapabilities "
    "ServerDiagnostics VendorServerInfo ServerRedundancy",
    Ids.Server_ServerCapabilities: "ServerProfileArray LocaleIdArray MinSupportedSampleRate "
    "MaxBrowseContinuationPoints MaxQueryContinuationPoints MaxHistoryContinuationPoints "
    "SoftwareCertificates ModellingRules AggregateFunctions",
    Ids.Server_ServerStatus: "StartTime CurrentTime State BuildInfo SecondsTillShutdown ShutdownReason",
}
"""Mandatory nodes below the folders of the standard and its Server object (OPC 10000-5 §6.3 and §8)."""


@pytest.mark.parametrize("where", TREE)
async def test_the_address_space_has_the_structure_of_the_standard(client: Client, where: int) -> None:
    names = {
        (await one.read_browse_name()).Name for one in await client.get_node(f"i={where}").get_children()
    }
    assert set(TREE[where].split()) - names == set()


async def test_items_are_made_changed_switched_and_deleted(client: Client, view: LocalView) -> None:
    load(view, 1.0)
    found = (await subscribed(client, RequestedMaxKeepAliveCount=1)).SubscriptionId
    node, mine = await point(client, LOAD), {"SubscriptionId": found}
    (made,) = await monitored(client, found, [item(node, mode=ua.MonitoringMode.Disabled)])
    ids = [made.MonitoredItemId]

    async def said() -> list[tuple[int, float]]:
        message = (await published(client)).NotificationMessage
        return [
            (one.ClientHandle, one.Value.Value.Value)
            for data in message.NotificationData
            for one in data.MonitoredItems
        ]

    assert await said() == []
    settings = ua.MonitoringParameters(ClientHandle=9, SamplingInterval=50, QueueSize=1)
    change = ua.MonitoredItemModifyRequest(ids[0], settings)
    (changed,) = (await ask(client, "ModifyMonitoredItems", ItemsToModify=[change], **mine)).Results
    assert (changed.StatusCode.value, changed.RevisedQueueSize) == (Codes.Good, 1)
    reporting = {"MonitoringMode": ua.MonitoringMode.Reporting, "MonitoredItemIds": ids}
    codes = (await ask(client, "SetMonitoringMode", **mine, **reporting)).Parameters.Results
    assert [one.value for one in codes] == [Codes.Good]
    assert await said() == [(9, 1.0)]
    for code in (Codes.Good, Codes.BadMonitoredItemIdInvalid):
        codes = (await ask(client, "DeleteMonitoredItems", MonitoredItemIds=ids, **mine)).Results
        assert [one.value for one in codes] == [code]
    load(view, 2.0)
    assert await said() == []


@pytest.mark.parametrize("size", [1, 5])
async def test_a_queue_keeps_as_many_as_it_is_long(client: Client, view: LocalView, size: int) -> None:
    load(view, 0.0)
    found = (await subscribed(client, 1500)).SubscriptionId
    (made,) = await monitored(client, found, [item(await point(client, LOAD), QueueSize=size)])
    assert made.RevisedQueueSize == size
    for percent in range(1, 8):
        await asyncio.sleep(0.12)
        load(view, float(percent))
    kept = values((await published(client)).NotificationMessage)
    if kept[0].Value.Value == 0.0:  # with the first cycle, before anything has changed
        kept = values((await published(client)).NotificationMessage)
    assert [one.Value.Value for one in kept] == [float(one) for one in range(8 - size, 8)]


async def test_a_change_is_told_and_of_an_array_the_part_that_is_watched(
    client: Client, view: LocalView
) -> None:
    load(view, 1.0)
    found = (await subscribed(client)).SubscriptionId
    wanted = [
        item(await point(client, LOAD)),
        item(NAMESPACES, index_range="1"),
        item(NAMESPACES, index_range="0:1"),
    ]
    await monitored(client, found, wanted)
    whole = await client.get_namespace_array()
    first = values((await published(client)).NotificationMessage)
    assert [one.Value.Value for one in first] == [1.0, whole[1:2], whole[:2]]
    load(view, 2.0)
    assert [one.Value.Value for one in values((await published(client)).NotificationMessage)] == [2.0]


async def test_an_absolute_deadband_is_in_the_unit_of_the_value(client: Client, view: LocalView) -> None:
    load(view, 10.0)
    found = (await subscribed(client)).SubscriptionId
    filter_ = ua.DataChangeFilter(ua.DataChangeTrigger.StatusValue, ua.DeadbandType.Absolute, 2.0)
    await monitored(client, found, [item(await point(client, LOAD), Filter=filter_)])
    for percent in (11.9, 12.1, 13.0, 10.0):
        load(view, percent)
        await asyncio.sleep(0.12)
    assert [one.Value.Value for one in await told(client, 3)] == [10.0, 12.1, 10.0]


async def test_a_subscription_is_made_changed_switched_told_again_and_deleted(
    client: Client, view: LocalView
) -> None:
    load(view, 1.0)
    found = (await subscribed(client, PublishingEnabled=False, RequestedMaxKeepAliveCount=1)).SubscriptionId
    await monitored(client, found, [item(await point(client, LOAD))])
    assert (await published(client)).NotificationMessage.NotificationData == []
    asked = {"RequestedPublishingInterval": 100, "RequestedMaxKeepAliveCount": 50}
    changed = (await ask(client, "ModifySubscription", SubscriptionId=found, **asked)).Parameters
    assert (changed.RevisedPublishingInterval, changed.RevisedMaxKeepAliveCount) == (100, 50)
    switched = await ask(client, "SetPublishingMode", PublishingEnabled=True, SubscriptionIds=[found])
    assert [one.value for one in switched.Parameters.Results] == [Codes.Good]
    first = await published(client)
    assert (first.SubscriptionId, [one.Value.Value for one in values(first.NotificationMessage)]) == (
        found,
        [1.0],
    )
    number = first.NotificationMessage.SequenceNumber
    again = await ask(client, "Republish", SubscriptionId=found, RetransmitSequenceNumber=number)
    assert values(again.NotificationMessage) == values(first.NotificationMessage)
    load(view, 2.0)
    second = await published(client, (found, number))
    assert [one.value for one in second.Results] == [Codes.Good]
    assert second.AvailableSequenceNumbers == [number + 1]
    for code in (Codes.Good, Codes.BadSubscriptionIdInvalid):
        deleted = (await ask(client, "DeleteSubscriptions", SubscriptionIds=[found])).Results
        assert [one.value for one in deleted] == [code]


async def test_there_is_room_for_what_the_standard_profile_asks(client: Client) -> None:
    """Five subscriptions of a session with five hundred items each, with a queue of five."""
    node = await point(client, LOAD)
    for nodes in (node, ua.NodeId(Ids.Server_NamespaceArray)) * 2 + (ua.NodeId(Ids.Server_ServerArray),):
        found = (await subscribed(client, 10_000)).SubscriptionId
        made = await monitored(client, found, [item(nodes, QueueSize=5)] * 500)
        assert all(one.StatusCode.is_good() and one.RevisedQueueSize == 5 for one in made)


@pytest.mark.landing(8)
async def test_fifty_sessions_are_served_at_a_time(server: OpcUaServer) -> None:
    clients = [Client(server.endpoint_url, timeout=20, watchdog_intervall=20) for _ in range(50)]
    try:
        for one in clients:
            await one.connect()
        states = [await one.nodes.server_state.read_value() for one in clients]
        assert states == [0] * 50
    finally:
        for one in clients:
            await one.disconnect()


@pytest.mark.landing
async def test_half_of_fifty_sessions_have_all_that_is_asked_at_a_time(
    server: OpcUaServer, view: LocalView, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Five continuation points, five subscriptions and ten Publish requests in each of 25 sessions, 500 items
    in every other subscription. From two addresses: each has its own share."""
    loop = asyncio.get_running_loop()
    connect = loop.create_connection
    clients = [Client(server.endpoint_url, timeout=20, watchdog_intervall=20) for _ in range(25)]
    try:
        for number, one in enumerate(clients):
            source = f"127.0.0.{1 + number % 2}"
            monkeypatch.setattr(loop, "create_connection", partial(connect, local_addr=(source, 0)))
            await one.connect()
        space = await namespace(clients[0])
        names = [ua.NodeId(one.name, space) for one in view.image.points]
        made = 0
        waiting: list[asyncio.Task[ua.PublishResult]] = []
        for one in clients:
            browsing = [ua.BrowseDescription(ua.NodeId(Ids.TypesFolder))] * 5
            browsed = await ask(one, "Browse", RequestedMaxReferencesPerNode=1, NodesToBrowse=browsing)
            assert all(result.ContinuationPoint for result in browsed.Results)
            for _ in range(5):
                subscription = (await subscribed(one, 30_000)).SubscriptionId
                made += 1
                if made % 2:
                    wanted = [item(names[number % len(names)]) for number in range(500)]
                    results = await monitored(one, subscription, wanted)
                    assert {result.StatusCode.value for result in results} == {Codes.Good}
                    assert min(result.RevisedQueueSize for result in results) >= 5
            waiting += [asyncio.create_task(published(one)) for _ in range(10)]
        await asyncio.sleep(0.2)
        assert made == 125
        assert not any(one.done() for one in waiting)
    finally:
        for one in clients:
            await one.disconnect()
    await asyncio.gather(*waiting, return_exceptions=True)
