"""What is wrong on the plant at present, the worst first, each with what it is about and since when. Sans-IO.

A trouble is a kind, a place and what its text needs; the browser has the texts. What follows from another
trouble is left out: a bus that is down says more than each of its nodes being lost.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Any, Final

from bridge.image import Image, Quality, Value

_DOWN: Final = ("bus_off", "down")
_BEGINNING_MS: Final = 2000.0
"""What is there so soon after the front has begun may have been there before."""
_RECENT_MS: Final = 600_000.0
"""How long something that happens, and then is over, is shown after it has happened last."""


class Rank(IntEnum):
    """How much a trouble matters; people may be in danger, something stands still, or it may soon."""

    DANGER = 0
    ALARM = 1
    WARNING = 2


@dataclass(frozen=True, slots=True)
class Trouble:
    """``place`` is ``<node>/<drive>``, ``<node>``, ``bus/<bus>`` or ``bridge``."""

    rank: Rank
    kind: str
    place: str
    facts: tuple[tuple[str, Value], ...] = ()


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
        self._look = _Look(image)
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
        down = {bus for bus in self._layout.buses if self._look.label(f"bus/{bus}/state") in _DOWN}
        for bus in self._layout.buses:
            yield from _of_bus(self._look, bus, is_down=bus in down)
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
            for trouble in _of_node(self._look, node):
                gone.add(node)
                yield trouble
        for drive, node in self._layout.drives.items():
            yield from _of_drive(self._look, drive, is_heard=node not in gone)
            if node not in gone and drive in self._layout.mains:
                yield from _of_meaning(self._look, drive, self._layout.mains[drive])
        yield from _of_bridge(self._look)
        if self._has_risen("bridge/audit_lost", now_ms):
            yield Trouble(
                Rank.WARNING, "log_lost", "bridge", (("lines", self._look("bridge/audit_lost") or 0),)
            )


class _Look:
    """Points by their names; None where there is none, or it has no value."""

    def __init__(self, image: Image) -> None:
        self._image = image
        self._places = {point.name: place for place, point in enumerate(image.points)}
        self._labels = {point.name: dict(point.states) for point in image.points if point.states}

    def __call__(self, name: str) -> Value | None:
        place = self._places.get(name)
        if place is None:
            return None
        value, quality, _, _ = self._image[place]
        return value if quality.has_value else None

    def label(self, name: str) -> str:
        code = self(name)
        return self._labels[name].get(code, "") if isinstance(code, int) else ""

    def quality(self, name: str) -> tuple[Quality, str]:
        place = self._places.get(name)
        if place is None:
            return Quality.GOOD, ""
        _, quality, _, reason = self._image[place]
        return quality, reason


def _of_bus(look: _Look, bus: str, *, is_down: bool) -> Iterator[Trouble]:
    place = f"bus/{bus}"
    if look(f"{place}/passive"):
        return
    if is_down:
        why = look(f"{place}/last_error") or ""
        kind = "bus_off" if look.label(f"{place}/state") == "bus_off" else "bus_down"
        yield Trouble(Rank.ALARM, kind, place, (("why", why),))
        return
    state = look.label(f"{place}/state")
    if state in ("warning", "passive"):
        yield Trouble(Rank.WARNING, "bus_errors", place, (("why", look(f"{place}/last_error") or ""),))
    if ids := look(f"{place}/duplicate_ids"):
        yield Trouble(Rank.ALARM, "duplicate_ids", place, (("ids", ids),))
    if look(f"{place}/second_master"):
        yield Trouble(Rank.ALARM, "second_master", place)
    if ids := look(f"{place}/unexpected_nodes"):
        yield Trouble(Rank.WARNING, "unexpected_nodes", place, (("ids", ids),))
    if held_by := look(f"{place}/held_by"):
        yield Trouble(Rank.ALARM, "held", place, (("nodes", held_by),))


def _of_node(look: _Look, node: str) -> Iterator[Trouble]:
    state = look.label(f"{node}/node/state")
    status = look(f"{node}/node/boot_status") or ""
    if state == "config_error":
        yield Trouble(Rank.ALARM, "not_as_configured", node, (("why", status),))
    elif state == "lost":
        how = look(f"{node}/node/supervision_state") or ""
        yield Trouble(Rank.ALARM, "node_lost", node, (("how", how),))
    elif state == "absent":
        yield Trouble(Rank.ALARM, "node_absent", node)
    elif state == "stopped":
        yield Trouble(Rank.WARNING, "node_stopped", node)


def _of_drive(look: _Look, drive: str, *, is_heard: bool) -> Iterator[Trouble]:
    if look(f"{drive}/supervision/follows") is False:
        yield Trouble(Rank.DANGER, "ignores_stop", drive)
    is_tripped = look.label(f"{drive}/supervision/watchdog_state") == "tripped"
    if is_tripped:
        owner = look(f"{drive}/supervision/owner") or ""
        timeout = look(f"{drive}/supervision/fieldbus_timeout_ms") or 0
        yield Trouble(Rank.ALARM, "controller_silent", drive, (("owner", owner), ("timeout_ms", timeout)))
    if not is_heard:
        return
    quality, reason = look.quality(f"{drive}/status/state")
    if quality is Quality.CONFIG_ERROR:
        yield Trouble(Rank.ALARM, "drive_not_as_configured", drive, (("why", reason),))
    elif quality in (Quality.LOST, Quality.DEAD):
        yield Trouble(Rank.ALARM, "drive_lost", drive, (("why", reason),))
    # The fault that is shown after a trip is the bridge's own, and says the same.
    elif (text := look(f"{drive}/status/fault_text")) and not is_tripped:
        facts = (
            ("text", text),
            ("number", look(f"{drive}/status/fault_number") or ""),
            ("cause", look(f"{drive}/status/fault_cause") or ""),
            ("remedy", look(f"{drive}/status/fault_remedy") or ""),
        )
        yield Trouble(Rank.ALARM, "drive_fault", drive, facts)
    elif quality is Quality.STALE:
        yield Trouble(Rank.WARNING, "drive_stale", drive, (("why", reason),))


def _of_meaning(look: _Look, drive: str, main: str) -> Iterator[Trouble]:
    """The drive's words do not carry what moves it: its parameters say so."""
    for group in ("command", "actual"):
        quality, reason = look.quality(f"{drive}/{group}/{main}")
        if quality is Quality.DISABLED and reason:
            yield Trouble(Rank.WARNING, f"no_{group}", drive, (("value", main), ("why", reason)))


def _of_bridge(look: _Look) -> Iterator[Trouble]:
    if failing := look("bridge/fronts_failing"):
        yield Trouble(Rank.WARNING, "fronts_failing", "bridge", (("fronts", failing),))
