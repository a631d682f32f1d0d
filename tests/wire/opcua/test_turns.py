"""The largest requests that there can be, one after the other: none holds up the others for 50 ms."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Iterator, Sequence

import pytest
import pytest_asyncio
from asyncua import Client, ua

from tests.support.longest_turn import ServerThread
from tests.support.opcua_raw import ask, item, monitored, published, subscribed
from tests.support.opcua_site import connected

pytestmark = [pytest.mark.landing, pytest.mark.asyncio(loop_scope="module")]

Codes, Ids, Mode = ua.StatusCodes, ua.ObjectIds, ua.MonitoringMode
LONGEST_S = 0.05
MOST = 10_000
SERVER = ua.NodeId(Ids.Server)
BOTH = ua.TimestampsToReturn.Both
SERVER_STATE = ua.NodeId(Ids.Server_ServerStatus_State)


@pytest.fixture(scope="module")
def thread(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ServerThread]:
    with ServerThread(tmp_path_factory.mktemp("state")).running() as found:
        yield found


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def client(thread: ServerThread) -> AsyncIterator[Client]:
    async with connected(thread.server) as found:
        yield found


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def variables(client: Client) -> list[ua.NodeId]:
    """Variables of the address space that can be read, as many as go into one request."""
    found: dict[ua.NodeId, None] = {}
    ahead = [client.nodes.objects.nodeid]
    forward, hierarchy = ua.BrowseDirection.Forward, Ids.HierarchicalReferences
    while ahead and len(found) < 300:
        references = await client.get_node(ahead.pop()).get_references(hierarchy, forward)
        ahead += [one.NodeId for one in references]
        found |= dict.fromkeys(one.NodeId for one in references if one.NodeClass == ua.NodeClass.Variable)
    read = await client.read_attributes([client.get_node(one) for one in found])
    good = [where for where, value in zip(found, read, strict=True) if value.StatusCode.is_good()]
    return [good[place % len(good)] for place in range(MOST)]


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def watched(client: Client, variables: Sequence[ua.NodeId]) -> dict[int, list[int]]:
    """Four subscriptions with ten thousand items each."""
    found: dict[int, list[int]] = {}
    for _ in range(4):
        number = (await subscribed(client, 1000)).SubscriptionId
        made = await monitored(client, number, [item(where) for where in variables])
        assert {one.StatusCode.value for one in made} == {Codes.Good}
        found[number] = [one.MonitoredItemId for one in made]
    return found


@pytest.fixture(autouse=True)
def longest(thread: ServerThread, watched: object) -> Iterator[None]:
    thread.longest_s = 0.0
    yield
    assert thread.longest_s < LONGEST_S, f"{thread.longest_s * 1000:.1f} ms"


async def code_of(client: Client, service: str, **params: object) -> int:
    """Status code of a request that is refused as a whole."""
    with pytest.raises(ua.UaStatusCodeError) as refused:
        await ask(client, service, **params)
    return refused.value.code


@pytest.mark.parametrize("max_age_ms", [0.0, 1000.0])
async def test_read(client: Client, variables: Sequence[ua.NodeId], max_age_ms: float) -> None:
    wanted = [ua.ReadValueId(where, ua.AttributeIds.Value) for where in variables]
    read = await ask(client, "Read", MaxAge=max_age_ms, TimestampsToReturn=BOTH, NodesToRead=wanted)
    assert len(read.Results) == MOST


async def test_register_nodes(client: Client, variables: Sequence[ua.NodeId]) -> None:
    asked = {"NodesToRegister": list(variables)}
    assert len((await ask(client, "RegisterNodes", **asked)).Parameters.RegisteredNodeIds) == MOST


async def test_browse(client: Client, variables: Sequence[ua.NodeId]) -> None:
    every = (ua.BrowseDirection.Both, ua.NodeId(Ids.References), True, 0, 63)
    wanted = [ua.BrowseDescription(where, *every) for where in variables]
    found = await ask(client, "Browse", RequestedMaxReferencesPerNode=1, NodesToBrowse=wanted)
    assert len(found.Results) == MOST
    points = {"ReleaseContinuationPoints": False, "ContinuationPoints": [bytes(8)] * MOST}
    told = (await ask(client, "BrowseNext", **points)).Parameters
    assert {one.StatusCode.value for one in told.Results} == {Codes.BadContinuationPointInvalid}


async def test_translate(client: Client) -> None:
    element = ua.RelativePathElement(ua.NodeId(Ids.Organizes), False, True, ua.QualifiedName("Server", 0))
    path = ua.BrowsePath(client.nodes.objects.nodeid, ua.RelativePath([element]))
    found = await ask(client, "TranslateBrowsePathsToNodeIds", BrowsePaths=[path] * MOST)
    assert len(found.Results) == MOST
    path = ua.BrowsePath(client.nodes.objects.nodeid, ua.RelativePath([element] * 28_000))
    code = await code_of(client, "TranslateBrowsePathsToNodeIds", BrowsePaths=[path])
    assert code == Codes.BadEncodingLimitsExceeded


async def test_write(client: Client, variables: Sequence[ua.NodeId]) -> None:
    def write(where: ua.NodeId, value: ua.Variant) -> ua.WriteValue:
        return ua.WriteValue(where, ua.AttributeIds.Value, None, ua.DataValue(value))

    wanted = [write(where, ua.Variant(1.0)) for where in variables[:1000]]
    assert len((await ask(client, "Write", NodesToWrite=wanted)).Results) == 1000
    many = ua.Variant([ua.DataValue(ua.Variant(1.0))] * 28_000)
    code = await code_of(client, "Write", NodesToWrite=[write(variables[0], many)])
    assert code == Codes.BadEncodingLimitsExceeded


async def test_call(client: Client, watched: dict[int, list[int]]) -> None:
    first, *_ = watched
    number = ua.Variant(first, ua.VariantType.UInt32)
    names = ua.Variant([ua.QualifiedName("a", 1)] * 28_000)

    async def codes(where: int, method: int, *given: ua.Variant) -> list[int]:
        call = ua.CallMethodRequest(ua.NodeId(where), ua.NodeId(method), list(given))
        return [
            one.StatusCode.value for one in (await ask(client, "Call", MethodsToCall=[call] * 100)).Results
        ]

    call = ua.CallMethodRequest(SERVER, ua.NodeId(Ids.Server_ResendData), [names])
    assert await code_of(client, "Call", MethodsToCall=[call]) == Codes.BadEncodingLimitsExceeded
    told = [Codes.Good] * 10 + [Codes.BadResponseTooLarge] * 90  # 100,000 items, and no more
    assert await codes(Ids.Server, Ids.Server_GetMonitoredItems, number) == told
    assert await codes(Ids.Server, Ids.Server_ResendData, number) == told
    refresh = Ids.ConditionType_ConditionRefresh
    assert set(await codes(Ids.ConditionType, refresh, number)) <= {Codes.Good, Codes.BadRefreshInProgress}


async def test_event_filters(client: Client) -> None:
    name = [ua.QualifiedName("Message", 0)]
    field = ua.SimpleAttributeOperand(TypeDefinitionId=ua.NodeId(Ids.BaseEventType), BrowsePath=name)
    field.AttributeId = ua.AttributeIds.Value

    def listener(fields: int) -> ua.MonitoredItemCreateRequest:
        filter_ = ua.EventFilter(SelectClauses=[field] * fields)
        return item(SERVER, ua.AttributeIds.EventNotifier, Filter=filter_)

    number = (await subscribed(client)).SubscriptionId
    assert len(await monitored(client, number, [listener(25)] * 400)) == 400
    asked = {"ItemsToCreate": [listener(14_000)], "TimestampsToReturn": BOTH}
    code = await code_of(client, "CreateMonitoredItems", SubscriptionId=number, **asked)
    assert code == Codes.BadEncodingLimitsExceeded
    await ask(client, "DeleteSubscriptions", SubscriptionIds=[number])


async def test_monitored_items(client: Client, watched: dict[int, list[int]]) -> None:
    number, items = next(iter(watched.items()))
    settings = ua.MonitoringParameters(ClientHandle=1, SamplingInterval=500.0, QueueSize=10)
    asked = [ua.MonitoredItemModifyRequest(one, settings) for one in items]
    await ask(
        client,
        "ModifyMonitoredItems",
        SubscriptionId=number,
        TimestampsToReturn=BOTH,
        ItemsToModify=asked,
    )
    for mode in (Mode.Sampling, Mode.Disabled, Mode.Reporting):
        ids = {"MonitoringMode": mode, "MonitoredItemIds": items}
        await ask(client, "SetMonitoringMode", SubscriptionId=number, **ids)
    for links in ({"LinksToAdd": items}, {"LinksToRemove": items}):
        await ask(client, "SetTriggering", SubscriptionId=number, TriggeringItemId=items[0], **links)


async def test_publish(client: Client, watched: dict[int, list[int]]) -> None:
    numbers = list(watched)
    for _ in range(len(watched) * MOST // 1000):
        await published(client)
    asked = {"PublishingEnabled": True, "SubscriptionIds": numbers * (MOST // 4)}
    assert len((await ask(client, "SetPublishingMode", **asked)).Parameters.Results) == MOST
    acknowledged = [ua.SubscriptionAcknowledgement(numbers[0], place) for place in range(MOST)]
    code = await code_of(client, "Publish", SubscriptionAcknowledgements=acknowledged)
    assert code == Codes.BadEncodingLimitsExceeded
    counts = {"RequestedLifetimeCount": 10_000, "RequestedMaxKeepAliveCount": 1000}
    for interval_ms in (50.0, 1000.0):
        for number in numbers:
            cycle = {"SubscriptionId": number, "RequestedPublishingInterval": interval_ms}
            await ask(client, "ModifySubscription", **cycle, **counts)
        await asyncio.sleep(0.3)


async def test_ends(client: Client, thread: ServerThread, watched: dict[int, list[int]]) -> None:
    """Last of all. Deleted with items, left to a session that ends, and to nobody."""
    first, second, *others = watched
    async with connected(thread.server) as other:
        asked = {"SubscriptionIds": [*watched] * (MOST // 4), "SendInitialValues": True}
        assert len((await ask(other, "TransferSubscriptions", **asked)).Parameters.Results) == MOST
    await ask(client, "DeleteMonitoredItems", SubscriptionId=first, MonitoredItemIds=watched[first])
    asked = {"SubscriptionIds": [first, second] * (MOST // 2)}
    assert len((await ask(client, "DeleteSubscriptions", **asked)).Results) == MOST
    await client.close_session()
    async with connected(thread.server) as other:
        assert await other.get_node(SERVER_STATE).read_value() == 0
        numbers = {"SubscriptionIds": others}
        gone = (await ask(other, "TransferSubscriptions", **numbers)).Parameters.Results
        assert {one.StatusCode.value for one in gone} == {Codes.BadSubscriptionIdInvalid}
