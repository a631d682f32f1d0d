"""Monitored items of the address space: made, changed and deleted (OPC 10000-4 §5.13)."""

from __future__ import annotations

from collections import Counter
from collections.abc import Awaitable, Callable, Hashable, Sequence
from contextlib import suppress
from itertools import count
from typing import Final, TypeVar

from asyncua.server.address_space import AddressSpace, NodeData

from bridge.base.sources import source_of
from bridge.uaserver import ranges
from bridge.uaserver.filters.changefilter import change_filter
from bridge.uaserver.filters.eventfilter import EventFilterFault, event_filter
from bridge.uaserver.hierarchy import EventTypes
from bridge.uaserver.library import (
    GOOD,
    AttributeIds,
    ServiceError,
    StatusCodes,
    change,
    get,
    make,
    status,
    ua,
)
from bridge.uaserver.loop import Stint, loop_time
from bridge.uaserver.reading import checked_times, window, window_of
from bridge.uaserver.subscriptions.items import (
    EventItem,
    Item,
    ValueItem,
    event_settings,
    event_weight,
    value_settings,
)
from bridge.uaserver.subscriptions.quotas import MOST_ON_ONE, EventItemQuota
from bridge.uaserver.subscriptions.subscription import Subscription

_SUBSCRIBE_TO_EVENTS: Final = 1

_T = TypeVar("_T")


