"""Monitored items of an address space; no server."""

from __future__ import annotations

from typing import Any

import pytest
from asyncua import ua
from asyncua.server.address_space import AddressSpace

from bridge.uaserver.library import ServiceError
from bridge.uaserver.subscriptions import monitoring
from bridge.uaserver.subscriptions.monitoring import MonitoredItems, codes
from bridge.uaserver.subscriptions.subscription import Subscription, terms
from tests.support.opcua_application import add_variable
from tests.support.opcua_sessions import Session

Codes, Ids, Mode = ua.StatusCodes, ua.AttributeIds, ua.MonitoringMode
WORD = ua.NodeId("word", 1)
EVENTS = ua.NodeId(ua.ObjectIds.Server)


class Rig:
    """A subscription on the standard's address space and one variable beside it."""

    def __init__(self, space: AddressSpace) -> None:
        self.space = space
        add_variable(space, WORD, 7)
        self.items = MonitoredItems(space)
        owner = Session()
        self.subscription = Subscription(1, owner, terms(ua.CreateSubscriptionParameters()), enabled=True)

    async def create(self, *wanted: ua.MonitoredItemCreateRequest, room: int = 100) -> list[Any]:
        params = ua.CreateMonitoredItemsParameters(1, ua.TimestampsToReturn.Both, list(wanted))

        async def no_more() -> bool:
            return False

        return await self.items.create(lambda: self.subscription, params, lambda: room, no_more)

    async def change(self, value: int) -> None:
        content = ua.DataValue(ua.Variant(value, ua.VariantType.UInt16))
        await self.space.write_attribute_value(WORD, Ids.Value, content)

    def values(self) -> list[int]:
        (item,) = self.subscription.items.values()
        found: list[int] = []
        while item.has_something:
            found.append(item.take().Value.Value)
        return found


@pytest.fixture
async def rig(space: AddressSpace) -> Rig:
    return Rig(space)


def wanted(
    where: ua.NodeId = WORD, attribute: int = Ids.Value, mode: Mode = Mode.Reporting, queue: int = 10
) -> ua.MonitoredItemCreateRequest:
    asked = ua.MonitoringParameters(ClientHandle=9, SamplingInterval=0, QueueSize=queue, DiscardOldest=True)
    return ua.MonitoredItemCreateRequest(ua.ReadValueId(where, attribute), mode, asked)


@pytest.mark.landing
async def test_an_item_is_told_what_there_is_and_every_change(rig: Rig) -> None:
    (made,) = await rig.create(wanted())
    assert made.StatusCode.is_good()
    assert rig.values() == [7]
    await rig.change(8)
    await rig.change(8)
    await rig.change(9)
    assert rig.values()[-1] == 9


@pytest.mark.parametrize(
    ("one", "code"),
    [
        (wanted(ua.NodeId("nowhere", 7)), Codes.BadNodeIdUnknown),
        (wanted(attribute=Ids.Executable), Codes.BadAttributeIdInvalid),
        (wanted(ua.NodeId(ua.ObjectIds.ObjectsFolder), Ids.EventNotifier), Codes.BadNotSupported),
        (wanted(EVENTS, Ids.EventNotifier), Codes.BadMonitoredItemFilterInvalid),
    ],
)
async def test_what_cannot_be_watched_is_refused_and_the_others_are_not(
    rig: Rig, one: ua.MonitoredItemCreateRequest, code: int
) -> None:
    refused, made = await rig.create(one, wanted())
    assert (refused.StatusCode.value, made.StatusCode.value) == (code, Codes.Good)
    assert len(rig.subscription.items) == 1


async def test_there_are_no_more_than_there_is_room_for(rig: Rig) -> None:
    found = await rig.create(*[wanted()] * 3, room=2)
    codes = [one.StatusCode.value for one in found]
    assert codes == [Codes.Good, Codes.Good, Codes.BadTooManyMonitoredItems]


async def test_one_address_watches_one_attribute_so_often(rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(monitoring, "MOST_ON_ONE", 2)
    *_, third = await rig.create(*[wanted()] * 3)
    assert third.StatusCode.value == Codes.BadTooManyMonitoredItems
    rig.items.drop(rig.subscription, next(iter(rig.subscription.items.values())))
    (again,) = await rig.create(wanted())
    assert again.StatusCode.is_good()


async def test_a_disabled_item_is_told_again_when_it_reports(rig: Rig) -> None:
    (made,) = await rig.create(wanted(mode=Mode.Disabled))
    await rig.change(8)
    assert rig.values() == []
    params = ua.SetMonitoringModeParameters(1, Mode.Reporting, [made.MonitoredItemId, 4711])
    codes = [one.value for one in await rig.items.set_mode(rig.subscription, params)]
    assert codes == [Codes.Good, Codes.BadMonitoredItemIdInvalid]
    assert rig.values() == [8]


async def test_a_deleted_item_is_told_nothing(rig: Rig) -> None:
    (made,) = await rig.create(wanted())
    params = ua.DeleteMonitoredItemsParameters(1, [made.MonitoredItemId])
    for code in (Codes.Good, Codes.BadMonitoredItemIdInvalid):
        (found,) = await rig.items.delete(rig.subscription, params)
        assert found.value == code
    assert not rig.space[WORD].attributes[Ids.Value].datachange_callbacks


async def test_what_is_modified_is_agreed_anew(rig: Rig) -> None:
    (made,) = await rig.create(wanted(queue=10))
    asked = ua.MonitoringParameters(ClientHandle=5, SamplingInterval=1000, QueueSize=3, DiscardOldest=True)
    changes = [
        ua.MonitoredItemModifyRequest(made.MonitoredItemId, asked),
        ua.MonitoredItemModifyRequest(4711),
    ]
    params = ua.ModifyMonitoredItemsParameters(1, ua.TimestampsToReturn.Both, changes)
    agreed, unknown = await rig.items.modify(rig.subscription, params)
    assert (agreed.RevisedQueueSize, agreed.StatusCode.value) == (3, Codes.Good)
    assert unknown.StatusCode.value == Codes.BadMonitoredItemIdInvalid


async def test_an_operation_has_the_code_of_what_it_raised() -> None:
    def act(number: int) -> None:
        if number:
            raise ServiceError(number)

    found = await codes(act, (0, Codes.BadTimeout))
    assert [one.value for one in found] == [Codes.Good, Codes.BadTimeout]


@pytest.mark.parametrize(
    ("index_range", "code"), [("x", Codes.BadIndexRangeInvalid), ("1:2", Codes.BadIndexRangeNoData)]
)
async def test_events_have_no_parts(rig: Rig, index_range: str, code: int) -> None:
    asked = wanted(EVENTS, Ids.EventNotifier)
    asked.ItemToMonitor.IndexRange = index_range
    (made,) = await rig.create(asked)
    assert made.StatusCode.value == code
