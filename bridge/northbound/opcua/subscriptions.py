"""asyncua's subscriptions with limits, an owner, and without a deep copy for each value.

Corrected here (``tests/wire/opcua/test_subscriptions.py``): the publishing interval had no floor, a
session could change and delete another's subscriptions, ten thousand items held the loop for a
second to make and for longer to delete, the absolute deadband lost values and statuses.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterable
from typing import Any, Final

from asyncua.server.address_space import AddressSpace
from asyncua.server.internal_server import InternalServer
from asyncua.server.internal_subscription import InternalSubscription
from asyncua.server.monitored_item_service import (
    MonitoredItemData,
    MonitoredItemService,
)
from asyncua.server.subscription_service import SubscriptionService

from bridge.northbound.opcua.library import (
    AttributeIds,
    DataChangeFilter,
    ServiceError,
    StatusCodes,
    change,
    get,
    make,
    status,
    ua,
)
from bridge.northbound.opcua.shares import MOST_SUBSCRIPTIONS, Holder, room_for_items

LEAST_INTERVAL_MS: Final = 50.0
MOST_INTERVAL_MS: Final = 3_600_000.0
_EVENT_QUEUE: Final = 200
_VALUE_QUEUE: Final = 100
_UNACKNOWLEDGED: Final = 30
_BATCH: Final = 50


class _Items(MonitoredItemService):
    """The monitored items of one subscription."""

    def __len__(self) -> int:
        return len(self._monitored_items)

    def _make_monitored_item_common(
        self, params: ua.MonitoredItemCreateRequest
    ) -> tuple[ua.MonitoredItemCreateResult, MonitoredItemData]:
        result, data = super()._make_monitored_item_common(params)
        item = get(params, "ItemToMonitor")
        if get(item, "AttributeId") == AttributeIds.EventNotifier:
            most, default = _EVENT_QUEUE, _EVENT_QUEUE
        else:
            # Part 4 §7.21: 0 asks for the newest value only.
            most, default = _VALUE_QUEUE, 1
        asked: int = get(get(params, "RequestedParameters"), "QueueSize")
        data.queue_size = min(asked, most) or default
        return change(result, RevisedQueueSize=data.queue_size), data

    def _modify_monitored_item(self, params: ua.MonitoredItemModifyRequest) -> ua.MonitoredItemModifyResult:
        data = self._monitored_items.get(get(params, "MonitoredItemId"))
        if data is None:
            return make(
                ua.MonitoredItemModifyResult, StatusCode=status(StatusCodes.BadMonitoredItemIdInvalid)
            )
        asked = get(params, "RequestedParameters")
        data.client_handle = get(asked, "ClientHandle")
        data.queue_size = min(max(get(asked, "QueueSize"), 1), _EVENT_QUEUE)
        if get(asked, "Filter") is not None:
            data.filter = get(asked, "Filter")
        return make(
            ua.MonitoredItemModifyResult,
            RevisedSamplingInterval=get(self.isub.data, "RevisedPublishingInterval"),
            RevisedQueueSize=data.queue_size,
        )

    async def datachange_callback(
        self, handle: int, value: ua.DataValue, error: ua.StatusCode | None = None
    ) -> None:
        """A monitored value may have changed.

        asyncua keeps a deep copy of each value and compares with the one before; this keeps the last
        *reported* one as it is (a DataValue is never changed once it is made), so that a slow drift
        is reported and no status is swallowed.
        """
        if error:
            await super().datachange_callback(handle, value, error)
            return
        number = self._monitored_datachange[handle]
        data = self._monitored_items[number]
        if data.mode == ua.MonitoringMode.Disabled:
            return
        wanted = data.filter if isinstance(data.filter, DataChangeFilter) else None
        if not is_reported(data.mvalue.current_dvalue, value, wanted):
            return
        data.mvalue.current_dvalue = value
        notification = make(ua.MonitoredItemNotification, ClientHandle=data.client_handle, Value=value)
        await self.isub.enqueue_datachange_event(number, notification, data.queue_size)

    def _delete_monitored_items(self, mid: int) -> ua.StatusCode:
        data = self._monitored_items.pop(mid, None)
        if data is None:
            return status(StatusCodes.BadMonitoredItemIdInvalid)
        if data.callback_handle is not None:
            self.aspace.delete_datachange_callback(data.callback_handle)
            self._monitored_datachange.pop(data.callback_handle, None)
            return status(StatusCodes.Good)
        for node, items in list(self._monitored_events.items()):
            if mid in items:
                items.remove(mid)
            if not items:
                del self._monitored_events[node]
        return status(StatusCodes.Good)


def is_reported(last: ua.DataValue | None, now: ua.DataValue, wanted: DataChangeFilter | None) -> bool:
    """Whether ``now`` is to be told to a client that was last told ``last`` (Part 4 §7.22.2)."""
    if last is None or last.StatusCode != now.StatusCode:
        return True
    trigger = get(wanted, "Trigger") if wanted else ua.DataChangeTrigger.StatusValue
    if trigger == ua.DataChangeTrigger.Status:
        return False
    if trigger == ua.DataChangeTrigger.StatusValueTimestamp and last.SourceTimestamp != now.SourceTimestamp:
        return True
    if last.Value == now.Value:
        return False
    if wanted is None or get(wanted, "DeadbandType") != ua.DeadbandType.Absolute:
        return True
    before = last.Value.Value if last.Value else None
    after = now.Value.Value if now.Value else None
    if not isinstance(before, int | float) or not isinstance(after, int | float):
        return True
    return abs(after - before) > get(wanted, "DeadbandValue")


class Subscriptions(SubscriptionService):
    """The subscriptions of all clients."""

    def __init__(self, aspace: AddressSpace, iserver: InternalServer) -> None:
        super().__init__(aspace, iserver)
        iserver.max_subscriptions = MOST_SUBSCRIPTIONS
        iserver.max_unacked_messages_per_subscription = _UNACKNOWLEDGED

    async def create_subscription(
        self,
        params: ua.CreateSubscriptionParameters,
        callback: Callable[..., Any],
        session_id: ua.NodeId,
        request_callback: Callable[..., Any] | None = None,
    ) -> ua.CreateSubscriptionResult:
        asked: float = get(params, "RequestedPublishingInterval")
        # `not >=` puts NaN where the least is, too.
        interval = min(asked, MOST_INTERVAL_MS) if asked >= LEAST_INTERVAL_MS else LEAST_INTERVAL_MS
        change(params, RequestedPublishingInterval=interval)
        result = await super().create_subscription(params, callback, session_id, request_callback)
        subscription = self.subscriptions[get(result, "SubscriptionId")]
        subscription.monitored_item_srv = _Items(subscription, self.aspace)
        return result

    def check_owner(self, session_id: ua.NodeId, ids: Iterable[int]) -> None:
        """Raises ServiceError where one of these subscriptions is another session's or nobody's."""
        for number in ids:
            found = self.subscriptions.get(number)
            if found is None or found.session_id != session_id:
                raise ServiceError(StatusCodes.BadSubscriptionIdInvalid)

    def of(self, session_id: ua.NodeId) -> set[int]:
        return {number for number, found in self.subscriptions.items() if found.session_id == session_id}

    async def create_monitored_items(
        self, params: ua.CreateMonitoredItemsParameters
    ) -> list[ua.MonitoredItemCreateResult]:
        wanted: list[ua.MonitoredItemCreateRequest] = get(params, "ItemsToCreate")
        room = self._room(get(params, "SubscriptionId"))
        results: list[ua.MonitoredItemCreateResult] = []
        for start in range(0, len(wanted), _BATCH):
            batch = wanted[start : start + _BATCH]
            if start + len(batch) > room:
                code = status(StatusCodes.BadTooManyMonitoredItems)
                results += [make(ua.MonitoredItemCreateResult, StatusCode=code) for _ in batch]
                continue
            change(params, ItemsToCreate=batch)
            results += await super().create_monitored_items(params)
            await asyncio.sleep(0)
        return results

    def _room(self, number: int) -> int:
        """How many more monitored items this subscription may have."""
        items: dict[ua.NodeId, int] = {}
        for subscription in self.subscriptions.values():
            session_id = subscription.session_id
            items[session_id] = items.get(session_id, 0) + _count(subscription)
        sessions: list[Holder] = get(self.iserver, "sessions")
        return room_for_items(self.subscriptions[number].session_id, sessions, items)


def _count(subscription: InternalSubscription) -> int:
    items = subscription.monitored_item_srv
    return len(items) if isinstance(items, _Items) else 0
