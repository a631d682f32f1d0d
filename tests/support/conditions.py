"""Conditions of a server without one: a subscription that keeps what it hears, and a clock by hand."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

from asyncua import ua

from bridge.uaserver.conditions.condition_fields import (
    AlarmContent,
    ConditionPlace,
    ConditionWords,
    common_fields,
)
from bridge.uaserver.conditions.conditions import Condition, Conditions
from bridge.uaserver.filters.eventfilter import EventFilter
from bridge.uaserver.filters.where import Where
from bridge.uaserver.library import StatusCodes, text
from bridge.uaserver.subscriptions.items import EventItem, ItemSettings
from bridge.uaserver.subscriptions.subscription import Subscription, Terms
from bridge.uaserver.subscriptions.subscriptions import Subscriptions
from tests.support.opcua_sessions import Session, User

Ids = ua.ObjectIds
SERVER = ua.NodeId(Ids.Server)
NAMES = ("", "EventType", "Message", "Retain", "ActiveState/Id", "AckedState/Id", "EventId")
ACKNOWLEDGE = ua.NodeId(Ids.AcknowledgeableConditionType_Acknowledge)
CONFIRM = ua.NodeId(Ids.AcknowledgeableConditionType_Confirm)
DISABLE = ua.NodeId(Ids.ConditionType_Disable)
REFRESH = ua.NodeId(Ids.ConditionType_ConditionRefresh)
REFRESH_ITEM = ua.NodeId(Ids.ConditionType_ConditionRefresh2)


class Owner:
    """Whose the conditions are. ``answer`` is what an acknowledgement comes to there."""

    def __init__(self) -> None:
        self.answer: int = StatusCodes.Good
        self.calls: list[tuple[str, str, int]] = []
        self.forbidden: set[str] = set()

    def permits(self, user: User, method: str) -> bool:
        return method not in self.forbidden

    async def acknowledging(self, user: User, condition: ua.NodeId) -> int:
        return self.answer

    def on_call(self, user: User, condition: ua.NodeId, method: str, code: int) -> None:
        self.calls.append((user.name, method, code))


class ConditionBench:
    """Conditions, and one subscription with an item at the Server object."""

    def __init__(self, queue: int = 200) -> None:
        self.now_ms = 1_000_000.0
        self.owner = Owner()
        self.session = Session()
        self.subscription = Subscription(7, self.session, Terms(100, 30, 10, 1000, 0), enabled=True)
        self.item = self.listen(SERVER, 1, queue)
        subscriptions = SimpleNamespace(subscriptions={7: self.subscription})
        words = ConditionWords(text)
        self.conditions = Conditions(
            cast("Subscriptions", subscriptions), self.owner, words, lambda: self.now_ms
        )

    def listen(self, node: ua.NodeId, number: int, queue: int = 200) -> EventItem:
        settings = ItemSettings(number, 0.0, queue, True)
        item = EventItem(
            number, node, settings, EventFilter(NAMES, Where([]), None), ua.MonitoringMode.Reporting
        )
        self.subscription.add(item)
        return item

    def add(self, name: str = "c") -> Condition:
        source = ua.NodeId(name, 2)
        kind = ua.NodeId(Ids.AlarmConditionType)
        common = common_fields(kind, "Alarm", Ids.ProcessConditionClassType, text("process"), {})
        place = ConditionPlace(ua.NodeId(f"{name}/Alarm", 2), source, name, (SERVER, source), common)
        made = Condition(place)
        self.conditions.add(made)
        return made

    def raise_(self, condition: Condition, said: str = "hot", severity: int = 700) -> None:
        self.conditions.raised(condition, AlarmContent(text(said), severity), anew=True)

    async def told(self, item: EventItem | None = None) -> list[dict[str, Any]]:
        """Fields of the events that have come since the last call."""
        await self.conditions.send_waiting()
        queue = (item or self.item).queue
        told = [{name: one.Value for name, one in zip(NAMES, fields, strict=True)} for fields in queue]
        queue.clear()
        return told

    async def call(self, where: ua.NodeId, method: ua.NodeId, *given: ua.Variant) -> int:
        request = ua.CallMethodRequest(where, method, list(given))
        result = await self.conditions.call(self.session, request)
        return result.StatusCode.value

    async def refresh(self, item: int | None = None) -> int:
        numbers = [7] if item is None else [7, item]
        given = [ua.Variant(number, ua.VariantType.UInt32) for number in numbers]
        method = REFRESH if item is None else REFRESH_ITEM
        return await self.call(ua.NodeId(Ids.ConditionType), method, *given)


def about(event_id: bytes, comment: str = "") -> tuple[ua.Variant, ua.Variant]:
    said = ua.LocalizedText(comment, "de") if comment else ua.LocalizedText()
    return ua.Variant(event_id, ua.VariantType.ByteString), ua.Variant(said, ua.VariantType.LocalizedText)
