"""Events of the plant as they are told to clients; no server."""

from __future__ import annotations

import asyncio
import json
from types import SimpleNamespace
from typing import cast

from asyncua import ua

from bridge.command import Event, EventKind
from bridge.northbound.opcua.events.event_keeper import EventKeeper
from bridge.northbound.opcua.events.events import EventSender
from bridge.northbound.opcua.space.notifiers import Notifiers
from bridge.text import Text, render
from bridge.uaserver.filters.eventfilter import Occurrence
from bridge.uaserver.subscriptions.subscriptions import Subscriptions


def test_events_are_bounded_to_a_burst_and_a_rate() -> None:
    """And each kind has its own: who has writes refused all day hides no trip."""
    heard: list[str] = []

    class Listener:
        is_listening = True

        def hear(self, one: Occurrence) -> None:
            heard.append(one.fields["Message"].Value.Text)

    subscriptions = SimpleNamespace(subscriptions={1: Listener()})
    kinds = {kind: ua.NodeId(number, 1) for number, kind in enumerate(EventKind, 1)}
    sender = EventSender(
        lambda at: round(at * 1e9),
        cast("Subscriptions", subscriptions),
        Notifiers({"bridge": ua.NodeId("bridge", 1)}),
        kinds,
    )

    def told(now: float, kind: EventKind) -> list[str]:
        heard.clear()
        for _ in range(1000):
            sender.on_event(Event(now, kind, "bridge", 500, kind.value))
        asyncio.run(sender.send_waiting())
        return heard[::2]  # at the server, and at the bridge

    assert told(5.0, EventKind.REFUSED) == ["refused"] * 20
    assert told(5.0, EventKind.WATCHDOG) == ["watchdog"] * 20
    more = "refused (980 more like it before were left out)"
    assert told(5.5, EventKind.REFUSED) == [more] + ["refused"] * 4


async def fields_of(event: Event) -> dict[str, ua.Variant]:
    heard: list[Occurrence] = []
    listener = SimpleNamespace(is_listening=True, hear=heard.append)
    subscriptions = SimpleNamespace(subscriptions={1: listener})
    kinds = {kind: ua.NodeId(kind.value, 2) for kind in EventKind}
    notifiers = Notifiers({"bridge": ua.NodeId("bridge", 2)})
    sender = EventSender(lambda at: round(at * 1e9), cast("Subscriptions", subscriptions), notifiers, kinds)
    sender.on_event(event)
    await sender.send_waiting()
    return dict(heard[0].fields)


async def test_an_event_says_what_its_message_is_made_of() -> None:
    why = Text.of("owner.controls", who="opcua:anna")
    said = Text.of("owner.taken_away", who="opcua:eva", whom="modbus:10.0.0.7")
    fields = await fields_of(Event(1.0, EventKind.OWNER, "conveyor/fu1", 500, said, why))
    told = {name: fields[f"2:{name}"].Value for name in ("Code", "Facts", "User", "PreviousOwner")}
    assert json.loads(told.pop("Facts")) == {"who": "opcua:eva", "whom": "modbus:10.0.0.7"}
    assert told == {"Code": "owner.taken_away", "User": "opcua:eva", "PreviousOwner": "modbus:10.0.0.7"}
    assert fields["Message"].Value.words == {
        "en": "opcua:eva takes control away from modbus:10.0.0.7 (because: controlled by opcua:anna)",
        "de": f"{render(said, 'de')} (wegen: {render(why, 'de')})",
    }
    assert fields["2:Cause"].Value.words["de"] == render(why, "de")


async def test_an_emergency_has_its_code() -> None:
    said = Text.of("node.emergency", number=0x4310, text="overheated")
    fields = await fields_of(Event(1.0, EventKind.EMERGENCY, "conveyor/fu1", 700, said))
    assert fields["2:EmergencyCode"].Value == 0x4310
    assert "2:User" not in fields


def test_events_are_kept_though_nobody_listens() -> None:
    kept: list[dict[str, ua.Variant]] = []
    sender = EventSender(
        lambda at: round(at * 1e9),
        cast("Subscriptions", SimpleNamespace(subscriptions={})),
        Notifiers({"bridge": ua.NodeId("bridge", 1), "pump": ua.NodeId("pump", 1)}),
        {EventKind.NODE_LOST: ua.NodeId("NodeLostEventType", 1)},
        cast("EventKeeper", SimpleNamespace(keep=kept.append)),
    )
    sender.on_event(Event(5.0, EventKind.NODE_LOST, "pump", 800, Text.of("node.lost")))
    asyncio.run(sender.send_waiting())
    (fields,) = kept
    assert fields["SourceNode"].Value == ua.NodeId("pump", 1)
    assert fields["Message"].Value.words == {"en": "node lost", "de": "Knoten nicht erreichbar"}
