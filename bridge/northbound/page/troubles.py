"""What is wrong on the plant at present, the worst first, each with what it is about and since when. Sans-IO.

A trouble is a kind, a place and what its text needs; the browser has the texts. What follows from another
trouble is left out: a bus that is down says more than each of its nodes being lost, and where the bus process
does not answer nothing is known at all.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from bridge.image import Image, Quality
from bridge.northbound.page.findings import (
    DOWN,
    Look,
    OwnFault,
    Rank,
    Trouble,
    is_bridge_dead,
    of_bridge,
    of_bus,
    of_drive,
    of_meaning,
    of_node,
)
from bridge.northbound.page.recent import Recent

BOOTING_MS: Final = 10_000.0
"""A node may boot for this long before it is a trouble."""
_BEGINNING_MS: Final = 2000.0
"""What is there so soon after the front has begun may have been there before."""
_RECENT_MS: Final = 600_000.0
"""How long something that happens, and then is over, is shown after it has happened last."""


@dataclass(frozen=True, slots=True)
class Layout:
    """Which drives are on which nodes, and these on which bus, by their names."""

    drives: Mapping[str, str]
    nodes: Mapping[str, str]
    buses: tuple[str, ...]
    mains: Mapping[str, str] = field(default_factory=dict[str, str])
    """What each drive is moved by, such as ``frequency``, as far as it has that."""
    own_faults: Mapping[str, OwnFault] = field(default_factory=dict[str, OwnFault])


class Troubles:
    """Looks at the image as often as it is asked. ``epoch_ms`` is the time of day."""

    def __init__(self, image: Image, layout: Layout, epoch_ms: Callable[[], float]) -> None:
        self._look = Look(image)
        self._layout = layout
        self._epoch_ms = epoch_ms
        self._began_ms = epoch_ms()
        self._since: dict[tuple[str, str], float] = {}
        self._counts: dict[str, tuple[int, float]] = {}
        """Counters, and when they rose last."""
        self._booting: dict[str, float] = {}
        """The nodes that boot, and since when."""
        self._shown: list[dict[str, Any]] = []
        self._waiting = 0
        self._recent = Recent()

    def beat(self) -> bool:
        """Look again; whether ``shown``, ``waiting`` or ``recent`` is another one now."""
        now_ms = self._epoch_ms()
        before = self._shown, self._waiting, self.recent
        troubles = sorted(self._find(now_ms), key=lambda one: one.rank)
        self._since = {
            (one.kind, one.place): self._since.get((one.kind, one.place), now_ms) for one in troubles
        }
        self._shown = [self._said(one) for one in troubles]
        self._recent.see(self._shown, now_ms)
        return (self._shown, self._waiting, self.recent) != before

    @property
    def shown(self) -> list[dict[str, Any]]:
        """For JSON: rank, kind, place, since in ms since 1970, what else its text needs; ``or_longer`` where
        it may have begun before this front did."""
        return self._shown

    @property
    def recent(self) -> list[dict[str, Any]]:
        """As ``Recent.shown``."""
        return self._recent.shown

    @property
    def waiting(self) -> int:
        """How many drives do not tell their state yet, though nothing is wrong with them: they start up."""
        return self._waiting

    def _said(self, trouble: Trouble) -> dict[str, Any]:
        since_ms = self._since[trouble.kind, trouble.place]
        said: dict[str, Any] = {
            "rank": trouble.rank.name.lower(),
            "kind": trouble.kind,
            "place": trouble.place,
            "since": round(since_ms),
            "facts": dict(trouble.facts),
        }
        return said | ({"or_longer": True} if since_ms - self._began_ms < _BEGINNING_MS else {})

    def _has_risen(self, name: str, now_ms: float, *, is_news_at_first: bool = False) -> bool:
        """Whether the counter ``name`` rose lately; with ``is_news_at_first`` what it had when the front
        began counts as well."""
        count = self._look(name)
        if not isinstance(count, int):
            return False
        at_first = 0 if is_news_at_first else count
        before, risen_ms = self._counts.get(name, (at_first, float("-inf")))
        if count > before:
            risen_ms = now_ms
        self._counts[name] = count, risen_ms
        return now_ms - risen_ms < _RECENT_MS

    def _find(self, now_ms: float) -> list[Trouble]:
        """All of them; counts the drives that are waiting."""
        look, layout = self._look, self._layout
        self._waiting = 0
        if is_bridge_dead(look):
            return [Trouble(Rank.ALARM, "bridge_dead", "bridge")]
        found: list[Trouble] = []
        down = {bus for bus in layout.buses if look.label(f"bus/{bus}/state") in DOWN}
        for bus in layout.buses:
            found += of_bus(look, bus, is_down=bus in down)
            found += self._of_intruders(bus, now_ms)
        gone: set[str] = set()
        for node, bus in layout.nodes.items():
            own = [] if bus in down else [*of_node(look, node), *self._of_booting(node, bus, now_ms)]
            if own or bus in down:
                gone.add(node)
            found += own
        for drive, node in layout.drives.items():
            own = list(self._of_drive(drive, is_heard=node not in gone))
            if not own and node not in gone and self._is_waiting(drive, layout.nodes[node]):
                self._waiting += 1
            found += own
        return [*found, *of_bridge(look), *self._of_log(now_ms)]

    def _of_intruders(self, bus: str, now_ms: float) -> Iterator[Trouble]:
        if self._has_risen(f"bus/{bus}/intruders", now_ms):
            who = self._look(f"bus/{bus}/last_intruder") or ""
            yield Trouble(Rank.ALARM, "intruder", f"bus/{bus}", (("who", who),))

    def _of_booting(self, node: str, bus: str, now_ms: float) -> Iterator[Trouble]:
        """Its time runs only while it may boot: neither before mandatory nodes, nor under another bridge."""
        look = self._look
        may_boot = not look(f"bus/{bus}/held_by") and not look(f"bus/{bus}/passive")
        if look.label(f"{node}/node/state") != "booting" or not may_boot:
            self._booting.pop(node, None)
            return
        began_ms = self._booting.setdefault(node, now_ms)
        if now_ms - began_ms >= BOOTING_MS:
            self._since.setdefault(("node_booting", node), began_ms)
            why = look(f"{node}/node/boot_status") or ""
            yield Trouble(Rank.WARNING, "node_booting", node, (("why", why),))

    def _of_drive(self, drive: str, *, is_heard: bool) -> Iterator[Trouble]:
        main = self._layout.mains.get(drive)
        yield from of_drive(self._look, drive, self._layout.own_faults.get(drive), is_heard=is_heard)
        if is_heard and main is not None:
            yield from of_meaning(self._look, drive, main)

    def _is_waiting(self, drive: str, bus: str) -> bool:
        quality, _ = self._look.quality(f"{drive}/status/state")
        return quality is not Quality.GOOD and not self._look(f"bus/{bus}/held_by")

    def _of_log(self, now_ms: float) -> Iterator[Trouble]:
        # A disk that is full already when the service starts is as bad.
        if self._has_risen("bridge/audit_lost", now_ms, is_news_at_first=True):
            lines = self._look("bridge/audit_lost") or 0
            yield Trouble(Rank.WARNING, "log_lost", "bridge", (("lines", lines),))
