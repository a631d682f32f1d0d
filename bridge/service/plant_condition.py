"""Condition of the plant, as points and events of the bus process: judged twice a second, in portions."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Final

from bridge.command import Event, EventKind, Plant
from bridge.condition.causes import TroubleLine
from bridge.condition.own_faults import with_faults
from bridge.condition.plant_layout import layout_of
from bridge.condition.point_troubles import Rank, Trouble
from bridge.condition.told import condition, recent_json, troubles_json
from bridge.condition.troubles import Troubles
from bridge.text import Said, Text

LOOK_EVERY_S: Final = 0.5
_PORTION: Final = 20
"""Buses and drives that are judged in one go: about 0.1 ms."""
_NO_NEWS: Final = 500
"""Severity below which events report that something is over, or was done."""
_UNPROVEN: Final = "stop_unproven"
_NOTICED: Final = {
    EventKind.NODE_LOST: "node_lost",
    EventKind.WATCHDOG: "controller_silent",
    EventKind.FRONT: "fronts_failing",
}
"""Kind of trouble that an event is about."""


class PlantCondition:
    """Keeps ``bridge/troubles`` and its like up to date, and gives events their cause.

    ``clock`` is monotonic, ``epoch_ns`` the time of day at one of its times."""

    def __init__(
        self,
        plant: Plant,
        clock: Callable[[], float],
        epoch_ns: Callable[[float], int],
    ) -> None:
        self._plant = plant
        self._clock = clock
        self._epoch_ns = epoch_ns
        layout = with_faults(layout_of(plant.image.points, plant.catalogue), plant.catalogue)
        self.troubles = Troubles(plant.image, layout, clock() * 1000)
        self._conditions = {"bridge/condition": ""}
        self._conditions |= {f"bus/{bus}/condition": f"bus/{bus}" for bus in layout.buses}
        self._conditions |= {f"{node}/node/condition": node for node in layout.nodes}
        self._told_causes: set[tuple[str, str, float]] = set()
        plant.because = self.because

    async def run(self) -> None:
        """Judge the plant again and again, until cancelled."""
        while True:
            now = self._clock()
            for number, _ in enumerate(self.troubles.look(now * 1000, self._epoch_ns(now) / 1e6)):
                if number % _PORTION == _PORTION - 1:
                    await asyncio.sleep(0)
            self.show(now)
            await asyncio.sleep(LOOK_EVERY_S)

    def look(self) -> None:
        """Judge everything once."""
        now = self._clock()
        self.troubles.beat(now * 1000, self._epoch_ns(now) / 1e6)
        self.show(now)

    def show(self, now: float) -> None:
        """Bring the points up to date, and tell causes that have been found."""
        troubles, plant = self.troubles, self._plant
        ranks = troubles.ranks
        for name, place in self._conditions.items():
            plant.set(name, condition(ranks.get(place)), now)
        plant.set("bridge/troubles", troubles_json(troubles.shown), now)
        plant.set("bridge/recent_troubles", recent_json(troubles.recent), now)
        plant.set("bridge/drives_waiting", troubles.waiting, now)
        everything = [one.trouble for one in troubles.shown]
        everything += [known.trouble for one in troubles.shown for known in one.explains]
        unproven = sorted(one.place for one in everything if one.kind == _UNPROVEN)
        plant.set("bridge/stops_unproven", ", ".join(unproven), now)
        self._tell_causes(troubles.shown, now)

    def _tell_causes(self, shown: list[TroubleLine], now: float) -> None:
        """Report causes that no single event tells, each once, as soon as it is found."""
        present: set[tuple[str, str, float]] = set()
        for one in shown:
            said = _said(one.trouble)
            if not said:
                continue
            found = (*one.key, one.since_ms)
            present.add(found)
            if found not in self._told_causes and one.until_ms is None:
                source = one.trouble.place.removeprefix("bus/")
                severity = 900 if one.rank is not Rank.WARNING else 500
                self._plant.report(Event(now, EventKind.CAUSE, source, severity, said))
        self._told_causes = present

    def because(self, event: Event) -> Said:
        """Cause of an event as a phrase; empty where none is known."""
        kind = _NOTICED.get(event.kind)
        if kind is None or event.source == "bridge" or event.severity < _NO_NEWS:
            return ""
        cause = self.troubles.cause_of(Trouble(Rank.ALARM, kind, event.source), self._clock() * 1000)
        if cause is None:
            return ""
        kind = Text.word("trouble", cause.kind)
        return _said(cause) or Text.of("cause.at_place", kind=kind, place=cause.place)


def _said(trouble: Trouble) -> Text | None:
    """Sentence on a cause that several troubles have in common; None for others."""
    facts = {name: fact for name, fact in trouble.facts if not isinstance(fact, Text)}
    match trouble.kind:
        case "bus_silent":
            bus = trouble.place.removeprefix("bus/")
            return Text.of("cause.bus_silent", bus=bus)
        case "controllers_silent":
            return Text.of("cause.controllers_silent", owner=str(facts["owner"]), drives=int(facts["drives"]))
        case "box_slow":
            return Text.of("cause.box_slow", ms=int(facts["ms"]))
        case _:
            return None
