"""Monitored items: what is sampled, what of it is reported, and the queue of each (OPC 10000-4 §5.13.1).

They are told what has changed and when, and keep no time themselves. There are tens of thousands of them,
each of as few objects as can be: a collection of garbage looks at every one.
"""

from __future__ import annotations

import math
import uuid
from collections import deque
from collections.abc import Hashable
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import Final

from bridge.base.publishing_clock import PUBLISH_EVERY_S
from bridge.uaserver.filters.changefilter import ChangeFilter
from bridge.uaserver.filters.eventfilter import EventFilter, Occurrence
from bridge.uaserver.filters.where import Fields
from bridge.uaserver.library import (
    AttributeIds,
    ObjectIds,
    data_value,
    get,
    make,
    node_id,
    status,
    text,
    ua,
    variant,
)
from bridge.uaserver.reading import Window

LEAST_SAMPLING_MS: Final = PUBLISH_EVERY_S * 1000
_HALF_GRID_S: Final = PUBLISH_EVERY_S / 2

MOST_SAMPLING_MS: Final = 3_600_000.0
VALUE_QUEUE: Final = 100
EVENT_QUEUE: Final = 200
"""Length of the queue of an item for events that leaves it to the server."""
MOST_EVENTS: Final = 2_000
"""Longest queue of an item for events: a plant with a thousand alarms at once."""
_OVERFLOW: Final = 0x0480
"""InfoType DataValue and the bit Overflow of a status code (Part 4 §7.39.1)."""

Monitoring = ua.MonitoringMode


@dataclass(frozen=True, slots=True)
class ItemSettings:
    """Settings of a monitored item as revised. ``queue_size`` is at least 1."""

    client_handle: int
    sampling_ms: float
    queue_size: int
    discard_oldest: bool


def value_settings(asked: ua.MonitoringParameters, publishing_ms: float) -> ItemSettings:
    """A negative sampling interval asks for the publishing interval, a queue of 0 for the newest value."""
    wanted: float = get(asked, "SamplingInterval")
    if wanted < 0:
        wanted = publishing_ms
    # `not >=` puts NaN where the least is, too.
    sampling = min(wanted, MOST_SAMPLING_MS) if wanted >= LEAST_SAMPLING_MS else LEAST_SAMPLING_MS
    size = max(1, min(get(asked, "QueueSize"), VALUE_QUEUE))
    return ItemSettings(get(asked, "ClientHandle"), sampling, size, get(asked, "DiscardOldest"))


def event_weight(settings: ItemSettings, filter_: EventFilter) -> int:
    """Weight of an item for events: cost of judging an event, and of keeping a queue of them."""
    return filter_.weight * math.ceil(settings.queue_size / EVENT_QUEUE)


def event_settings(asked: ua.MonitoringParameters) -> ItemSettings:
    """Events are not sampled; a queue of 0 or 1 asks for the server's own (Part 4 §7.21)."""
    size: int = get(asked, "QueueSize")
    size = min(size, MOST_EVENTS) if size > 1 else EVENT_QUEUE
    return ItemSettings(get(asked, "ClientHandle"), 0.0, size, get(asked, "DiscardOldest"))


