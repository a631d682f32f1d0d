"""Monitored items as the services have them: asyncua's client, below its convenience."""

from __future__ import annotations

import asyncio
import time

import pytest
from asyncua import Client, ua

from tests.support.opcua_raw import ask, item, monitored, published, told
from tests.support.opcua_services import (
    LOAD,
    NAMESPACES,
    client,
    load,
    point,
    served,
    server,
    subscription,
    view,
)
from tests.support.opcua_site import LocalView

__all__ = ["client", "served", "server", "view"]

pytestmark = pytest.mark.asyncio(loop_scope="module")
Codes, Ids, Attribute, Errors, Mode, Times = (
    ua.StatusCodes,
    ua.ObjectIds,
    ua.AttributeIds,
    ua.uaerrors,
    ua.MonitoringMode,
    ua.TimestampsToReturn,
)


class TestItems:
    @pytest.mark.landing
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

    async def test_part_of_a_value_is_monitored(self, client: Client, view: LocalView) -> None:
        load(view, 1.0)
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

    async def test_an_item_that_samples_is_told_once_another_has_something(
        self, client: Client, view: LocalView
    ) -> None:
        number = await subscription(client, RequestedMaxKeepAliveCount=1)
        load(view, 1.0)
        wanted = [
            item(NAMESPACES, mode=Mode.Sampling, ClientHandle=1),
            item(await point(client, LOAD), ClientHandle=2),
        ]
        linked, trigger = [one.MonitoredItemId for one in await monitored(client, number, wanted)]

        async def set_links(add: list[int], remove: list[int]) -> list[list[int]]:
            asked = {"SubscriptionId": number, "TriggeringItemId": trigger}
            links = {"LinksToAdd": add, "LinksToRemove": remove}
            found = (await ask(client, "SetTriggering", **asked, **links)).Parameters
            return [[code.value for code in codes or []] for codes in (found.AddResults, found.RemoveResults)]

        assert [one.Value.Value for one in await told(client, 1)] == [1.0]
        unknown = Codes.BadMonitoredItemIdInvalid
        # What is to be removed comes first.
        assert await set_links([linked, 4711], [linked]) == [[Codes.Good, unknown], [unknown]]
        assert (await published(client)).NotificationMessage.NotificationData == []
        load(view, 2.0)
        array = await client.get_namespace_array()
        assert [one.Value.Value for one in await told(client, 2)] == [array, 2.0]
        assert await set_links([], [linked]) == [[], [Codes.Good]]
        with pytest.raises(Errors.BadNothingToDo):
            await set_links([], [])
        trigger = 4711
        with pytest.raises(Errors.BadMonitoredItemIdInvalid):
            await set_links([linked], [])

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
