"""Alarms of the OPC UA server: troubles that a plant tells, and a client that follows the alarms."""

from __future__ import annotations

import asyncio
import json
import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Any

from asyncua import Client, ua
from asyncua.common.subscription import Subscription

from bridge.command import Plant
from bridge.uaserver.conditions.condition_fields import ConditionPlace, common_fields
from bridge.uaserver.conditions.conditions import Condition, Conditions
from tests.support import sites
from tests.support.opcua_site import LocalView, namespace

Ids = ua.ObjectIds
METHODS = {
    "Enable": Ids.ConditionType_Enable,
    "Disable": Ids.ConditionType_Disable,
    "AddComment": Ids.ConditionType_AddComment,
    "Acknowledge": Ids.AcknowledgeableConditionType_Acknowledge,
    "Confirm": Ids.AcknowledgeableConditionType_Confirm,
    "TimedShelve": Ids.ShelvedStateMachineType_TimedShelve,
    "OneShotShelve": Ids.ShelvedStateMachineType_OneShotShelve,
    "Unshelve": Ids.ShelvedStateMachineType_Unshelve,
}
PATHS = (
    "EventId",
    "EventType",
    "SourceName",
    "Message",
    "Severity",
    "Retain",
    "ActiveState/Id",
    "AckedState",
    "AckedState/Id",
    "ConfirmedState/Id",
    "EnabledState/Id",
    "ShelvingState/CurrentState/Id",
    "Comment",
    "ClientUserId",
)
OWN = ("Code", "Facts", "Cause", "Remedy", "Explains", "Owner", "FaultNumber")
"""Fields of the bridge's own types, in its namespace."""


def trouble(kind: str, place: str, *, rank: str = "alarm", since: int = 1000, **facts: Any) -> dict[str, Any]:
    return {"rank": rank, "kind": kind, "place": place, "since": since, "facts": facts}


def many_drives() -> list[str]:
    """Drives of ``plant_of_many``."""
    return [f"n{node}/fu{number}" for node in range(1, 6) for number in range(1, 5)]


def plant_of_many() -> Plant:
    """Five nodes of four drives each, which OPC UA commands."""
    drives = [sites.drive(f"fu{number}", "opcua", 0) for number in range(1, 5)]
    nodes = [sites.node(*drives, name=f"n{node}", node_id=10 + node) for node in range(1, 6)]
    return sites.plant_of(sites.site(sites.bus(*nodes), sites.opcua()))


def cut_bus(*places: str) -> dict[str, Any]:
    """The bus is silent, which explains that nothing comes from ``places``."""
    lost = [trouble("node_lost", place, how="lost") for place in places]
    return trouble("bus_silent", "bus/can0", nodes=len(places)) | {"explains": lost}


def alarm_of(place: str) -> str:
    return f"{place}/Alarm"


def of(place: str) -> Callable[[dict[str, Any]], bool]:
    """Whether an event is one of the alarm at this place."""
    return lambda event: event[""] is not None and event[""].Identifier == alarm_of(place)


def is_active(event: dict[str, Any]) -> bool:
    return event["ActiveState/Id"] is True


def is_over(event: dict[str, Any]) -> bool:
    return event["ActiveState/Id"] is False


def tell(view: LocalView, *troubles: dict[str, Any]) -> None:
    """Have the bus process tell these troubles and no others."""
    now = time.monotonic()
    view.plant.set("bridge/troubles", json.dumps(troubles), now)
    view.plant.set("bridge/drives_waiting", 0, now)


def thousand(conditions: Conditions) -> list[Condition]:
    """More alarms than a site has drives, told by the Server object."""
    server = ua.NodeId(Ids.Server)
    kind, process = ua.NodeId(Ids.AlarmConditionType), ua.LocalizedText("process", "en")
    common = common_fields(kind, "Alarm", Ids.ProcessConditionClassType, process, {})
    names = [f"many/{number}" for number in range(1000)]
    made = [Condition(ConditionPlace(ua.NodeId(one, 2), server, one, (server,), common)) for one in names]
    for one in made:
        conditions.add(one)
    return made


class Follower:
    """A client that follows the alarms at one node. ``events`` are the fields of each event by their paths,
    the condition's NodeId by ""."""

    def __init__(self, client: Client, space: int) -> None:
        self.client = client
        self.space = space
        self.events: list[dict[str, Any]] = []
        self.subscription: Subscription
        self._names = ("", *PATHS, *OWN)
        self._more = asyncio.Event()

    async def begin(self, node: int | ua.NodeId, queue: int = 0, interval_ms: float = 50) -> None:
        self.subscription = await self.client.create_subscription(interval_ms, self)
        fields = [self._operand(path, 0) for path in PATHS] + [self._operand(one, self.space) for one in OWN]
        condition = ua.SimpleAttributeOperand(ua.NodeId(Ids.ConditionType), [], ua.AttributeIds.NodeId)
        wanted = ua.EventFilter([condition, *fields], ua.ContentFilter([]))
        where = node if isinstance(node, ua.NodeId) else ua.NodeId(node)
        self.item = await self.subscription.subscribe_events(where, evfilter=wanted, queuesize=queue)

    def _operand(self, path: str, space: int) -> ua.SimpleAttributeOperand:
        names = [ua.QualifiedName(name, space) for name in path.split("/")]
        return ua.SimpleAttributeOperand(ua.NodeId(Ids.BaseEventType), names, ua.AttributeIds.Value)

    def event_notification(self, event: Any) -> None:
        self.events.append({name: getattr(event, name or "NodeId", None) for name in self._names})
        self._more.set()

    async def until(self, *found: Callable[[dict[str, Any]], bool], seconds: float = 5) -> dict[str, Any]:
        """The first event of which all ``found`` are true, also of those that have come."""
        async with asyncio.timeout(seconds):
            while True:
                event = next((one for one in self.events if all(fits(one) for fits in found)), None)
                if event is not None:
                    return event
                await self.another()

    async def another(self) -> None:
        """Wait for the next event."""
        self._more.clear()
        await self._more.wait()

    async def call(self, alarm: str, method: str, *arguments: ua.Variant) -> int:
        request = ua.CallMethodRequest(
            ua.NodeId(alarm, self.space), ua.NodeId(METHODS[method]), list(arguments)
        )
        (result,) = await self.client.uaclient.call([request])
        return result.StatusCode.value

    async def refresh(self, item: int = 0, subscription: int = 0) -> int:
        number = ua.Variant(subscription or self.subscription.subscription_id, ua.VariantType.UInt32)
        items = [ua.Variant(item, ua.VariantType.UInt32)] if item else []
        method = Ids.ConditionType_ConditionRefresh2 if item else Ids.ConditionType_ConditionRefresh
        request = ua.CallMethodRequest(ua.NodeId(Ids.ConditionType), ua.NodeId(method), [number, *items])
        (result,) = await self.client.uaclient.call([request])
        return result.StatusCode.value


def event_and(comment: str, event: dict[str, Any], locale: str = "de") -> list[ua.Variant]:
    """Arguments of Acknowledge, Confirm and AddComment."""
    said = ua.LocalizedText(comment, locale)
    return [
        ua.Variant(event["EventId"], ua.VariantType.ByteString),
        ua.Variant(said, ua.VariantType.LocalizedText),
    ]


@asynccontextmanager
async def following(
    client: Client, node: int | ua.NodeId = Ids.Server, **how: Any
) -> AsyncIterator[Follower]:
    follower = Follower(client, await namespace(client))
    await follower.begin(node, **how)
    try:
        yield follower
    finally:
        await follower.subscription.delete()
