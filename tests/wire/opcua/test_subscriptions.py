"""What clients of the OPC UA server are told by themselves: changes of values, and events."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator
from unittest.mock import patch

import pytest
import pytest_asyncio
from asyncua import Client, Node, ua
from asyncua.common.subscription import Subscription

from bridge.catalogue.points import site_points
from bridge.command import Event, EventKind
from bridge.command.drive_link import NodeState
from bridge.image import Point, Quality
from bridge.image.point import DataType
from bridge.northbound.opcua.server import OpcUaServer
from tests.support.node_states import node_goes
from tests.support.opcua_site import OPEN, LocalView, connected, make_plant, namespace, serving
from tests.support.rig import emergency

pytestmark = pytest.mark.asyncio(loop_scope="module")
Codes = ua.StatusCodes
MANY = 2_000
LOAD = "bus/can0/load"


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def served(tmp_path_factory: pytest.TempPathFactory) -> AsyncIterator[tuple[OpcUaServer, LocalView]]:
    many = [Point(name=f"bus/can0/{n // 50}/{n}", data_type=DataType.UINT32) for n in range(MANY)]
    with patch("bridge.catalogue.site.site_points", lambda *site: site_points(*site) | {"many": many}):
        plant = make_plant()
    async with serving(OPEN, tmp_path_factory.mktemp("state"), plant) as found:
        yield found


@pytest.fixture
def view(served: tuple[OpcUaServer, LocalView]) -> LocalView:
    return served[1]


@pytest_asyncio.fixture(loop_scope="module")
async def client(served: tuple[OpcUaServer, LocalView]) -> AsyncIterator[Client]:
    async with connected(served[0]) as found:
        yield found


class Told:
    """What a subscription brought, in its order."""

    def __init__(self) -> None:
        self.values: list[tuple[str, object, int]] = []
        self.events: list[object] = []
        self._more = asyncio.Event()

    def datachange_notification(self, node: Node, value: object, data: object) -> None:
        read: ua.DataValue = data.monitored_item.Value  # pyright: ignore[reportAttributeAccessIssue]
        self.values.append((str(node.nodeid.Identifier), value, read.StatusCode.value))
        self._more.set()

    def event_notification(self, event: object) -> None:
        self.events.append(event)
        self._more.set()

    def status_change_notification(self, status: object) -> None:
        pass

    async def until(self, count: int, seconds: float = 3) -> None:
        """Wait for so many values and events together."""
        async with asyncio.timeout(seconds):
            while len(self.values) + len(self.events) < count:
                self._more.clear()
                await self._more.wait()


async def subscribe(client: Client, told: Told, interval_ms: float = 50) -> Subscription:
    return await client.create_subscription(interval_ms, told)


async def node(client: Client, name: str) -> Node:
    return client.get_node(ua.NodeId(name, await namespace(client)))


async def filtered(subscription: Subscription, where: Node, deadband: float) -> None:
    wanted = ua.DataChangeFilter(
        Trigger=ua.DataChangeTrigger.StatusValue,
        DeadbandType=ua.DeadbandType.Absolute,
        DeadbandValue=deadband,
    )
    item = ua.MonitoredItemCreateRequest(
        ItemToMonitor=ua.ReadValueId(NodeId=where.nodeid, AttributeId=ua.AttributeIds.Value),
        MonitoringMode=ua.MonitoringMode.Reporting,
        RequestedParameters=ua.MonitoringParameters(ClientHandle=77, QueueSize=10, Filter=wanted),
    )
    await subscription.create_monitored_items([item])


async def test_a_change_is_told_with_its_quality(client: Client, view: LocalView) -> None:
    told, set_ = Told(), view.plant.set
    set_(LOAD, 1.0, time.monotonic())
    subscription = await subscribe(client, told)
    await subscription.subscribe_data_change(await node(client, LOAD))
    await told.until(1)
    for count, (value, quality) in enumerate(
        [(2.0, Quality.GOOD), (2.0, Quality.LOST), (2.0, Quality.DEAD), (2.0, Quality.GOOD)], 2
    ):
        set_(LOAD, value, time.monotonic(), quality)
        await told.until(count)
    assert [(value, code) for _, value, code in told.values] == [
        (1.0, Codes.Good),
        (2.0, Codes.Good),
        (2.0, Codes.UncertainNoCommunicationLastUsableValue),
        (None, Codes.BadNoCommunication),
        (2.0, Codes.Good),
    ]


async def test_a_bit_is_told_when_it_changes_and_only_then(client: Client, view: LocalView) -> None:
    told = Told()
    view.plant.set("conveyor/node/module_state", 0, time.monotonic())
    subscription = await subscribe(client, told)
    await subscription.subscribe_data_change(await node(client, "conveyor/node/module_state/can_warning"))
    for word in (0x0001, 0x0010, 0x0011, 0x0001):
        view.plant.set("conveyor/node/module_state", word, time.monotonic())
        await asyncio.sleep(0.15)
    assert [value for _, value, _ in told.values] == [False, True, False]


async def test_of_many_changes_within_a_tick_the_newest_is_told(client: Client, view: LocalView) -> None:
    told = Told()
    subscription = await subscribe(client, told, 100)
    await subscription.subscribe_data_change(await node(client, LOAD), queuesize=1)
    for percent in range(100):
        view.plant.set(LOAD, float(percent), time.monotonic())
    await asyncio.sleep(0.4)
    assert told.values[-1][1] == 99.0
    assert len(told.values) <= 3


async def test_no_interval_is_shorter_than_the_floor(client: Client) -> None:
    for asked in (0, 1):
        subscription = await subscribe(client, Told(), asked)
        assert subscription.parameters.RequestedPublishingInterval == 50.0, "as revised by the server"


async def test_a_deadband_counts_from_what_was_told(client: Client, view: LocalView) -> None:
    """A slow drift is told in the end, and a status always: asyncua itself loses both."""
    told, set_ = Told(), view.plant.set
    set_(LOAD, 10.0, time.monotonic())
    subscription = await subscribe(client, told)
    await filtered(subscription, await node(client, LOAD), 1.0)
    for value, quality in [
        (10.6, Quality.GOOD),
        (11.2, Quality.GOOD),
        (11.2, Quality.DEAD),
        (11.2, Quality.GOOD),
        (11.3, Quality.GOOD),
    ]:
        await asyncio.sleep(0.12)
        set_(LOAD, value, time.monotonic(), quality)
    await asyncio.sleep(0.2)
    assert [(value, code) for _, value, code in told.values] == [
        (10.0, Codes.Good),
        (11.2, Codes.Good),
        (None, Codes.BadNoCommunication),
        (11.2, Codes.Good),
    ]


@pytest.mark.landing
async def test_two_thousand_items_are_made_at_once(client: Client, view: LocalView) -> None:
    told = Told()
    subscription = await subscribe(client, told, 100)
    nodes = [await node(client, f"bus/can0/{n // 50}/{n}") for n in range(MANY)]
    other = client.get_node(ua.ObjectIds.Server_ServerStatus_State)
    handles, longest = await asyncio.gather(subscription.subscribe_data_change(nodes), _longest(other, 10))
    assert all(isinstance(handle, int) for handle in handles)
    await told.until(MANY, 10)
    for n in range(0, MANY, 7):
        view.plant.set(f"bus/can0/{n // 50}/{n}", n + 1, time.monotonic())
    await told.until(MANY + len(range(0, MANY, 7)), 10)
    assert {name: value for name, value, _ in told.values}["bus/can0/39/1995"] == 1996
    await subscription.delete()
    assert longest < 2


async def _longest(where: Node, times: int) -> float:
    longest = 0.0
    for _ in range(times):
        began = time.monotonic()
        await where.read_value()
        longest = max(longest, time.monotonic() - began)
        await asyncio.sleep(0.01)
    return longest


async def test_a_session_does_not_touch_anothers_subscription(
    client: Client, served: tuple[OpcUaServer, LocalView]
) -> None:
    told = Told()
    subscription = await subscribe(client, told)
    number = subscription.subscription_id
    async with connected(served[0]) as other:
        assert [code.value for code in await other.uaclient.delete_subscriptions([number])] == [
            Codes.BadSubscriptionIdInvalid
        ]
        with pytest.raises(ua.uaerrors.BadSubscriptionIdInvalid):
            await other.uaclient.create_monitored_items(
                ua.CreateMonitoredItemsParameters(
                    SubscriptionId=number,
                    ItemsToCreate=[ua.MonitoredItemCreateRequest()],
                )
            )
    await subscription.subscribe_data_change(await node(client, LOAD))
    await told.until(1)


class TestEvents:
    async def test_a_drives_events_are_heard_at_the_drive_and_at_the_server(
        self, client: Client, view: LocalView
    ) -> None:
        space = await namespace(client)
        kind = client.get_node(ua.NodeId("DriveEventType", space))
        heard: dict[str, Told] = {}
        for where in ("server", "conveyor", "conveyor/fu1", "conveyor/fu2"):
            told = heard[where] = Told()
            source = client.nodes.server if where == "server" else await node(client, where)
            await (await subscribe(client, told)).subscribe_events(source, kind)
        view.plant.drives["conveyor/fu1"].channel.on_emcy(emergency(0x4310), time.monotonic())
        for where in ("server", "conveyor", "conveyor/fu1"):
            await heard[where].until(1)
        (event,) = heard["server"].events
        assert event.SourceNode == ua.NodeId("conveyor/fu1", space)
        assert (event.SourceName, event.Severity) == ("conveyor/fu1", 700)
        assert "4310h" in event.Message.Text
        assert event.EventType == ua.NodeId("EmergencyEventType", space)
        assert heard["conveyor/fu2"].events == []

    async def test_trips_lost_nodes_and_refused_writes_are_events(
        self, client: Client, view: LocalView
    ) -> None:
        space, told = await namespace(client), Told()
        kind = client.get_node(ua.NodeId("DriveEventType", space))
        await (await subscribe(client, told)).subscribe_events(client.nodes.server, kind)
        conveyor = view.plant.nodes["conveyor"]
        node_goes(view.plant, conveyor, NodeState.LOST, time.monotonic())
        node_goes(view.plant, conveyor, NodeState.OPERATIONAL, time.monotonic())
        with pytest.raises(ua.uaerrors.BadUserAccessDenied):
            await (await node(client, "conveyor/fu2/command/control_word")).write_value(
                ua.Variant(0x047E, ua.VariantType.UInt16)
            )
        await asyncio.sleep(0.3)
        kinds = [str(event.EventType.Identifier) for event in told.events]
        for wanted in ("NodeLostEventType", "NodeBackEventType", "WatchdogEventType", "RefusedEventType"):
            assert wanted in kinds

    async def test_a_flood_of_refusals_is_bounded_and_hides_no_trip(
        self, client: Client, view: LocalView
    ) -> None:
        told, space = Told(), await namespace(client)
        kind = client.get_node(ua.NodeId("DriveEventType", space))
        await (await subscribe(client, told)).subscribe_events(client.nodes.server, kind)
        now = time.monotonic()
        for _ in range(1000):
            view.plant.report(Event(now, EventKind.REFUSED, "conveyor/fu1", 300, "refused"))
        view.plant.report(Event(now, EventKind.WATCHDOG, "conveyor/fu1", 900, "tripped"))
        await asyncio.sleep(0.4)
        assert len(told.events) <= 30
        assert "tripped" in [event.Message.Text for event in told.events]
