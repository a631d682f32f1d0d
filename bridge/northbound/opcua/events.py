"""Events of the plant as OPC UA events, from the Server object and from the object they are about."""

from __future__ import annotations

import asyncio
import uuid
from collections import Counter, deque
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from typing import Final

from bridge.base.guard import Guard
from bridge.base.ratelimit import RateLimit
from bridge.command import Event, EventKind
from bridge.northbound.opcua.data_values import epoch_us, source_time
from bridge.northbound.opcua.event_keeper import EventKeeper
from bridge.northbound.opcua.event_records import Fields
from bridge.northbound.opcua.nodes import pascal_case
from bridge.northbound.opcua.notifiers import Notifiers
from bridge.text import LANGUAGES, Said, Text, render
from bridge.uaserver.eventfilter import Occurrence
from bridge.uaserver.languages import Spoken
from bridge.uaserver.library import ua, variant
from bridge.uaserver.subscriptions import Subscriptions

BASE_TYPE: Final = "DriveEventType"
_BURST: Final = 20
_EVERY_S: Final = 0.1
"""Limit of each kind of event: a burst of ``_BURST``, then one in ``_EVERY_S`` seconds. Each kind has its
own, so that writes that are refused all day hide no watchdog trip."""
_WAITING: Final = 200


def type_name(kind: EventKind) -> str:
    return f"{pascal_case(kind.value)}EventType"


class EventSender:
    """Takes events from the plant at any time and sends them when the publisher has its turn."""

    def __init__(
        self,
        epoch_ns: Callable[[float], int],
        subscriptions: Subscriptions,
        notifiers: Notifiers,
        types: Mapping[EventKind, ua.NodeId],
        keeper: EventKeeper | None = None,
    ) -> None:
        self._epoch_ns = epoch_ns
        self._subscriptions = subscriptions
        self._notifiers = notifiers
        self._types = types
        self._keeper = keeper
        self._guard = Guard("OPC UA events")
        self._limits: dict[EventKind, RateLimit] = {}
        self._held_back = Counter[EventKind]()
        self._queue: deque[tuple[Event, int]] = deque(maxlen=_WAITING)

    def on_event(self, event: Event) -> None:
        if self._limits.setdefault(event.kind, RateLimit(_BURST, _EVERY_S)).allows(event.time):
            self._queue.append((event, self._held_back.pop(event.kind, 0)))
        else:
            self._held_back[event.kind] += 1

    async def send_waiting(self) -> None:
        while self._queue:
            event, held_back = self._queue.popleft()
            if self._keeper or self._subscriptions.subscriptions:
                await self._send(event, held_back)

    async def _send(self, event: Event, held_back: int) -> None:
        fields = self._fields(event, held_back)
        if self._keeper:
            self._keeper.keep(epoch_us(self._epoch_ns(event.time)), event.source, fields)
        for emitter in self._notifiers.emitters(event.source):
            for subscription in list(self._subscriptions.subscriptions.values()):
                if subscription.is_listening:
                    # Each client brings its own filter.
                    with self._guard:
                        subscription.hear(Occurrence(emitter, fields))
                    await asyncio.sleep(0)

    def _fields(self, event: Event, held_back: int) -> Fields:
        kinds = ua.VariantType
        return {
            "EventId": variant(uuid.uuid4().bytes, kinds.ByteString),
            "EventType": variant(self._types[event.kind], kinds.NodeId),
            "SourceNode": variant(self._notifiers.source(event.source), kinds.NodeId),
            "SourceName": variant(event.source, kinds.String),
            "Time": variant(source_time(self._epoch_ns(event.time)), kinds.DateTime),
            "ReceiveTime": variant(datetime.now(UTC), kinds.DateTime),
            "Message": variant(_message(event, held_back), kinds.LocalizedText),
            "Severity": variant(event.severity, kinds.UInt16),
        }


def _message(event: Event, held_back: int) -> ua.LocalizedText:
    """The message with its cause, in all languages."""
    said: Said = event.said
    if event.because:
        said = Text.of("event.because", message=said, cause=event.because)
    if held_back:
        said = Text.of("event.left_out", message=said, count=held_back)
    return Spoken({language: render(said, language) for language in LANGUAGES})