class MonitoredItems:
    """The items of all subscriptions. Times are those of the event loop."""

    def __init__(self, space: AddressSpace) -> None:
        self._space = space
        self._numbers = count(1)
        self._watching: Counter[Hashable] = Counter()
        self._event_items = EventItemQuota()
        self.event_types = EventTypes(space)

    @property
    def is_full(self) -> bool:
        """Items for events: there may be no more of them, whoever asks."""
        return self._event_items.is_full

    async def create(
        self,
        find: Callable[[], Subscription],
        params: ua.CreateMonitoredItemsParameters,
        room: Callable[[], int],
        make_room: Callable[[], Awaitable[bool]],
    ) -> list[ua.MonitoredItemCreateResult]:
        """``room`` tells how much there is now, ``make_room`` whether there is more, ``find`` the
        subscription; ServiceError where that has been deleted meanwhile."""
        times = checked_times(params)
        found, left = find(), room()
        stint, results = Stint(), list[ua.MonitoredItemCreateResult]()
        for wanted in get(params, "ItemsToCreate"):
            if await stint.pause():
                found, left = find(), room()
            result = self._create(found, wanted, times, left)
            while _is_too_many(result) and await make_room():
                found, left = find(), room()
                result = self._create(found, wanted, times, left)
            left -= 1
            results.append(result)
        return results

    def _create(
        self,
        subscription: Subscription,
        wanted: ua.MonitoredItemCreateRequest,
        times: ua.TimestampsToReturn,
        room: int,
    ) -> ua.MonitoredItemCreateResult:
        target: ua.ReadValueId = get(wanted, "ItemToMonitor")
        try:
            if room <= 0:
                raise ServiceError(StatusCodes.BadTooManyMonitoredItems)
            node = self._space.get(get(target, "NodeId"))
            if node is None:
                raise ServiceError(StatusCodes.BadNodeIdUnknown)
            if get(target, "AttributeId") not in node.attributes:
                raise ServiceError(StatusCodes.BadAttributeIdInvalid)
            if get(target, "AttributeId") == AttributeIds.EventNotifier:
                if window(target, times).ranges:
                    raise ServiceError(StatusCodes.BadIndexRangeNoData)
                item = self._event_item(node, wanted, subscription)
            else:
                item = self._value_item(node, wanted, times, subscription)
        except ServiceError as error:
            return _faulty(ua.MonitoredItemCreateResult(), error)
        subscription.add(item)
        if isinstance(item, ValueItem):
            self._watch(subscription, item)
        return change(_agreed(ua.MonitoredItemCreateResult(), item), MonitoredItemId=item.number)

    def _event_item(
        self, node: NodeData, wanted: ua.MonitoredItemCreateRequest, subscription: Subscription
    ) -> EventItem:
        held = self._space.read_attribute_value(node.nodeid, AttributeIds.EventNotifier).Value
        if held is None or not held.Value & _SUBSCRIBE_TO_EVENTS:
            raise ServiceError(StatusCodes.BadNotSupported)
        asked: ua.MonitoringParameters = get(wanted, "RequestedParameters")
        filter_ = event_filter(get(asked, "Filter"), self.event_types)
        mode = get(wanted, "MonitoringMode")
        settings, share = event_settings(asked), source_of(subscription.owner.address)
        self._event_items.change(share, event_weight(settings, filter_))
        return EventItem(next(self._numbers), node.nodeid, settings, filter_, mode, share)

    def _value_item(
        self,
        node: NodeData,
        wanted: ua.MonitoredItemCreateRequest,
        times: ua.TimestampsToReturn,
        subscription: Subscription,
    ) -> ValueItem:
        target: ua.ReadValueId = get(wanted, "ItemToMonitor")
        asked: ua.MonitoringParameters = get(wanted, "RequestedParameters")
        attribute: AttributeIds = get(target, "AttributeId")
        source = source_of(subscription.owner.address)
        if self._watching[source, node.nodeid, attribute] >= MOST_ON_ONE:
            raise ServiceError(StatusCodes.BadTooManyMonitoredItems)
        looked_at = window(target, times)
        if looked_at.ranges:
            there = self._space.read_attribute_value(node.nodeid, attribute).Value
            if not ranges.can_have(there):
                raise ServiceError(StatusCodes.BadIndexRangeNoData)
        return ValueItem(
            next(self._numbers),
            node.nodeid,
            attribute,
            looked_at,
            value_settings(asked, subscription.terms.interval_ms),
            change_filter(get(asked, "Filter"), self._space, node, attribute),
            get(wanted, "MonitoringMode"),
            source,
        )

    def _watch(self, subscription: Subscription, item: ValueItem) -> None:
        """Have the item told of every change, and of what there is now."""
        watcher = _ItemWatcher(subscription, item)
        _, item.handle = get(self._space, "add_datachange_callback")(item.node, item.attribute, watcher)
        self._watching[item.share] += 1
        self._look(subscription, item)

    def _look(self, subscription: Subscription, item: ValueItem) -> None:
        value = self._space.read_attribute_value(item.node, item.attribute)
        _ItemWatcher(subscription, item).told(value, loop_time())

    async def modify(
        self, found: Subscription, params: ua.ModifyMonitoredItemsParameters
    ) -> list[ua.MonitoredItemModifyResult]:
        times = checked_times(params)
        stint, results = Stint(), list[ua.MonitoredItemModifyResult]()
        for wanted in get(params, "ItemsToModify"):
            results.append(self._modify(found, wanted, times))
            await stint.pause()
        return results

    def _modify(
        self,
        subscription: Subscription,
        wanted: ua.MonitoredItemModifyRequest,
        times: ua.TimestampsToReturn,
    ) -> ua.MonitoredItemModifyResult:
        asked: ua.MonitoringParameters = get(wanted, "RequestedParameters")
        try:
            item = _item(subscription, get(wanted, "MonitoredItemId"))
            if isinstance(item, EventItem):
                settings = event_settings(asked)
                filter_ = event_filter(get(asked, "Filter"), self.event_types)
                self._event_items.change(item.share, event_weight(settings, filter_) - item.weight)
                item.modify(settings, filter_)
            else:
                node = self._space[item.node]
                filter_ = change_filter(get(asked, "Filter"), self._space, node, item.attribute)
                settings = value_settings(asked, subscription.terms.interval_ms)
                item.modify(settings, filter_, window_of(item.window.ranges, item.attribute, times))
        except ServiceError as error:
            return _faulty(ua.MonitoredItemModifyResult(), error)
        return _agreed(ua.MonitoredItemModifyResult(), item)

    async def set_mode(
        self, found: Subscription, params: ua.SetMonitoringModeParameters
    ) -> list[ua.StatusCode]:
        mode: ua.MonitoringMode = get(params, "MonitoringMode")

        def set_one(number: int) -> None:
            item = _item(found, number)
            was_disabled = item.mode == ua.MonitoringMode.Disabled
            item.set_mode(mode)
            if was_disabled and isinstance(item, ValueItem):
                self._look(found, item)
            found.noticed(item)

        return await codes(set_one, get(params, "MonitoredItemIds"))

    async def set_triggering(
        self, found: Subscription, params: ua.SetTriggeringParameters
    ) -> ua.SetTriggeringResult:
        """Raises ServiceError for a triggering item that is not there."""
        trigger = _item(found, get(params, "TriggeringItemId")).number

        def remove(number: int) -> None:
            found.links.remove(trigger, number)

        def add(number: int) -> None:
            found.links.add(trigger, _item(found, number))

        # Part 4 §5.13.5.2: what is to be removed comes first.
        return make(
            ua.SetTriggeringResult,
            RemoveResults=await codes(remove, get(params, "LinksToRemove") or ()),
            AddResults=await codes(add, get(params, "LinksToAdd") or ()),
        )

    async def delete(
        self, found: Subscription, params: ua.DeleteMonitoredItemsParameters
    ) -> list[ua.StatusCode]:
        def delete_one(number: int) -> None:
            self.drop(found, _item(found, number))

        return await codes(delete_one, get(params, "MonitoredItemIds"))

    def drop(self, subscription: Subscription, item: Item) -> None:
        subscription.drop(item)
        if isinstance(item, EventItem):
            self._event_items.change(item.share, -item.weight)
        else:
            # A node of the diagnostics goes with its session.
            with suppress(KeyError):
                self._space.delete_datachange_callback(item.handle)
            self._watching[item.share] -= 1
            if not self._watching[item.share]:
                del self._watching[item.share]

    async def drop_all(self, subscription: Subscription) -> None:
        """Drop the items of a subscription that has ended, in turns."""
        stint = Stint()
        for item in list(subscription.items.values()):
            if item.number in subscription.items:
                self.drop(subscription, item)
            await stint.pause()


