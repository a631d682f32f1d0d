"""Events of the plant as they are told to clients; no server."""

from __future__ import annotations

import asyncio
from types import SimpleNamespace
from typing import cast

from asyncua import ua

from bridge.command import Event, EventKind
from bridge.northbound.opcua.event_keeper import EventKeeper
from bridge.northbound.opcua.event_records import Fields
from bridge.northbound.opcua.events import EventSender
from bridge.northbound.opcua.notifiers import Notifiers
from bridge.text import Text
from bridge.uaserver.eventfilter import Occurrence
from bridge.uaserver.languages import speaking
from bridge.uaserver.subscriptions import Subscriptions


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


class Keeper:
    def __init__(self) -> None:
        self.kept: list[tuple[int, str, Fields]] = []

    def keep(self, time_us: int, source: str, fields: Fields) -> None:
        self.kept.append((time_us, source, fields))


def test_events_are_kept_in_all_languages_though_nobody_listens() -> None:
    keeper = Keeper()
    sender = EventSender(
        lambda at: round(at * 1e9),
        cast("Subscriptions", SimpleNamespace(subscriptions={})),
        Notifiers({"bridge": ua.NodeId("bridge", 1), "pump": ua.NodeId("pump", 1)}),
        {EventKind.NODE_LOST: ua.NodeId("NodeLostEventType", 1)},
        cast("EventKeeper", keeper),
    )
    why = Text.of("node.restarted")
    sender.on_event(Event(5.000_001, EventKind.NODE_LOST, "pump", 800, Text.of("node.lost"), why))
    asyncio.run(sender.send_waiting())
    ((time_us, source, fields),) = keeper.kept
    assert (time_us, source) == (5_000_001, "pump")
    assert fields["SourceNode"].Value == ua.NodeId("pump", 1)
    message = fields["Message"].Value
    for language, expected in (("en", "node lost (because: "), ("de", "Knoten nicht erreichbar (wegen: ")):
        with speaking([language]):
            assert message.Text.startswith(expected)
