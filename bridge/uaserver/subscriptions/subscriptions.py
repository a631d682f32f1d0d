"""The subscriptions of all clients, in place of asyncua's, which answers Good to much that it does not do.

What each service does is in ``services``; the tests are ``tests/wire/opcua/test_subscriptions.py`` and
``test_services.py``.
"""

from __future__ import annotations

import asyncio
from collections.abc import Iterator, Sequence
from itertools import count
from typing import TypeVar

from asyncua.server.address_space import AddressSpace

from bridge.base.publishing_clock import cycle_by
from bridge.base.sources import source_of
from bridge.uaserver.counts import ServerCounts
from bridge.uaserver.library import ServiceError, StatusCodes, change, get, make, status, ua
from bridge.uaserver.loop import Stint, loop_time
from bridge.uaserver.subscriptions.monitoring import MonitoredItems, codes
from bridge.uaserver.subscriptions.publishing import PublishRequest
from bridge.uaserver.subscriptions.quotas import MOST_ITEMS, MOST_SUBSCRIPTIONS, lower_than, room_for_items
from bridge.uaserver.subscriptions.subscription import Subscription, SubscriptionOwner, terms

_T = TypeVar("_T")


class Subscriptions:
    """``subscriptions`` by their numbers. Times are those of the event loop."""

    def __init__(self, space: AddressSpace) -> None:
        self.subscriptions: dict[int, Subscription] = {}
        self._numbers = count(1)
        self.items = MonitoredItems(space)
        self.counts = ServerCounts()
        self._timers: dict[int, asyncio.TimerHandle] = {}
        self._dropping: set[asyncio.Task[None]] = set()
        self._drops = asyncio.Lock()

    def prepare(self) -> None:
        """The address space is complete."""
        self.items.event_types.look()

    def of(self, owner: SubscriptionOwner) -> list[Subscription]:
        return [found for found in self.subscriptions.values() if found.owner is owner]

    def own(self, owner: SubscriptionOwner, number: int) -> Subscription:
        """Raises ServiceError where this subscription is another session's or nobody's."""
        found = self.subscriptions.get(number)
        if found is None or found.owner is not owner:
            raise ServiceError(StatusCodes.BadSubscriptionIdInvalid)
        found.touch()
        return found

    # the Subscription service set

    def create(
        self, owner: SubscriptionOwner, params: ua.CreateSubscriptionParameters
    ) -> ua.CreateSubscriptionResult:
        if len(self.subscriptions) >= MOST_SUBSCRIPTIONS:
            raise ServiceError(StatusCodes.BadTooManySubscriptions)
        enabled: bool = get(params, "PublishingEnabled")
        made = Subscription(next(self._numbers), owner, terms(params), enabled=enabled)
        self.subscriptions[made.number] = made
        self.counts.subscriptions += 1
        self._begin(made)
        return change(_revised(ua.CreateSubscriptionResult(), made), SubscriptionId=made.number)

    def modify(
        self, owner: SubscriptionOwner, params: ua.ModifySubscriptionParameters
    ) -> ua.ModifySubscriptionResult:
        found = self.own(owner, get(params, "SubscriptionId"))
        before = found.terms.interval_ms
        found.modify(terms(params))
        if found.terms.interval_ms != before:
            self._timers[found.number].cancel()
            self._begin(found)
        return _revised(ua.ModifySubscriptionResult(), found)

    async def set_publishing_mode(
        self, owner: SubscriptionOwner, params: ua.SetPublishingModeParameters
    ) -> list[ua.StatusCode]:
        def set_one(number: int) -> None:
            self.own(owner, number).set_enabled(get(params, "PublishingEnabled"))

        return await codes(set_one, get(params, "SubscriptionIds"))

    async def delete(
        self, owner: SubscriptionOwner, params: ua.DeleteSubscriptionsParameters
    ) -> list[ua.StatusCode]:
        dropping: list[asyncio.Task[None]] = []

        def delete_one(number: int) -> None:
            dropping.append(self._close(self.own(owner, number)))

        results = await codes(delete_one, get(params, "SubscriptionIds"))
        self._release_requests(owner)
        await _all(dropping)
        return results

    async def drop_left_behind(self) -> None:
        """Delete the oldest subscription without a session, where there are as many as there may be."""
        if len(self.subscriptions) >= MOST_SUBSCRIPTIONS and (oldest := next(self._left_behind(), None)):
            await _all([self._close(oldest)])

    def _left_behind(self) -> Iterator[Subscription]:
        """Subscriptions whose session has ended, the oldest first."""
        return (found for found in self.subscriptions.values() if found.owner.is_gone)

    async def end(self, owner: SubscriptionOwner, *, delete: bool) -> None:
        """The session ends. What it leaves behind is for the same client; without one it goes, too."""
        if delete or not _is_known(owner):
            await _all([self._close(found) for found in self.of(owner)])

    def publish(
        self,
        owner: SubscriptionOwner,
        acknowledged: Sequence[ua.SubscriptionAcknowledgement],
        request: PublishRequest,
    ) -> None:
        """Acknowledge messages and have the request answered when there is something to tell."""
        for one in acknowledged:
            found = self.subscriptions.get(get(one, "SubscriptionId"))
            if found is None or found.owner is not owner:
                request.results.append(status(StatusCodes.BadSubscriptionIdInvalid))
            else:
                request.results.append(found.acknowledge(get(one, "SequenceNumber")))
        subscriptions = len(self.of(owner))
        if not subscriptions and not owner.publishing.has_last_words:
            raise ServiceError(StatusCodes.BadNoSubscription)
        owner.publishing.put(request, subscriptions, loop_time())

    def republish(self, owner: SubscriptionOwner, params: ua.RepublishParameters) -> ua.NotificationMessage:
        found = self.own(owner, get(params, "SubscriptionId"))
        return found.republish(get(params, "RetransmitSequenceNumber"))

    async def transfer(
        self, owner: SubscriptionOwner, params: ua.TransferSubscriptionsParameters
    ) -> list[ua.TransferResult]:
        initial: bool = get(params, "SendInitialValues")
        stint, results = Stint(), list[ua.TransferResult]()
        for number in get(params, "SubscriptionIds"):
            results.append(self._transfer(owner, number, initial))
            await stint.pause()
        return results

    def _transfer(self, owner: SubscriptionOwner, number: int, initial: bool) -> ua.TransferResult:
        found = self.subscriptions.get(number)
        if found is None:
            return make(ua.TransferResult, StatusCode=status(StatusCodes.BadSubscriptionIdInvalid))
        before = found.owner
        found.counts.transfer_requests += 1
        if before is owner:
            return make(ua.TransferResult, StatusCode=status(StatusCodes.BadNothingToDo))
        if not _is_same_client(before, owner):
            return make(ua.TransferResult, StatusCode=status(StatusCodes.BadUserAccessDenied))
        found.owner = owner
        # Who is not the same client is refused above.
        found.counts.transferred_to_same_client += 1
        found.touch()
        before.publishing.forget(found)
        before.publishing.say_last(found.last_word(StatusCodes.GoodSubscriptionTransferred), loop_time())
        self._release_requests(before)
        if initial:
            found.repeat_values()
        return make(ua.TransferResult, AvailableSequenceNumbers=found.available)

    # the MonitoredItem service set

    async def create_items(
        self, owner: SubscriptionOwner, params: ua.CreateMonitoredItemsParameters
    ) -> list[ua.MonitoredItemCreateResult]:
        def room() -> int:
            return room_for_items(owner.address, self.subscriptions.values())

        async def make_room() -> bool:
            """Delete a subscription without a session before anything is refused, else end a session of a
            lower role: one of this address, or where all together have too much, of any."""
            rank = owner.identity.rank
            left = [found for found in self._left_behind() if found.owner.identity.rank <= rank]
            ending = [found for found in left if source_of(found.owner.address) == source]
            if not ending and self._is_full:
                ending = left
            await _all([self._close(oldest) for oldest in ending[:1]])
            if ending:
                return True
            holders = [found.owner for found in self.subscriptions.values() for _ in found.items]
            same = [one for one in holders if source_of(one.address) == source]
            lower = lower_than(owner, same) or (lower_than(owner, holders) if self._is_full else None)
            if lower:
                await lower.evict()
            return lower is not None

        source = source_of(owner.address)
        number: int = get(params, "SubscriptionId")
        return await self.items.create(lambda: self.own(owner, number), params, room, make_room)

    @property
    def _is_full(self) -> bool:
        """All together have as many items as there may be."""
        return self.items.is_full or sum(len(one.items) for one in self.subscriptions.values()) >= MOST_ITEMS

    # cycles and ends

    def _begin(self, subscription: Subscription) -> None:
        self._arm(subscription, cycle_by(loop_time() + subscription.terms.interval_ms / 1000))

    def _arm(self, subscription: Subscription, at: float) -> None:
        loop = asyncio.get_running_loop()
        self._timers[subscription.number] = loop.call_at(at, self._on_timer, subscription, at)

    def _on_timer(self, subscription: Subscription, at: float) -> None:
        now = loop_time()
        # First of all, so that nothing below can end it. Cycles that were missed are not made up for.
        interval_s = subscription.terms.interval_ms / 1000
        self._arm(subscription, at + interval_s if at + interval_s > now else cycle_by(now + interval_s))
        if not subscription.on_cycle(now):
            owner = subscription.owner
            self._close(subscription)
            owner.publishing.say_last(subscription.last_word(StatusCodes.BadTimeout), now)
            self._release_requests(owner)

    def _close(self, subscription: Subscription) -> asyncio.Task[None]:
        """It is there for nobody any more. Its items, of which there may be many, are dropped by a task."""
        del self.subscriptions[subscription.number]
        self._timers.pop(subscription.number).cancel()
        subscription.owner.publishing.forget(subscription)
        dropping = asyncio.create_task(self._drop_items(subscription))
        self._dropping.add(dropping)
        dropping.add_done_callback(self._dropping.discard)
        return dropping

    async def _drop_items(self, subscription: Subscription) -> None:
        # One after the other: each takes its share of the loop's time.
        async with self._drops:
            await self.items.drop_all(subscription)

    def _release_requests(self, owner: SubscriptionOwner) -> None:
        """Answer the Publish requests of a session without subscriptions, to which nothing can come."""
        if not self.of(owner):
            owner.publishing.refuse_all(StatusCodes.BadNoSubscription, loop_time())


async def _all(dropping: Sequence[asyncio.Task[None]]) -> None:
    """Wait for them. They go on where whoever waits does not."""
    if dropping:
        await asyncio.wait(dropping)


def _revised(result: _T, subscription: Subscription) -> _T:
    agreed = subscription.terms
    return change(
        result,
        RevisedPublishingInterval=agreed.interval_ms,
        RevisedLifetimeCount=agreed.lifetime,
        RevisedMaxKeepAliveCount=agreed.keep_alive,
    )


def _is_same_client(before: SubscriptionOwner, now: SubscriptionOwner) -> bool:
    """Part 4 §5.14.7: the same user. Anybody can come without a name: then the same certificate."""
    if not before.identity.is_same(now.identity) or not _is_known(now):
        return False
    return not now.identity.is_anonymous or now.channel_certificate == before.channel_certificate


def _is_known(owner: SubscriptionOwner) -> bool:
    """Whether a client can be told from others: by its name or its certificate."""
    return not owner.identity.is_anonymous or owner.channel_certificate is not None