class _ItemWatcher:
    """Tells ``item`` of each value of what it watches."""

    __slots__ = ("_item", "_looks_alike", "_subscription")

    def __init__(self, subscription: Subscription, item: ValueItem) -> None:
        self._subscription = subscription
        self._item = item
        self._looks_alike = subscription.owner.looks_alike(item.node, item.attribute)

    def told(self, value: ua.DataValue, now: float) -> None:
        item, subscription = self._item, self._subscription
        if not self._looks_alike:
            value = subscription.owner.seen(item.node, item.attribute, value)
        is_queued = item.change(value, now)
        subscription.noticed(item, is_queued=is_queued)

    async def __call__(self, handle: int, value: ua.DataValue) -> None:
        self.told(value, loop_time())


def _is_too_many(result: ua.MonitoredItemCreateResult) -> bool:
    return get(result, "StatusCode").value == StatusCodes.BadTooManyMonitoredItems


def _item(subscription: Subscription, number: int) -> Item:
    item = subscription.items.get(number)
    if item is None:
        raise ServiceError(StatusCodes.BadMonitoredItemIdInvalid)
    return item


async def codes(act: Callable[[int], None], numbers: Sequence[int]) -> list[ua.StatusCode]:
    """Status codes of the operations of a request, carried out in turns."""
    stint, found = Stint(), list[ua.StatusCode]()
    for number in numbers:
        try:
            act(number)
        except ServiceError as error:
            found.append(status(int(error.code)))
        else:
            found.append(GOOD)
        await stint.pause()
    return found


def _agreed(result: _T, item: Item) -> _T:
    change(
        result,
        RevisedSamplingInterval=item.settings.sampling_ms,
        RevisedQueueSize=item.settings.queue_size,
    )
    told = item.filter.result if isinstance(item, EventItem) else None
    return result if told is None else change(result, FilterResult=told)


def _faulty(result: _T, error: ServiceError) -> _T:
    change(result, StatusCode=status(int(error.code)))
    return change(result, FilterResult=error.result) if isinstance(error, EventFilterFault) else result
