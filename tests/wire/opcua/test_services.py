"""Every service does what it says, or says that it does not: asyncua's client, below its convenience."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import pytest
import pytest_asyncio
from asyncua import Client, ua

from bridge.config import OpcUaTable, UserTable
from bridge.image import Quality
from bridge.northbound.opcua.security import hash_password
from bridge.northbound.opcua.server import OpcUaServer
from bridge.northbound.opcua.services import SERVICES, Service
from tests.support.opcua_raw import ask, cut, item, monitored, published, sessions, subscribed, told, values
from tests.support.opcua_site import LocalView, connected, namespace, serving

pytestmark = pytest.mark.asyncio(loop_scope="module")
Codes, Ids, Attribute, Errors = ua.StatusCodes, ua.ObjectIds, ua.AttributeIds, ua.uaerrors
Mode, Times = ua.MonitoringMode, ua.TimestampsToReturn
LOAD = "bus/can0/load"
NAMESPACES = ua.NodeId(Ids.Server_NamespaceArray)
PASSWORD = "swordfish"
Served = tuple[OpcUaServer, LocalView]


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def served(tmp_path_factory: pytest.TempPathFactory) -> AsyncIterator[Served]:
    line = hash_password(PASSWORD)
    users = [UserTable(name=name, role="operator", password_hash=line) for name in ("anna", "otto")]
    settings = OpcUaTable(listen="127.0.0.1:0", no_security=True, anonymous="operator", user=users)
    async with serving(settings, tmp_path_factory.mktemp("state")) as found:
        yield found


@pytest_asyncio.fixture(loop_scope="module")
async def client(served: Served) -> AsyncIterator[Client]:
    async with connected(served[0]) as found:
        yield found


@pytest.fixture
def server(served: Served) -> OpcUaServer:
    return served[0]


@pytest.fixture
def view(served: Served) -> LocalView:
    return served[1]


@asynccontextmanager
async def logged_in(server: OpcUaServer, user: str) -> AsyncIterator[Client]:
    client = Client(server.endpoint_url, timeout=10)
    client.set_user(user)
    client.set_password(PASSWORD)
    async with client:
        yield client


async def point(client: Client, name: str) -> ua.NodeId:
    return ua.NodeId(name, await namespace(client))


def load(view: LocalView, percent: float) -> None:
    view.plant.set(LOAD, percent, time.monotonic())


async def subscription(client: Client, interval_ms: float = 50, **params: object) -> int:
    return (await subscribed(client, interval_ms, **params)).SubscriptionId


# the table


@pytest.mark.parametrize(
    "service",
    [one for name, services in SERVICES.items() if name != "SecureChannel" for one in services],
    ids=lambda service: service.name,
)
async def test_a_service_is_carried_out_or_refused_as_the_table_says(
    server: OpcUaServer, service: Service
) -> None:
    code = Codes.Good
    async with connected(server) as client:
        try:
            await ask(client, service.name)
        except ua.UaStatusCodeError as error:
            code = error.code
    if service.refused is not None:
        assert code == service.refused
    else:
        # An empty request has nothing to do; the service is there all the same.
        assert code not in (
            Codes.BadServiceUnsupported,
            Codes.BadNotImplemented,
            Codes.BadInternalError,
            Codes.BadUnexpectedError,
            Codes.BadUserAccessDenied,
        )


# subscriptions


class TestSubscriptions:
    async def test_what_is_revised_is_what_is_used(self, client: Client) -> None:
        made = await subscribed(client, 1, RequestedLifetimeCount=1, RequestedMaxKeepAliveCount=2)
        agreed = (made.RevisedPublishingInterval, made.RevisedLifetimeCount, made.RevisedMaxKeepAliveCount)
        assert agreed == (50, 6, 2)
        began = time.monotonic()
        for _ in range(4):
            assert (await published(client)).NotificationMessage.NotificationData == []
        # One after the first cycle, then one after every second: 50 + 3 * 100 ms.
        assert 0.3 <= time.monotonic() - began < 0.9
        changed = (
            await ask(
                client,
                "ModifySubscription",
                SubscriptionId=made.SubscriptionId,
                RequestedPublishingInterval=200,
                RequestedMaxKeepAliveCount=1,
            )
        ).Parameters
        agreed = (
            changed.RevisedPublishingInterval,
            changed.RevisedLifetimeCount,
            changed.RevisedMaxKeepAliveCount,
        )
        assert agreed == (200, 3, 1)
        began = time.monotonic()
        for _ in range(3):
            await published(client)
        assert 0.5 <= time.monotonic() - began < 1.2

    async def test_a_message_holds_no_more_than_is_asked_for(self, client: Client, view: LocalView) -> None:
        number = await subscription(client, MaxNotificationsPerPublish=2)
        nodes = [await point(client, f"bus/can0/{leaf}") for leaf in ("load", "tx_errors", "rx_errors")]
        await monitored(client, number, [item(node) for node in nodes])
        first, second = await published(client), await published(client)
        assert [len(values(one.NotificationMessage)) for one in (first, second)] == [2, 1]
        assert [one.MoreNotifications for one in (first, second)] == [True, False]
        await ask(client, "ModifySubscription", SubscriptionId=number, MaxNotificationsPerPublish=1)
        for one in ("tx_errors", "rx_errors"):
            view.plant.set(f"bus/can0/{one}", 1234, time.monotonic())
        assert len(values((await published(client)).NotificationMessage)) == 1

    async def test_a_message_is_sent_again_until_it_is_acknowledged(
        self, client: Client, view: LocalView
    ) -> None:
        number = await subscription(client)
        load(view, 1.0)
        await monitored(client, number, [item(await point(client, LOAD))])
        first = await published(client)
        load(view, 2.0)
        second = await published(client)
        sequences = [one.NotificationMessage.SequenceNumber for one in (first, second)]
        assert sequences == [1, 2]
        assert second.AvailableSequenceNumbers == [1, 2]
        for _ in range(2):
            again = await ask(client, "Republish", SubscriptionId=number, RetransmitSequenceNumber=1)
            assert values(again.NotificationMessage) == values(first.NotificationMessage)
            assert again.NotificationMessage.PublishTime == first.NotificationMessage.PublishTime
        for unknown in (0, 3, 999_999):
            with pytest.raises(Errors.BadMessageNotAvailable):
                await ask(client, "Republish", SubscriptionId=number, RetransmitSequenceNumber=unknown)
        load(view, 3.0)
        third = await published(client, (number, 1), (number, 1), (number, 77), (number + 100, 1))
        assert [code.value for code in third.Results] == [
            Codes.Good,
            Codes.BadSequenceNumberUnknown,
            Codes.BadSequenceNumberUnknown,
            Codes.BadSubscriptionIdInvalid,
        ]
        assert third.AvailableSequenceNumbers == [2, 3]
        with pytest.raises(Errors.BadMessageNotAvailable):
            await ask(client, "Republish", SubscriptionId=number, RetransmitSequenceNumber=1)
        with pytest.raises(Errors.BadSubscriptionIdInvalid):
            await ask(client, "Republish", SubscriptionId=number + 100, RetransmitSequenceNumber=2)

    async def test_who_waits_for_nothing_is_told(self, client: Client) -> None:
        with pytest.raises(Errors.BadNoSubscription):
            await published(client)
        numbers = [await subscription(client, 5000) for _ in range(2)]
        waiting = asyncio.create_task(published(client))
        await asyncio.sleep(0.05)
        codes = (await ask(client, "DeleteSubscriptions", SubscriptionIds=[*numbers, 4711])).Results
        assert [code.value for code in codes] == [0, 0, Codes.BadSubscriptionIdInvalid]
        with pytest.raises(Errors.BadNoSubscription):
            await waiting

    async def test_the_mode_is_set_where_it_can_be(self, client: Client, view: LocalView) -> None:
        number = await subscription(client, PublishingEnabled=False, RequestedMaxKeepAliveCount=1)
        await monitored(client, number, [item(await point(client, LOAD))])
        assert (await published(client)).NotificationMessage.NotificationData == []
        codes = await ask(client, "SetPublishingMode", PublishingEnabled=True, SubscriptionIds=[4711, number])
        assert [code.value for code in codes.Parameters.Results] == [
            Codes.BadSubscriptionIdInvalid,
            Codes.Good,
        ]
        assert await told(client, 1)

    async def test_what_nobody_asks_about_ends_with_its_lifetime(self, client: Client) -> None:
        number = await subscription(client, RequestedLifetimeCount=3, RequestedMaxKeepAliveCount=1)
        await asyncio.sleep(0.4)
        result = await published(client)
        (last,) = result.NotificationMessage.NotificationData
        assert (result.SubscriptionId, last.Status.value) == (number, Codes.BadTimeout)
        with pytest.raises(Errors.BadSubscriptionIdInvalid):
            await ask(client, "Republish", SubscriptionId=number, RetransmitSequenceNumber=1)


class TestTransfer:
    @pytest.mark.parametrize("initial", [True, False])
    async def test_a_subscription_goes_on_in_another_session(
        self, server: OpcUaServer, view: LocalView, initial: bool
    ) -> None:
        async with logged_in(server, "anna") as before, logged_in(server, "anna") as after:
            number = await subscription(before)
            load(view, 1.0)
            await monitored(before, number, [item(await point(before, LOAD))])
            (first,) = await told(before, 1)
            waiting = [asyncio.create_task(published(before)) for _ in range(2)]
            await asyncio.sleep(0.02)
            transferred = await ask(
                after, "TransferSubscriptions", SubscriptionIds=[number, 4711], SendInitialValues=initial
            )
            results = transferred.Parameters.Results
            assert [one.StatusCode.value for one in results] == [Codes.Good, Codes.BadSubscriptionIdInvalid]
            assert results[0].AvailableSequenceNumbers == [1]
            # The old session is told, and then that there is nothing more to wait for.
            (last,) = (await waiting[0]).NotificationMessage.NotificationData
            assert last.Status.value == Codes.GoodSubscriptionTransferred
            with pytest.raises(Errors.BadNoSubscription):
                await waiting[1]
            again = await ask(after, "Republish", SubscriptionId=number, RetransmitSequenceNumber=1)
            assert values(again.NotificationMessage) == [first]
            if initial:
                assert [one.Value.Value for one in await told(after, 1)] == [1.0]
            load(view, 2.0)
            assert [one.Value.Value for one in await told(after, 1)] == [2.0]
            with pytest.raises(Errors.BadSubscriptionIdInvalid):
                await ask(before, "Republish", SubscriptionId=number, RetransmitSequenceNumber=1)

    async def test_it_is_not_given_to_anybody_else(self, server: OpcUaServer) -> None:
        async def code(client: Client, number: int) -> int:
            answer = await ask(client, "TransferSubscriptions", SubscriptionIds=[number])
            return answer.Parameters.Results[0].StatusCode.value

        async with logged_in(server, "anna") as anna, logged_in(server, "otto") as otto:
            number = await subscription(anna)
            assert await code(anna, number) == Codes.BadNothingToDo
            assert await code(otto, number) == Codes.BadUserAccessDenied
            # Without a name and without a certificate anyone could be the one who made it.
            async with connected(server) as first, connected(server) as second:
                assert await code(first, number) == Codes.BadUserAccessDenied
                assert await code(first, await subscription(second)) == Codes.BadUserAccessDenied
            assert (await published(anna)).SubscriptionId == number

    async def test_it_outlives_a_session_that_leaves_it(self, server: OpcUaServer, view: LocalView) -> None:
        async with logged_in(server, "anna") as before:
            number = await subscription(before)
            await monitored(before, number, [item(await point(before, LOAD))])
            await before.uaclient.close_session(False)
        async with logged_in(server, "anna") as after:
            load(view, 5.0)
            await asyncio.sleep(0.1)
            await ask(after, "TransferSubscriptions", SubscriptionIds=[number])
            assert (await told(after, 1))[-1].Value.Value == 5.0


class TestReconnect:
    async def test_a_session_comes_back_on_another_connection(
        self, server: OpcUaServer, view: LocalView
    ) -> None:
        """What was on its way when the connection was lost can be had again, and what came since comes."""
        before, after = Client(server.endpoint_url, timeout=10), Client(server.endpoint_url, timeout=10)
        await before.connect()
        number = await subscription(before, RequestedMaxKeepAliveCount=1)
        load(view, 1.0)
        await monitored(before, number, [item(await point(before, LOAD))])
        await told(before, 1)
        lost = [asyncio.create_task(published(before)) for _ in range(3)]
        await asyncio.sleep(0.1)
        (session,) = sessions(server)
        token = before.uaclient.protocol.authentication_token
        await after.connect_socket()
        await after.send_hello()
        await after.open_secure_channel()
        after.uaclient.session.restore_authentication_token(token)
        params = ua.ActivateSessionParameters()
        params.UserIdentityToken = ua.AnonymousIdentityToken(PolicyId="anonymous")
        await after.uaclient.activate_session(params)
        assert sessions(server) == [session]
        load(view, 2.0)
        assert [one.Value.Value for one in await told(after, 1)] == [2.0]
        # The old connection has lost the session, and takes nothing with it when it goes.
        with pytest.raises((ua.UaError, ConnectionError)):
            await ask(before, "Republish", SubscriptionId=number, RetransmitSequenceNumber=1)
        before.disconnect_socket()
        await asyncio.gather(*lost, return_exceptions=True)
        await asyncio.sleep(0.1)
        load(view, 3.0)
        assert [one.Value.Value for one in await told(after, 1)] == [3.0]
        again = await ask(after, "Republish", SubscriptionId=number, RetransmitSequenceNumber=1)
        assert [one.Value.Value for one in values(again.NotificationMessage)] == [1.0]
        await after.disconnect()

    async def test_asyncuas_own_client_repairs_itself(self, server: OpcUaServer, view: LocalView) -> None:
        came: asyncio.Queue[object] = asyncio.Queue()

        class Handler:
            def datachange_notification(self, node: object, value: object, data: object) -> None:
                came.put_nowait(value)

        async def until(value: float) -> None:
            async with asyncio.timeout(10):
                while await came.get() != value:
                    pass

        client = Client(server.endpoint_url, timeout=5)
        client.set_user("anna")
        client.set_password(PASSWORD)
        await client.connect(auto_reconnect=True)
        try:
            made = await client.create_subscription(50, Handler())
            load(view, 10.0)
            await made.subscribe_data_change(client.get_node(await point(client, LOAD)))
            await until(10.0)
            for number in (11.0, 12.0):
                cut(server)
                load(view, number)
                await until(number)
            load(view, 13.0)
            await until(13.0)
        finally:
            await client.disconnect()


# monitored items


class TestItems:
    async def test_the_settings_are_those_that_are_used(self, client: Client) -> None:
        number = await subscription(client, 100)
        node = await point(client, LOAD)
        wanted = [
            item(node, SamplingInterval=asked, QueueSize=size)
            for asked, size in ((-1, 0), (0, 7), (333, 5000))
        ]
        results = await monitored(client, number, wanted)
        agreed = [(one.RevisedSamplingInterval, one.RevisedQueueSize) for one in results]
        assert agreed == [(100, 1), (50, 7), (333, 100)]
        changed = ua.MonitoredItemModifyRequest(
            results[0].MonitoredItemId,
            ua.MonitoringParameters(ClientHandle=9, SamplingInterval=70, QueueSize=3),
        )
        unknown = ua.MonitoredItemModifyRequest(4711, ua.MonitoringParameters())
        answer = await ask(
            client, "ModifyMonitoredItems", SubscriptionId=number, ItemsToModify=[changed, unknown]
        )
        first, second = answer.Results
        assert (first.RevisedSamplingInterval, first.RevisedQueueSize) == (70, 3)
        assert second.StatusCode.value == Codes.BadMonitoredItemIdInvalid

    @pytest.mark.parametrize(
        ("oldest", "kept"), [(True, [(30.0, True), (40.0, False)]), (False, [(0.0, False), (40.0, True)])]
    )
    async def test_a_full_queue_says_what_is_lost(
        self, client: Client, view: LocalView, oldest: bool, kept: list[tuple[float, bool]]
    ) -> None:
        number = await subscription(client, 700)
        load(view, 0.0)
        node = await point(client, LOAD)
        await monitored(client, number, [item(node, QueueSize=2, DiscardOldest=oldest)])
        for percent in (10.0, 20.0, 30.0, 40.0):
            await asyncio.sleep(0.12)
            load(view, percent)
        found = await told(client, 2)
        assert [(one.Value.Value, bool(one.StatusCode.value & 0x480)) for one in found] == kept

    async def test_no_more_is_sampled_than_was_asked_for(self, client: Client, view: LocalView) -> None:
        number = await subscription(client)
        load(view, 0.0)
        await monitored(client, number, [item(await point(client, LOAD), SamplingInterval=400, QueueSize=50)])
        began = time.monotonic()
        for percent in range(1, 17):
            load(view, float(percent))
            await asyncio.sleep(0.06)
        took = time.monotonic() - began
        found = [one.Value.Value for one in await told(client, 2)]
        while found[-1] != 16.0:
            found += [one.Value.Value for one in await told(client, 1)]
        assert len(found) <= took / 0.375 + 2

    async def test_part_of_a_value_is_monitored(self, client: Client) -> None:
        number = await subscription(client)
        wanted = [
            item(NAMESPACES, index_range="1"),
            item(NAMESPACES, index_range="7:5"),
            item(await point(client, LOAD), index_range="0"),
            item(NAMESPACES, index_range="100"),
        ]
        codes = [one.StatusCode.value for one in await monitored(client, number, wanted)]
        # What is beyond the end now can be there later (Part 4 §5.13.2.1).
        assert codes == [Codes.Good, Codes.BadIndexRangeInvalid, Codes.BadIndexRangeNoData, Codes.Good]
        part, none = await told(client, 2)
        assert part.Value.Value == [(await client.get_namespace_array())[1]]
        assert none.StatusCode.value == Codes.BadIndexRangeNoData

    async def test_every_attribute_can_be_monitored(self, client: Client) -> None:
        number = await subscription(client)
        node = await point(client, LOAD)
        wanted = [
            item(node, attribute=one)
            for one in (Attribute.BrowseName, Attribute.DataType, Attribute.Executable)
        ]
        results = await monitored(client, number, [*wanted, item(ua.NodeId("nowhere", 2))])
        codes = [one.StatusCode.value for one in results]
        assert codes == [0, 0, Codes.BadAttributeIdInvalid, Codes.BadNodeIdUnknown]
        name, _ = await told(client, 2)
        assert (name.Value.Value.Name, name.SourceTimestamp) == ("Load", None)

    async def test_the_times_are_those_that_are_asked_for(self, client: Client, view: LocalView) -> None:
        number = await subscription(client)
        load(view, 1.0)
        wanted = [item(await point(client, LOAD))]
        for times, has in (
            (Times.Source, (True, False)),
            (Times.Server, (False, True)),
            (Times.Neither, (False, False)),
        ):
            await monitored(client, number, wanted, TimestampsToReturn=times)
            (seen,) = await told(client, 1)
            assert (seen.SourceTimestamp is not None, seen.ServerTimestamp is not None) == has
        with pytest.raises(Errors.BadTimestampsToReturnInvalid):
            await monitored(client, number, wanted, TimestampsToReturn=Times.Invalid)

    async def test_an_item_that_samples_is_told_once_it_reports(
        self, client: Client, view: LocalView
    ) -> None:
        number = await subscription(client, RequestedMaxKeepAliveCount=1)
        load(view, 1.0)
        (made,) = await monitored(client, number, [item(await point(client, LOAD), mode=Mode.Sampling)])
        assert (await published(client)).NotificationMessage.NotificationData == []
        modes = {"SubscriptionId": number, "MonitoringMode": Mode.Reporting}
        ids = [made.MonitoredItemId, 4711]
        codes = (await ask(client, "SetMonitoringMode", MonitoredItemIds=ids, **modes)).Parameters.Results
        assert [code.value for code in codes] == [Codes.Good, Codes.BadMonitoredItemIdInvalid]
        assert [one.Value.Value for one in await told(client, 1)] == [1.0]

    async def test_a_percent_deadband_is_a_part_of_the_range(self, client: Client, view: LocalView) -> None:
        """The load reaches from 0 to 100 %."""
        number = await subscription(client)
        load(view, 10.0)
        filter_ = ua.DataChangeFilter(ua.DataChangeTrigger.StatusValue, ua.DeadbandType.Percent, 5.0)
        await monitored(client, number, [item(await point(client, LOAD), Filter=filter_)])
        for percent in (14.9, 15.1, 20.0, 9.0):
            load(view, percent)
            await asyncio.sleep(0.12)
        assert [one.Value.Value for one in await told(client, 3)] == [10.0, 15.1, 9.0]

    @pytest.mark.parametrize(
        ("name", "attribute", "filter_", "code"),
        [
            (LOAD, Attribute.Value, ua.EventFilter(), Codes.BadFilterNotAllowed),
            (LOAD, Attribute.Value, ua.AggregateFilter(), Codes.BadMonitoredItemFilterUnsupported),
            (LOAD, Attribute.DisplayName, ua.DataChangeFilter(), Codes.BadFilterNotAllowed),
            (LOAD, Attribute.Value, ua.DataChangeFilter(DeadbandType=9), Codes.BadDeadbandFilterInvalid),
            (
                "conveyor/fu1/identity/device_name",
                Attribute.Value,
                ua.DataChangeFilter(DeadbandType=1, DeadbandValue=1),
                Codes.BadFilterNotAllowed,
            ),
            (
                "conveyor/fu1/status/state",
                Attribute.Value,
                ua.DataChangeFilter(DeadbandType=2, DeadbandValue=1),
                Codes.BadDeadbandFilterInvalid,
            ),
            ("conveyor/fu1", Attribute.EventNotifier, None, Codes.BadMonitoredItemFilterInvalid),
            ("conveyor/fu1", Attribute.EventNotifier, ua.DataChangeFilter(), Codes.BadFilterNotAllowed),
            ("conveyor/fu1", Attribute.EventNotifier, ua.EventFilter(), Codes.BadEventFilterInvalid),
            ("conveyor/fu1/command", Attribute.EventNotifier, ua.EventFilter(), Codes.BadNotSupported),
            (LOAD, Attribute.EventNotifier, ua.EventFilter(), Codes.BadAttributeIdInvalid),
        ],
    )
    async def test_a_filter_that_would_be_ignored_is_refused(
        self, client: Client, name: str, attribute: int, filter_: object, code: int
    ) -> None:
        number = await subscription(client)
        asked = {"Filter": filter_} if filter_ else {}
        (result,) = await monitored(client, number, [item(await point(client, name), attribute, **asked)])
        assert result.StatusCode.value == code

    async def test_an_event_filter_is_told_what_is_wrong_with_it(self, client: Client) -> None:
        number = await subscription(client)
        base = ua.NodeId(Ids.BaseEventType)
        good = ua.SimpleAttributeOperand(base, [ua.QualifiedName("Message", 0)], Attribute.Value)
        wrong = ua.SimpleAttributeOperand(base, [ua.QualifiedName("data_types", 0)], Attribute.Value)
        like = ua.ContentFilterElement(ua.FilterOperator.Like, [good, ua.LiteralOperand(ua.Variant("%"))])
        filters = [
            ua.EventFilter([good, wrong], ua.ContentFilter()),
            ua.EventFilter([good], ua.ContentFilter([like])),
        ]
        wanted = [item(ua.NodeId(Ids.Server), Attribute.EventNotifier, Filter=one) for one in filters]
        first, second = await monitored(client, number, wanted)
        codes = [code.value for code in first.FilterResult.SelectClauseResults]
        assert (first.StatusCode.value, codes) == (Codes.Good, [Codes.Good, Codes.BadNodeIdUnknown])
        assert second.StatusCode.value == Codes.BadEventFilterInvalid
        (told_,) = second.FilterResult.WhereClauseResult.ElementResults
        assert told_.StatusCode.value == Codes.BadFilterOperatorUnsupported


# attributes


class TestRead:
    async def test_part_of_a_value_is_read(self, client: Client) -> None:
        async def read(node: ua.NodeId, index_range: str) -> ua.DataValue:
            wanted = ua.ReadValueId(NodeId=node, AttributeId=Attribute.Value, IndexRange=index_range)
            (found,) = (await ask(client, "Read", NodesToRead=[wanted])).Results
            return found

        array = await client.get_namespace_array()
        assert (await read(NAMESPACES, "1:2")).Value.Value == array[1:3]
        assert (await read(NAMESPACES, "1:99")).Value.Value == array[1:]
        assert (await read(NAMESPACES, "0,5:8")).Value.Value == [array[0][5:9]]
        assert (await read(NAMESPACES, "99")).StatusCode.value == Codes.BadIndexRangeNoData
        assert (await read(NAMESPACES, "all")).StatusCode.value == Codes.BadIndexRangeInvalid
        assert (await read(await point(client, LOAD), "0")).StatusCode.value == Codes.BadIndexRangeNoData

    async def test_the_times_are_those_that_are_asked_for(self, client: Client, view: LocalView) -> None:
        load(view, 1.0)
        wanted = [ua.ReadValueId(NodeId=await point(client, LOAD), AttributeId=Attribute.Value)]
        for times, has in (
            (Times.Source, (True, False)),
            (Times.Both, (True, True)),
            (Times.Neither, (False, False)),
        ):
            (seen,) = (await ask(client, "Read", NodesToRead=wanted, TimestampsToReturn=times)).Results
            assert (seen.SourceTimestamp is not None, seen.ServerTimestamp is not None) == has
        with pytest.raises(Errors.BadTimestampsToReturnInvalid):
            await ask(client, "Read", NodesToRead=wanted, TimestampsToReturn=Times.Invalid)

    @pytest.mark.parametrize("age", [-1.0, float("nan")])
    async def test_an_age_that_is_none_is_refused(self, client: Client, age: float) -> None:
        wanted = [ua.ReadValueId(NodeId=NAMESPACES, AttributeId=Attribute.Value)]
        with pytest.raises(Errors.BadMaxAgeInvalid):
            await ask(client, "Read", NodesToRead=wanted, MaxAge=age)


# views


class TestBrowse:
    async def browse(self, client: Client, most: int = 0, **asked: object) -> ua.BrowseResult:
        wanted = {
            "NodeId": await point(client, "conveyor/fu1"),
            "BrowseDirection": ua.BrowseDirection.Forward,
            "ResultMask": 63,
        }
        description = ua.BrowseDescription(**(wanted | asked))
        params = {"RequestedMaxReferencesPerNode": most, "NodesToBrowse": [description]}
        (result,) = (await ask(client, "Browse", **params)).Results
        return result

    async def go_on(self, client: Client, point_: bytes, release: bool = False) -> list[ua.BrowseResult]:
        params = {"ContinuationPoints": [point_], "ReleaseContinuationPoints": release}
        return (await ask(client, "BrowseNext", **params)).Parameters.Results

    @pytest.mark.parametrize("most", [1, 3, 1000])
    async def test_what_is_left_follows(self, client: Client, most: int) -> None:
        whole = (await self.browse(client)).References
        result = await self.browse(client, most)
        assert bool(result.ContinuationPoint) == (most < len(whole))
        found = list(result.References)
        while result.ContinuationPoint:
            assert len(result.References) == most
            (result,) = await self.go_on(client, result.ContinuationPoint)
            found += result.References
        assert found == whole
        assert len(whole) > 10

    async def test_a_continuation_point_is_good_once_and_for_its_session(
        self, client: Client, server: OpcUaServer
    ) -> None:
        first = (await self.browse(client, 1)).ContinuationPoint
        async with connected(server) as other:
            (result,) = await self.go_on(other, first)
            assert result.StatusCode.value == Codes.BadContinuationPointInvalid
        await self.go_on(client, first)
        for wrong in (first, b"", b"mine"):
            (result,) = await self.go_on(client, wrong)
            assert result.StatusCode.value == Codes.BadContinuationPointInvalid
        second = (await self.browse(client, 1)).ContinuationPoint
        assert await self.go_on(client, second, release=True) == []
        (result,) = await self.go_on(client, second)
        assert result.StatusCode.value == Codes.BadContinuationPointInvalid

    async def test_continuation_points_are_not_without_end(self, client: Client) -> None:
        codes = [(await self.browse(client, 1)).StatusCode.value for _ in range(25)]
        assert codes == [Codes.Good] * 20 + [Codes.BadNoContinuationPoints] * 5
        told_ = client.get_node(Ids.Server_ServerCapabilities_MaxBrowseContinuationPoints)
        assert await told_.read_value() == 20

    async def test_fields_that_are_not_asked_for_are_empty(self, client: Client) -> None:
        result = await self.browse(client, ResultMask=ua.BrowseResultMask.BrowseName)
        for found in result.References:
            assert found.BrowseName.Name
            assert (found.NodeClass, found.IsForward, found.DisplayName.Text) == (0, False, None)
        assert (await self.browse(client)).References[0].DisplayName.Text, "the server's own are as they were"

    @pytest.mark.parametrize(
        ("asked", "code"),
        [
            ({"NodeId": ua.NodeId("nowhere", 2)}, Codes.BadNodeIdUnknown),
            ({"BrowseDirection": ua.BrowseDirection.Invalid}, Codes.BadBrowseDirectionInvalid),
            ({"ReferenceTypeId": ua.NodeId(Ids.FolderType)}, Codes.BadReferenceTypeIdInvalid),
            ({"ReferenceTypeId": ua.NodeId(4_000_000)}, Codes.BadReferenceTypeIdInvalid),
        ],
    )
    async def test_what_cannot_be_browsed_is_refused(
        self, client: Client, asked: dict[str, object], code: int
    ) -> None:
        assert (await self.browse(client, **asked)).StatusCode.value == code

    async def test_a_response_is_not_without_end(self, client: Client) -> None:
        wide = ua.BrowseDescription(ua.NodeId(Ids.BaseObjectType), ua.BrowseDirection.Both)
        with pytest.raises(Errors.BadResponseTooLarge):
            await ask(client, "Browse", NodesToBrowse=[wide] * 10_000)

    async def test_there_are_no_views(self, client: Client) -> None:
        somewhere = [ua.BrowseDescription(NodeId=ua.NodeId(Ids.ObjectsFolder))]
        with pytest.raises(Errors.BadViewIdUnknown):
            view = ua.ViewDescription(ViewId=ua.NodeId(Ids.ViewsFolder))
            await ask(client, "Browse", View=view, NodesToBrowse=somewhere)

    async def test_a_path_has_each_target_once(self, client: Client) -> None:
        space = await namespace(client)

        def path(*names: str, reference: int = Ids.HierarchicalReferences) -> ua.BrowsePath:
            elements = [
                ua.RelativePathElement(ua.NodeId(reference), False, True, ua.QualifiedName(name, space))
                for name in names
            ]
            return ua.BrowsePath(ua.NodeId(Ids.ObjectsFolder), ua.RelativePath(elements))

        wanted = [
            path("Drives", "conveyor", "fu1"),
            path("Drives", "nobody"),
            path(),
            path("Drives", ""),
            path("Drives", reference=Ids.FolderType),
        ]
        results = (await ask(client, "TranslateBrowsePathsToNodeIds", BrowsePaths=wanted)).Results
        assert [one.StatusCode.value for one in results] == [
            Codes.Good,
            Codes.BadNoMatch,
            Codes.BadNothingToDo,
            Codes.BadBrowseNameInvalid,
            Codes.BadNoMatch,
        ]
        (target,) = results[0].Targets
        assert (target.TargetId, target.RemainingPathIndex) == (ua.NodeId("conveyor/fu1", space), 0xFFFF_FFFF)


async def test_only_endpoints_of_the_profiles_are_named(client: Client) -> None:
    binary = "http://opcfoundation.org/UA-Profile/Transport/uatcp-uasc-uabinary"
    for profiles, there in (([], True), ([binary], True), (["http://example.org/https"], False)):
        answer = await ask(client, "GetEndpoints", ProfileUris=profiles)
        assert bool(answer.Endpoints) == there


async def test_a_node_is_registered_as_itself(client: Client) -> None:
    nodes = [await point(client, LOAD)]
    assert (await ask(client, "RegisterNodes", NodesToRegister=nodes)).Parameters.RegisteredNodeIds == nodes
    await ask(client, "UnregisterNodes", NodesToUnregister=nodes)


async def test_a_value_that_is_lost_is_told_whatever_its_part(client: Client, view: LocalView) -> None:
    number = await subscription(client)
    load(view, 1.0)
    await monitored(client, number, [item(await point(client, LOAD))])
    view.plant.set(LOAD, 1.0, time.monotonic(), Quality.DEAD)
    assert (await told(client, 2))[-1].StatusCode.value == Codes.BadNoCommunication