@dataclass(slots=True, eq=False)
class ValueItem:
    """Watches one ``attribute`` of ``node``. ``source`` is whom it is counted for, ``handle`` that of
    asyncua's callback for changes."""

    number: int
    node: ua.NodeId
    attribute: AttributeIds
    window: Window
    settings: ItemSettings
    filter: ChangeFilter
    mode: ua.MonitoringMode
    source: str = ""
    handle: int = 0
    queue: list[ua.DataValue] | None = None
    """None where it would be empty."""
    _last: ua.DataValue | None = None
    _held: ua.DataValue | None = None
    _due: float = -math.inf
    _released: int = 0
    """Number of the oldest in the queue that a triggering item has reported."""
    lost: int = 0
    """Number of values that a full queue has lost and nobody has counted yet."""

    @property
    def share(self) -> Hashable:
        """Key under which it is counted."""
        return self.source, self.node, self.attribute

    @property
    def has_something(self) -> bool:
        return self.queue is not None

    @property
    def has_report(self) -> bool:
        """Whether the next in the queue is to be told."""
        return self._released > 0 or (self.mode == Monitoring.Reporting and self.queue is not None)

    @property
    def is_holding(self) -> bool:
        """Whether a value waits for the next sample."""
        return self._held is not None

    def change(self, value: ua.DataValue, now: float) -> bool:
        """The attribute may have changed; whether something is queued. Between two samples the newest value
        waits for the next."""
        if self.mode == Monitoring.Disabled:
            return False
        is_queued = False
        if self._held is not None and now - self._due > 2 * _HALF_GRID_S:
            # Nobody has looked since: what was there when the sample was due is told, too.
            is_queued = self.sample(self._due + _HALF_GRID_S)
        self._held = value
        return self.sample(now) or is_queued

    def sample(self, now: float) -> bool:
        """Whether something is queued."""
        held = self._held
        if held is None or now < self._due:
            return False
        self._held = None
        if self.settings.sampling_ms > LEAST_SAMPLING_MS:
            # Half the time between two looks early is not too early.
            self._due = now + self.settings.sampling_ms / 1000 - _HALF_GRID_S
        value = self.window.part(held)
        if not self.filter.reports(self._last, value):
            return False
        self._last = value
        self._append(value)
        return True

    def _append(self, value: ua.DataValue) -> None:
        queue, size = self.queue, self.settings.queue_size
        if queue is None:
            self.queue = [value]
            return
        if len(queue) < size:
            queue.append(value)
            return
        # With a queue of one, what is replaced is not lost (Part 4 §5.13.1.5).
        self.lost += size > 1
        if size == 1:
            queue[0] = value
        elif self.settings.discard_oldest:
            self._pop(queue)
            queue.append(value)
            queue[0] = _overflown(queue[0])
        else:
            queue[-1] = _overflown(value)

    def _pop(self, queue: list[ua.DataValue]) -> ua.DataValue:
        self._released = max(0, self._released - 1)
        return queue.pop(0)

    def release(self) -> None:
        """A triggering item has triggered: what is queued is told once."""
        if self.mode == Monitoring.Sampling:
            self._released = len(self.queue or ())

    def repeat(self) -> None:
        """Have something to tell: what is queued, or what was told last."""
        if self.queue is None and self._last is not None and self.mode != Monitoring.Disabled:
            self.queue = [self._last]

    def set_mode(self, mode: ua.MonitoringMode) -> None:
        if Monitoring.Disabled in (mode, self.mode):
            self.queue = self._last = self._held = None
            self._due = -math.inf
        self._released = 0
        self.mode = mode

    def modify(self, settings: ItemSettings, filter_: ChangeFilter, window: Window) -> None:
        queue = self.queue or []
        lost = len(queue) - settings.queue_size
        self.settings, self.filter, self.window = settings, filter_, window
        self._due = -math.inf
        if lost <= 0:
            return
        kept = queue[lost:] if settings.discard_oldest else queue[:-lost]
        if len(kept) > 1:
            place = 0 if settings.discard_oldest else -1
            kept[place] = _overflown(kept[place])
        self.queue = kept
        gone = lost if settings.discard_oldest else 0
        self._released = min(max(0, self._released - gone), len(kept))

    def take(self) -> ua.DataValue:
        """The next in the queue, which is taken off it. Raises IndexError where there is none."""
        queue = self.queue or []
        value = self._pop(queue)
        if not queue:
            self.queue = None
        return self.window.timed(value)


def _overflown(value: ua.DataValue) -> ua.DataValue:
    """A copy that says that others before or after it were lost; the value may be somebody else's, too."""
    code = status((value.StatusCode.value if value.StatusCode else 0) | _OVERFLOW)
    return data_value(value.Value, code, value.SourceTimestamp, value.ServerTimestamp)


