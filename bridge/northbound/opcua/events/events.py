"""Events of the plant as OPC UA events, from the Server object and from the object they are about."""

from __future__ import annotations

import asyncio
import uuid
from collections import Counter, deque
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from typing import Final

import msgspec

from bridge.base.guard import Guard
from bridge.base.ratelimit import RateLimit
from bridge.command import Event, EventKind
from bridge.northbound.opcua.events.event_keeper import EventKeeper
from bridge.northbound.opcua.space.data_values import source_time
from bridge.northbound.opcua.space.notifiers import Notifiers
from bridge.text import LANGUAGES, Text, Words, as_json, render
from bridge.uaserver.filters.eventfilter import Occurrence
from bridge.uaserver.filters.where import own_name
from bridge.uaserver.languages import Spoken
from bridge.uaserver.library import ua, variant
from bridge.uaserver.subscriptions.subscriptions import Subscriptions

_BURST: Final = 20
_EVERY_S: Final = 0.1
"""Limit of each kind of event: a burst of ``_BURST``, then one in ``_EVERY_S`` seconds. Each kind has its
own, so that writes that are refused all day hide no watchdog trip."""
_WAITING: Final = 200


_TYPED: Final = {"User": "who", "PreviousOwner": "whom"}
"""Facts of a text that have fields of their own."""
_encode = msgspec.json.Encoder().encode


def in_all_languages(said: Words) -> Spoken:
    return Spoken({language: render(said, language) for language in LANGUAGES})


def _message(event: Event, held_back: int) -> Words:
    message = event.said
    if event.because:
        message = Text.of("event.because", message=message, cause=event.because)
    return Text.of("event.left_out", message=message, count=held_back) if held_back else message


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
        self._keeper = keeper
        self._types = types
        self._namespace = next(iter(types.values())).NamespaceIndex
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
        kinds = ua.VariantType
        fields = {
            "EventId": variant(uuid.uuid4().bytes, kinds.ByteString),
            "EventType": variant(self._types[event.kind], kinds.NodeId),
            "SourceNode": variant(self._notifiers.source(event.source), kinds.NodeId),
            "SourceName": variant(event.source, kinds.String),
            "Time": variant(source_time(self._epoch_ns(event.time)), kinds.DateTime),
            "ReceiveTime": variant(datetime.now(UTC), kinds.DateTime),
            "Message": variant(in_all_languages(_message(event, held_back)), kinds.LocalizedText),
            "Severity": variant(event.severity, kinds.UInt16),
            **self._own_fields(event),
        }
        if self._keeper:
            self._keeper.keep(fields)
        for emitter in self._notifiers.emitters(event.source):
            for subscription in list(self._subscriptions.subscriptions.values()):
                if subscription.is_listening:
                    # Each client brings its own filter.
                    with self._guard:
                        subscription.hear(Occurrence(emitter, fields))
                    await asyncio.sleep(0)

    def _own_fields(self, event: Event) -> dict[str, ua.Variant]:
        """Fields of ``DriveEventType``, as far as this event has them."""
        kinds, facts = ua.VariantType, dict(event.said.facts) if isinstance(event.said, Text) else {}
        told = as_json(event.said) or {}
        found: dict[str, ua.Variant] = {}
        if told:
            found["Code"] = variant(told["code"], kinds.String)
            found["Facts"] = variant(_encode(told["facts"]).decode(), kinds.String)
        if event.because:
            found["Cause"] = variant(in_all_languages(event.because), kinds.LocalizedText)
        for name, fact in _TYPED.items():
            if isinstance(facts.get(fact), str):
                found[name] = variant(facts[fact], kinds.String)
        number = facts.get("number")
        if event.kind is EventKind.EMERGENCY and isinstance(number, int):
            found["EmergencyCode"] = variant(number, kinds.UInt16)
        return {own_name(name, self._namespace): value for name, value in found.items()}
