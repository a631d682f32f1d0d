"""Present troubles of the plant, the worst first, each with its place, its beginning, and those that it
explains. Sans-IO.

A trouble is a kind, a place and what its text needs; whoever tells people has the texts. Causes come first:
what follows from another trouble stands below it (``causes.py``).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Final

from bridge.condition.causes import Causes, Key, Known, TroubleLine
from bridge.condition.plant_layout import PlantLayout
from bridge.condition.point_troubles import (
    DOWN,
    ImageReader,
    Rank,
    Trouble,
    of_bridge,
    of_bus,
    of_drive,
    of_meaning,
    of_node,
    silence_of,
)
from bridge.condition.recent import Recent
from bridge.image import Image, Quality

BOOTING_MS: Final = 10_000.0
"""A node may boot for this long before it is a trouble."""
_BEGINNING_MS: Final = 4000.0
"""Time in ms after start in which a trouble that is found may have begun before it."""
_FOUND_MS: Final = 3000.0
"""Time in ms after start before a node counts as absent."""
RECENT_MS: Final = 600_000.0
"""Time in ms for which a short event is shown after it has happened last."""
_SLOW_SHOWN_MS: Final = 3000.0
"""Time in ms for which a standstill of this box is shown by itself, and new troubles are taken for its
consequences: later ones have another reason."""
_AT_ONCE_MS: Final = 5000.0
"""Drives of one controller that trip within this time have it in common."""


class Troubles:
    """Looks at the image as often as it is asked. ``now_ms`` is monotonic, ``epoch_ms`` the time of day."""

    def __init__(self, image: Image, layout: PlantLayout, now_ms: float) -> None:
        self._reader = ImageReader(image)
        self._layout = layout
        self._began_ms = now_ms
        self._known: dict[Key, Known] = {}
        self._began: dict[Key, float] = {}
        """Beginnings of what is a trouble only after a while."""
        self._counts: dict[str, tuple[int, float]] = {}
        """Counters, and when they rose last."""
        self._owners: dict[str, str] = {}
        """Latest owner of each drive."""
        self._waiting: list[str] = []
        self._causes = Causes(layout)
        self._recent = Recent()
        self._nodes_of = {
            bus: [node for node, its_bus in layout.nodes.items() if its_bus == bus] for bus in layout.buses
        }
        self.shown: list[TroubleLine] = []
        """Present troubles, the worst first."""
        self.recent = self._recent.shown
        """Troubles that are over, the latest first."""

    @property
    def waiting(self) -> int:
        """Number of drives that have not reported their state yet though nothing is wrong with them: they
        start up."""
        return len(self._waiting)

    def beat(self, now_ms: float, epoch_ms: float) -> None:
        """Look again, at everything at once."""
        for _ in self.look(now_ms, epoch_ms):
            pass

    def look(self, now_ms: float, epoch_ms: float) -> Iterator[None]:
        """Look again, in portions: a large plant must not hold up the bus. What is shown changes at the
        end."""
        found: list[Trouble] = []
        self._waiting = []
        for bus in self._layout.buses:
            found += self._of_bus(bus, now_ms)
            yield
        for drive, node in self._layout.drives.items():
            found += self._of_drive(drive, node)
            yield
        found += of_bridge(self._reader)
        found += self._of_log(now_ms)
        found += self._of_standstill(now_ms)
        known = [self._known_as(one, now_ms, epoch_ms) for one in found]
        known += [self._known_as(one, now_ms, epoch_ms) for one in self._silent_controllers(known)]
        self._known = {one.key: one for one in known}
        troubled = {above for one in known for above in self._places_of(one)}
        self._waiting = [drive for drive in self._waiting if drive not in troubled]
        self.shown = self._causes.fold(known, now_ms, epoch_ms)
        explained = {one.key for shown in self.shown for one in shown.explains}
        self._recent.see(self.shown, explained, now_ms, epoch_ms)
        self.recent = self._recent.shown

    def cause_of(self, trouble: Trouble, now_ms: float) -> Trouble | None:
        """Cause of a trouble that was noticed just now; None where none is known."""
        known = Known(trouble, now_ms, 0.0, self._owners.get(trouble.place, ""))
        cause = self._causes.of(known, now_ms)
        return cause.trouble if cause else None

    @property
    def ranks(self) -> dict[str, Rank]:
        """The worst at each place and below it, consequences included; ``""`` is everything. A place without
        trouble is left out. The one rule for bus, node and site: a whole is as bad as its worst part."""
        ranks: dict[str, Rank] = {}
        everything = [(one.trouble, one.rank) for one in self.shown]
        everything += [(known.trouble, known.trouble.rank) for one in self.shown for known in one.explains]
        for trouble, rank in everything:
            for place in ("", *self._layout.above(trouble.place)):
                ranks[place] = min(rank, ranks.get(place, rank))
        return ranks

    def _places_of(self, known: Known) -> Iterator[str]:
        """A drive is not merely waiting where it, its node or its bus has a trouble that keeps it."""
        place = known.trouble.place
        yield place
        if place in self._layout.nodes or known.trouble.kind in ("bus_off", "bus_down", "bus_silent"):
            yield from (drive for drive in self._layout.drives if place in self._layout.above(drive))

    def _known_as(self, trouble: Trouble, now_ms: float, epoch_ms: float) -> Known:
        key = trouble.kind, trouble.place
        owner = str(dict(trouble.facts).get("owner", "")) or self._owners.get(trouble.place, "")
        before = self._known.get(key)
        if before is not None:
            since = before.since_ms, before.since_epoch_ms
            return Known(trouble, *since, owner, is_or_longer=before.is_or_longer)
        since_ms = min(self._began.get(key, now_ms), now_ms)
        since_epoch_ms = epoch_ms - (now_ms - since_ms)
        is_or_longer = since_ms - self._began_ms < _BEGINNING_MS
        return Known(trouble, since_ms, since_epoch_ms, owner, is_or_longer=is_or_longer)

    def _has_risen(
        self, name: str, now_ms: float, *, for_ms: float = RECENT_MS, is_news_at_first: bool = False
    ) -> bool:
        """Whether the counter ``name`` rose lately; with ``is_news_at_first`` what it had when the bridge
        began counts as well."""
        count = self._reader(name)
        if not isinstance(count, int):
            return False
        at_first = 0 if is_news_at_first else count
        before, risen_ms = self._counts.get(name, (at_first, float("-inf")))
        if count > before:
            risen_ms = now_ms
        self._counts[name] = count, risen_ms
        return now_ms - risen_ms < for_ms

    def _of_bus(self, bus: str, now_ms: float) -> Iterator[Trouble]:
        reader, nodes = self._reader, self._nodes_of[bus]
        is_down = reader.label(f"bus/{bus}/state") in DOWN
        yield from of_bus(reader, bus, is_down=is_down)
        if self._has_risen(f"bus/{bus}/intruders", now_ms):
            who = reader.words(f"bus/{bus}/last_intruder")
            yield Trouble(Rank.ALARM, "intruder", f"bus/{bus}", (("who", who),))
        is_looking = now_ms - self._began_ms < _FOUND_MS
        if not is_down and not is_looking and not reader(f"bus/{bus}/passive"):
            yield from silence_of(reader, bus, nodes)
        for node in nodes:
            if not is_looking or reader.label(f"{node}/node/state") != "absent":
                yield from of_node(reader, node)
            yield from self._of_booting(node, bus, now_ms)

    def _of_booting(self, node: str, bus: str, now_ms: float) -> Iterator[Trouble]:
        """Its time runs only while it may boot: neither before mandatory nodes, nor under another bridge."""
        reader, key = self._reader, ("node_booting", node)
        may_boot = not reader(f"bus/{bus}/held_by") and not reader(f"bus/{bus}/passive")
        if reader.label(f"{node}/node/state") != "booting" or not may_boot:
            self._began.pop(key, None)
            return
        if now_ms - self._began.setdefault(key, now_ms) >= BOOTING_MS:
            why = reader.words(f"{node}/node/boot_status")
            yield Trouble(Rank.WARNING, "node_booting", node, (("why", why),))

    def _of_drive(self, drive: str, node: str) -> Iterator[Trouble]:
        reader, layout = self._reader, self._layout
        bus = layout.nodes[node]
        if owner := reader(f"{drive}/supervision/owner"):
            self._owners[drive] = str(owner)
        of_bus = layout.bus_faults.get(drive, frozenset())
        found = list(of_drive(reader, drive, layout.own_faults.get(drive), of_bus))
        main = layout.mains.get(drive)
        if main is not None and reader.label(f"{node}/node/state") == "operational":
            found += of_meaning(reader, drive, main)
        yield from found
        if not found and self._is_waiting(drive, bus):
            self._waiting.append(drive)

    def _is_waiting(self, drive: str, bus: str) -> bool:
        quality, _ = self._reader.quality(f"{drive}/status/state")
        return quality is not Quality.GOOD and not self._reader(f"bus/{bus}/held_by")

    def _silent_controllers(self, found: Iterable[Known]) -> Iterator[Trouble]:
        """One controller with several drives that have tripped together."""
        by_owner: dict[str, list[Known]] = {}
        for one in found:
            if one.trouble.kind == "controller_silent" and one.owner:
                by_owner.setdefault(one.owner, []).append(one)
        for owner, tripped in by_owner.items():
            latest_ms = max(one.since_ms for one in tripped)
            together = [one for one in tripped if one.since_ms >= latest_ms - _AT_ONCE_MS]
            if len(together) > 1:
                place = together[0].trouble.place
                facts = (("owner", owner), ("drives", len(together)))
                self._began["controllers_silent", place] = min(one.since_ms for one in together)
                yield Trouble(Rank.ALARM, "controllers_silent", place, facts)

    def _of_log(self, now_ms: float) -> Iterator[Trouble]:
        # A disk that is full already when the service starts is as bad.
        if self._has_risen("bridge/audit_lost", now_ms, is_news_at_first=True):
            lines = self._reader("bridge/audit_lost") or 0
            yield Trouble(Rank.WARNING, "log_lost", "bridge", (("lines", lines),))

    def _of_standstill(self, now_ms: float) -> Iterator[Trouble]:
        if self._has_risen("bridge/hangs", now_ms, for_ms=_SLOW_SHOWN_MS):
            ms = self._reader("bridge/last_hang_ms") or 0
            self._began["box_slow", "bridge"] = now_ms - float(ms)
            yield Trouble(Rank.WARNING, "box_slow", "bridge", (("ms", ms),))
