"""One subscription: its cycles, its messages and what of them may be asked for again (OPC 10000-4 §5.14.1).

Of time it knows what ``on_cycle`` is told; ``subscriptions`` has the timer.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final, Protocol

from bridge.uaserver.application import UserIdentity
from bridge.uaserver.counts import SubscriptionCounts
from bridge.uaserver.encoding import weight
from bridge.uaserver.filters.eventfilter import Occurrence
from bridge.uaserver.languages import speaking
from bridge.uaserver.library import AttributeIds, ServiceError, StatusCodes, get, make, status, ua
from bridge.uaserver.subscriptions.items import EventItem, Item, ValueItem
from bridge.uaserver.subscriptions.notifications import change, changes
from bridge.uaserver.subscriptions.publishing import PublishQueue, PublishRequest
from bridge.uaserver.subscriptions.triggering import TriggeringLinks

LEAST_INTERVAL_MS: Final = 50.0
MOST_INTERVAL_MS: Final = 3_600_000.0
MOST_QUIET_MS: Final = 600_000.0
"""A keep-alive comes at least so often, or once in an interval that is longer."""

_KEEP_ALIVES: Final = 10
"""Intervals without a message until a keep-alive, for clients that leave that to the server."""

MOST_PER_MESSAGE: Final = 1_000
"""Notifications in one message; what is left follows with the next request."""

RETRANSMISSIONS: Final = 30
"""Messages of a subscription that are kept until they are acknowledged."""

_LAST_SEQUENCE: Final = 0xFFFF_FFFF


@dataclass(frozen=True, slots=True)
class Terms:
    """Parameters of a subscription as revised. ``lifetime`` and ``keep_alive`` count intervals."""

    interval_ms: float
    lifetime: int
    keep_alive: int
    most_per_message: int
    priority: int


def terms(params: object) -> Terms:
    """The terms for what a CreateSubscription or ModifySubscription request asks for."""
    asked: float = get(params, "RequestedPublishingInterval")
    # `not >=` puts NaN where the least is, too.
    interval = min(asked, MOST_INTERVAL_MS) if asked >= LEAST_INTERVAL_MS else LEAST_INTERVAL_MS
    most_quiet = max(1, int(MOST_QUIET_MS / interval))
    keep_alive = min(get(params, "RequestedMaxKeepAliveCount") or _KEEP_ALIVES, most_quiet)
    # Part 4 §5.14.2: the lifetime is three keep-alives at least.
    lifetime = min(max(get(params, "RequestedLifetimeCount"), 3 * keep_alive), 3 * most_quiet)
    most = min(get(params, "MaxNotificationsPerPublish") or MOST_PER_MESSAGE, MOST_PER_MESSAGE)
    return Terms(interval, lifetime, keep_alive, most, get(params, "Priority"))


class SubscriptionOwner(Protocol):
    """The session that a subscription is told to. ``holder`` is None while it has no connection; the last one
    ended at ``left_at``."""

    session_id: ua.NodeId
    address: str
    locales: Sequence[str]
    identity: UserIdentity
    channel_certificate: bytes | None
    publishing: PublishQueue
    left_at: float

    @property
    def holder(self) -> object | None: ...

    @property
    def is_gone(self) -> bool:
        """Whether the session has ended. Its subscriptions may be transferred as long as they live."""
        ...

    def looks_alike(self, where: ua.NodeId, attribute: AttributeIds) -> bool:
        """Whether everybody sees the same of it: its values as they are."""
        ...

    def seen(self, where: ua.NodeId, attribute: AttributeIds, value: ua.DataValue) -> ua.DataValue:
        """``value`` as this user may see it."""
        ...

    async def abort(self, *, delete_subs: bool = True) -> None:
        """End it for an error, of its client or of the network, and count that."""
        ...

    async def evict(self) -> None:
        """End it, with its subscriptions and its connection, for somebody with a higher role."""
        ...


class Subscription:
    """``items`` by their numbers."""

    # asyncua puts these on each subscription of a session that comes back on another connection.
    pub_result_callback: object = None
    pub_request_callback: object = None

    def __init__(self, number: int, owner: SubscriptionOwner, agreed: Terms, *, enabled: bool) -> None:
        self.number = number
        self.owner = owner
        self.terms = agreed
        self.items: dict[int, Item] = {}
        self.links = TriggeringLinks()
        self.counts = SubscriptionCounts()
        self._enabled = enabled
        self._listeners: dict[int, EventItem] = {}
        self._ready: dict[int, Item] = {}
        self._holding: dict[int, ValueItem] = {}
        self._sent: dict[int, ua.NotificationMessage] = {}
        self._sequence = 1
        # The first message comes with the first cycle, if only to say that the subscription is there.
        self._quiet = agreed.keep_alive - 1
        self._silent = 0

    @property
    def session_id(self) -> ua.NodeId:
        return self.owner.session_id

    @property
    def priority(self) -> int:
        return self.terms.priority

    @property
    def is_enabled(self) -> bool:
        return self._enabled

    @property
    def quiet_cycles(self) -> int:
        """Publishing intervals since the last message."""
        return self._quiet

    @property
    def silent_cycles(self) -> int:
        """Publishing intervals since its client has last asked for something."""
        return self._silent

    @property
    def next_sequence(self) -> int:
        return self._sequence

    @property
    def is_listening(self) -> bool:
        """Whether it has items for events."""
        return bool(self._listeners)

    # what there is to tell

    def noticed(self, item: Item, *, is_queued: bool = False) -> None:
        """Look at an item whose value, or queue, may have changed. ``is_queued``: it has queued something,
        which triggers those that are linked to it."""
        number = item.number
        if is_queued:
            self.links.fire(number)
        if item.lost:
            self._count_lost(item)
        if isinstance(item, ValueItem) and item.is_holding:
            self._holding[number] = item
        if item.has_something:
            self._ready[number] = item

    def _count_lost(self, item: Item) -> None:
        if isinstance(item, ValueItem):
            self.counts.value_overflows += item.lost
        else:
            self.counts.event_overflows += item.lost
        item.lost = 0

    def add(self, item: Item) -> None:
        self.items[item.number] = item
        if isinstance(item, EventItem):
            self._listeners[item.number] = item

    def drop(self, item: Item) -> None:
        for held in (self.items, self._listeners, self._ready, self._holding):
            held.pop(item.number, None)
        self.links.drop(item.number)

    @property
    def listeners(self) -> list[EventItem]:
        return list(self._listeners.values())

    def hear(self, event: Occurrence) -> None:
        for item in self._listeners.values():
            self.tell(item, event)

    def tell(self, item: EventItem, event: Occurrence) -> None:
        """Tell one of its items alone."""
        if item.hear(event):
            self.noticed(item, is_queued=True)

    def repeat_values(self) -> None:
        """Tell every value again that nothing newer is queued for."""
        for item in self.items.values():
            if isinstance(item, ValueItem):
                item.repeat()
                self.noticed(item)

    # cycles

    def on_cycle(self, now: float) -> bool:
        """A publishing interval is over. False when the subscription has outlived its client."""
        self._silent += 1
        if self._silent >= self.terms.lifetime:
            return False
        for item in list(self._holding.values()):
            is_queued = item.sample(now)
            if not item.is_holding:
                del self._holding[item.number]
            self.noticed(item, is_queued=is_queued)
        self.links.release()
        self._quiet += 1
        if self._quiet >= self.terms.keep_alive or (self._enabled and any(self._reporting())):
            self.counts.late_publish_requests += not self.owner.publishing.ask(self, now)
        return True

    def touch(self) -> None:
        """The client has asked for something of this subscription: it is there."""
        self._silent = 0

    def set_enabled(self, enabled: bool) -> None:
        self._enabled = enabled
        self.counts.enabled += enabled
        self.counts.disabled += not enabled
        self.touch()

    def modify(self, agreed: Terms) -> None:
        self.terms = agreed
        self.counts.modified += 1
        self.touch()

    def _reporting(self) -> Iterator[Item]:
        return (item for item in self._ready.values() if item.has_report)

    # messages

    def publish(self, request: PublishRequest) -> bool:
        with speaking(self.owner.locales):
            values, events = self._collect(request.most_bytes) if self._enabled else ([], [])
        data: list[object] = []
        if values:
            data.append(changes(values))
        if events:
            data.append(make(ua.EventNotificationList, Events=events))
        message = make(ua.NotificationMessage, SequenceNumber=self._sequence, NotificationData=data)
        self.counts.publish_requests += 1
        self.counts.data_changes += len(values)
        self.counts.events += len(events)
        if data:
            self._keep(message)
        more = self._enabled and any(self._reporting())
        self._quiet = self._silent = 0
        request.answer(
            make(
                ua.PublishResult,
                SubscriptionId=self.number,
                AvailableSequenceNumbers=self.available,
                MoreNotifications=more,
                NotificationMessage=message,
                Results=request.results,
            )
        )
        return more

    def _collect(self, most_bytes: int) -> tuple[list[bytes], list[ua.EventFieldList]]:
        """Notifications for one message, as many as go into it; those of values are encoded."""
        values: list[bytes] = []
        events: list[ua.EventFieldList] = []
        left, bytes_left = self.terms.most_per_message, most_bytes
        for item in list(self._reporting()):
            while left and item.has_report:
                left -= 1
                if isinstance(item, ValueItem):
                    values.append(change(item.settings.client_handle, item.take()))
                    bytes_left -= len(values[-1])
                else:
                    events.append(item.notification())
                    bytes_left -= weight(get(events[-1], "EventFields"))
                if bytes_left < 0:
                    left = 0
            if not item.has_something:
                del self._ready[item.number]
            if not left:
                break
        return values, events

    def _keep(self, message: ua.NotificationMessage) -> None:
        self._sent[self._sequence] = message
        # 0 is never a sequence number (Part 4 §7.26).
        self._sequence = self._sequence % _LAST_SEQUENCE + 1
        if len(self._sent) > RETRANSMISSIONS:
            del self._sent[next(iter(self._sent))]
            self.counts.discarded_messages += 1

    @property
    def available(self) -> list[int]:
        """The sequence numbers that can be asked for again."""
        return list(self._sent)

    def acknowledge(self, sequence: int) -> ua.StatusCode:
        known = self._sent.pop(sequence, None) is not None
        return status(StatusCodes.Good if known else StatusCodes.BadSequenceNumberUnknown)

    def republish(self, sequence: int) -> ua.NotificationMessage:
        """The message again. Raises ServiceError where it is not kept, or not any more."""
        self.touch()
        self.counts.republish_requests += 1
        message = self._sent.get(sequence)
        if message is None:
            raise ServiceError(StatusCodes.BadMessageNotAvailable)
        self.counts.republished += 1
        return message

    def last_word(self, code: int) -> ua.PublishResult:
        """The message that says why no other follows. It takes no sequence number."""
        told = make(ua.StatusChangeNotification, Status=status(code))
        message = make(ua.NotificationMessage, SequenceNumber=self._sequence, NotificationData=[told])
        return make(
            ua.PublishResult, SubscriptionId=self.number, MoreNotifications=False, NotificationMessage=message
        )