@dataclass(slots=True, eq=False)
class EventItem:
    """Listens to the events of one node. ``share`` is whom it is counted for."""

    number: int
    node: ua.NodeId
    settings: ItemSettings
    filter: EventFilter
    mode: ua.MonitoringMode
    share: str = ""
    queue: deque[list[ua.Variant]] = field(default_factory=deque["list[ua.Variant]"])
    _loss: list[ua.Variant] | None = None
    """The event that says that others were lost. It is kept in addition to the queue's size."""
    _released: int = 0
    """Number of the oldest, the loss included, that a triggering item has reported."""
    lost: int = 0
    """Number of events that a full queue has lost and nobody has counted yet."""

    @property
    def weight(self) -> int:
        return event_weight(self.settings, self.filter)

    @property
    def has_something(self) -> bool:
        return bool(self.queue) or self._loss is not None

    @property
    def is_full(self) -> bool:
        """The next event would cost another one."""
        return len(self.queue) >= self.settings.queue_size

    @property
    def has_report(self) -> bool:
        """Whether the next in the queue is to be told."""
        return self._released > 0 or (self.mode == Monitoring.Reporting and self.has_something)

    @property
    def _count(self) -> int:
        return len(self.queue) + (self._loss is not None)

    def hear(self, event: Occurrence) -> bool:
        """Whether the event is queued."""
        if self.mode == Monitoring.Disabled or event.emitter != self.node or not self.filter.passes(event):
            return False
        self._shorten(self.settings.queue_size - 1)
        self.queue.append(self.filter.fields(event))
        return True

    def _shorten(self, size: int) -> None:
        while len(self.queue) > size:
            self.lost += 1
            if self.settings.discard_oldest:
                self.queue.popleft()
                # A loss takes the place of the first that is lost.
                if self._loss is not None and self._released > 1:
                    self._released -= 1
            else:
                self.queue.pop()
            if self._loss is None:
                self._loss = self.filter.fields(_loss(self.node))
        self._released = min(self._released, self._count)

    def release(self) -> None:
        """A triggering item has triggered: what is queued is told once."""
        if self.mode == Monitoring.Sampling:
            self._released = self._count

    def set_mode(self, mode: ua.MonitoringMode) -> None:
        if mode == Monitoring.Disabled:
            self.queue.clear()
            self._loss = None
        self._released = 0
        self.mode = mode

    def modify(self, settings: ItemSettings, filter_: EventFilter) -> None:
        self.settings, self.filter = settings, filter_
        self._shorten(settings.queue_size)

    def notification(self) -> ua.EventFieldList:
        """The next to tell. A loss comes before what was kept, or behind it where the newest had to go."""
        self._released = max(0, self._released - 1)
        if self._loss is not None and (self.settings.discard_oldest or not self.queue):
            fields, self._loss = self._loss, None
        else:
            fields = self.queue.popleft()
        return make(ua.EventFieldList, ClientHandle=self.settings.client_handle, EventFields=fields)


Item = ValueItem | EventItem


def _loss(emitter: ua.NodeId) -> Occurrence:
    """The event that says that others were lost (Part 5 §6.4.34)."""
    said = "events were lost: the queue was full"
    fields = system_event(ObjectIds.EventQueueOverflowEventType, "Internal/EventQueueOverflow", said)
    return Occurrence(emitter, fields)


def system_event(kind: int, source: str, said: str) -> Fields:
    """Fields of an event of the server about what it tells."""
    now = variant(datetime.now(UTC), ua.VariantType.DateTime)
    return {
        "EventId": variant(uuid.uuid4().bytes, ua.VariantType.ByteString),
        "EventType": variant(node_id(kind), ua.VariantType.NodeId),
        "SourceNode": variant(node_id(ObjectIds.Server), ua.VariantType.NodeId),
        "SourceName": variant(source, ua.VariantType.String),
        "Time": now,
        "ReceiveTime": now,
        "Message": variant(text(said), ua.VariantType.LocalizedText),
        "Severity": variant(100, ua.VariantType.UInt16),
    }
