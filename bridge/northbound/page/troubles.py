"""What is wrong on the plant at present, the worst first, each with what it is about and since when. Sans-IO.

A trouble is a kind, a place and what its text needs; the browser has the texts. What follows from another
trouble is left out: a bus that is down says more than each of its nodes being lost, and where the bus process
does not answer nothing is known at all.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from bridge.image import Image
from bridge.northbound.page.findings import (
    DOWN,
    Look,
    Rank,
    Trouble,
    is_bridge_dead,
    of_bridge,
    of_bus,
    of_drive,
    of_meaning,
    of_node,
)

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
        self._shown: list[dict[str, Any]] | None = None

    def beat(self) -> bool:
        """Look again; whether ``shown`` is another list now."""
        now_ms = self._epoch_ms()
        troubles = sorted(self._found(now_ms), key=lambda one: one.rank)
        self._since = {
            (one.kind, one.place): self._since.get((one.kind, one.place), now_ms) for one in troubles
        }
        shown = [self._said(one) for one in troubles]
        has_changed = shown != self._shown
        self._shown = shown
        return has_changed

    @property
    def shown(self) -> list[dict[str, Any]]:
        """For JSON: rank, kind, place, since in ms since 1970, what else its text needs; ``or_longer`` where
        it may have begun before this front did."""
        return self._shown or []

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

    def _has_risen(self, name: str, now_ms: float) -> bool:
        """Whether the counter ``name`` rose lately. What it had when the front began is nobody's news."""
        count = self._look(name)
        if not isinstance(count, int):
            return False
        before, risen_ms = self._counts.get(name, (count, float("-inf")))
        if count > before:
            risen_ms = now_ms
        self._counts[name] = count, risen_ms
        return now_ms - risen_ms < _RECENT_MS

    def _found(self, now_ms: float) -> Iterator[Trouble]:
        if is_bridge_dead(self._look):
            yield Trouble(Rank.ALARM, "bridge_dead", "bridge")
            return
        down = {bus for bus in self._layout.buses if self._look.label(f"bus/{bus}/state") in DOWN}
        for bus in self._layout.buses:
            yield from of_bus(self._look, bus, is_down=bus in down)
            if self._has_risen(f"bus/{bus}/intruders", now_ms):
                yield Trouble(
                    Rank.ALARM,
                    "intruder",
                    f"bus/{bus}",
                    (("who", self._look(f"bus/{bus}/last_intruder") or ""),),
                )
        gone: set[str] = set()
        for node, bus in self._layout.nodes.items():
            if bus in down:
                gone.add(node)
                continue
            for trouble in of_node(self._look, node):
                gone.add(node)
                yield trouble
        for drive, node in self._layout.drives.items():
            yield from of_drive(self._look, drive, is_heard=node not in gone)
            if node not in gone and drive in self._layout.mains:
                yield from of_meaning(self._look, drive, self._layout.mains[drive])
        yield from of_bridge(self._look)
        if self._has_risen("bridge/audit_lost", now_ms):
            yield Trouble(
                Rank.WARNING, "log_lost", "bridge", (("lines", self._look("bridge/audit_lost") or 0),)
            )
