"""Troubles of one bus, node or drive, by its points. Sans-IO."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Final

from bridge.drive import Explained
from bridge.image import Image, Quality, Value
from bridge.text import Said, Text, Words, in_english

OwnFault = Callable[[int, int], Explained | None]
"""The fault that a drive's own status word and its last emergency code tell; None where there is none."""
DOWN: Final = ("bus_off", "down")


class Rank(IntEnum):
    """Weight of a trouble: people may be in danger, something stands still, or it may soon."""

    DANGER = 0
    ALARM = 1
    WARNING = 2


@dataclass(frozen=True, slots=True)
class Trouble:
    """``place`` is ``<node>/<drive>``, ``<node>``, ``bus/<bus>`` or ``bridge``. ``is_of_bus``: a fault with
    which a drive answers a silent bus. ``fronts`` are the servers that fail."""

    rank: Rank
    kind: str
    place: str
    facts: tuple[tuple[str, Value | Text], ...] = ()
    is_of_bus: bool = False
    fronts: frozenset[str] = frozenset()


class ImageReader:
    """Values of points by name; None where there is no such point, or it has no value."""

    def __init__(self, image: Image) -> None:
        self._image = image
        self._places = image.index
        self.of_bridge = [point.name for point in image.points if point.path[0] == "bridge"]
        self._labels = {
            point.name: {code: in_english(text) for code, text in point.states}
            for point in image.points
            if point.states
        }

    def __call__(self, name: str) -> Value | None:
        place = self._places.get(name)
        if place is None:
            return None
        value, quality, _, _ = self._image[place]
        return value if quality.has_value else None

    def label(self, name: str) -> str:
        code = self(name)
        return self._labels[name].get(code, "") if isinstance(code, int) else ""

    def words(self, name: str) -> Words:
        """Words of a point: its text with code and facts where it has one, else the plain words; empty where
        none."""
        words = self(name)
        if not isinstance(words, str):
            return ""
        return self._image.said(self._places[name]) or words

    def quality(self, name: str) -> tuple[Quality, Said]:
        place = self._places.get(name)
        if place is None:
            return Quality.GOOD, ""
        _, quality, _, why = self._image[place]
        return quality, why


def is_bridge_dead(reader: ImageReader) -> bool:
    """The mirror gives every point the quality *dead* while the bus process does not answer. The bridge's own
    points have it at no other time."""
    return bool(reader.of_bridge) and all(
        reader.quality(name)[0] is Quality.DEAD for name in reader.of_bridge
    )


def of_bus(reader: ImageReader, bus: str, *, is_down: bool) -> Iterator[Trouble]:
    place = f"bus/{bus}"
    if reader(f"{place}/passive"):
        return
    if is_down:
        why = reader.words(f"{place}/last_error")
        kind = "bus_off" if reader.label(f"{place}/state") == "bus_off" else "bus_down"
        yield Trouble(Rank.ALARM, kind, place, (("why", why),))
        return
    state = reader.label(f"{place}/state")
    if state in ("warning", "passive"):
        yield Trouble(Rank.WARNING, "bus_errors", place, (("why", reader.words(f"{place}/last_error")),))
    if ids := reader(f"{place}/duplicate_ids"):
        yield Trouble(Rank.ALARM, "duplicate_ids", place, (("ids", ids),))
    if reader(f"{place}/second_master"):
        yield Trouble(Rank.ALARM, "second_master", place)
    if ids := reader(f"{place}/unexpected_nodes"):
        yield Trouble(Rank.WARNING, "unexpected_nodes", place, (("ids", ids),))
    if held_by := reader(f"{place}/held_by"):
        yield Trouble(Rank.ALARM, "held", place, (("nodes", held_by),))


def of_node(reader: ImageReader, node: str) -> Iterator[Trouble]:
    if reader(f"{node}/supervision/follows") is False:
        yield Trouble(Rank.DANGER, "outputs_ignore_stop", node)
    state = reader.label(f"{node}/node/state")
    status = reader.words(f"{node}/node/boot_status")
    if state == "config_error":
        yield Trouble(Rank.ALARM, "not_as_configured", node, (("why", status),))
    elif state == "lost":
        how = reader.words(f"{node}/node/supervision_state")
        yield Trouble(Rank.ALARM, "node_lost", node, (("how", how),))
    elif state == "absent":
        yield Trouble(Rank.ALARM, "node_absent", node)
    elif state == "stopped":
        yield Trouble(Rank.WARNING, "node_stopped", node)
    elif state == "disabled":
        yield Trouble(Rank.WARNING, "node_disabled", node)


def of_drive(
    reader: ImageReader, drive: str, own_fault: OwnFault | None, bus_faults: frozenset[str] = frozenset()
) -> Iterator[Trouble]:
    """``bus_faults`` are the numbers of those with which it answers a silent bus."""
    if reader(f"{drive}/supervision/follows") is False:
        yield Trouble(Rank.DANGER, "ignores_stop", drive)
    is_tripped = reader.label(f"{drive}/supervision/watchdog_state") == "tripped"
    if is_tripped:
        owner = reader(f"{drive}/supervision/owner") or ""
        timeout = reader(f"{drive}/supervision/fieldbus_timeout_ms") or 0
        yield Trouble(Rank.ALARM, "controller_silent", drive, (("owner", owner), ("timeout_ms", timeout)))
    quality, reason = reader.quality(f"{drive}/status/state")
    if quality is Quality.CONFIG_ERROR:
        yield Trouble(Rank.ALARM, "drive_not_as_configured", drive, (("why", reason),))
    elif quality in (Quality.LOST, Quality.DEAD):
        yield Trouble(Rank.ALARM, "drive_lost", drive, (("why", reason),))
    elif facts := _own(reader, drive, own_fault) if is_tripped else _shown(reader, drive):
        is_of_bus = dict(facts).get("number") in bus_faults
        yield Trouble(Rank.ALARM, "drive_fault", drive, facts, is_of_bus)
    elif quality is Quality.STALE:
        yield Trouble(Rank.WARNING, "drive_stale", drive, (("why", reason),))
    quality, reason = reader.quality(f"{drive}/supervision/worst_case_bridge_ms")
    if quality is Quality.CONFIG_ERROR:
        yield Trouble(Rank.WARNING, "stop_unproven", drive, (("why", reason),))


def _shown(reader: ImageReader, drive: str) -> tuple[tuple[str, Value | Text], ...]:
    """The facts of the fault that the points show; none where there is none."""
    text = reader.words(f"{drive}/status/fault_text")
    if not text:
        return ()
    rest = ((leaf, reader(f"{drive}/status/fault_{leaf}") or "") for leaf in ("number", "cause", "remedy"))
    return (("text", text), *rest)


def _own(reader: ImageReader, drive: str, own_fault: OwnFault | None) -> tuple[tuple[str, Value | Text], ...]:
    """The facts of the drive's own fault. After a trip the points show the bridge's, which says no more than
    that the controller is silent."""
    word = reader(f"{drive}/status/drive_status_word")
    code = reader(f"{drive}/status/emcy_code")
    if own_fault is None or not isinstance(word, int):
        return ()
    fault = own_fault(word, code if isinstance(code, int) else 0)
    if fault is None:
        return ()
    return (("text", fault.said), ("number", fault.number), ("cause", fault.cause), ("remedy", fault.remedy))


def of_meaning(reader: ImageReader, drive: str, main: str) -> Iterator[Trouble]:
    """The drive's words do not carry what moves it: its parameters say so."""
    for group in ("command", "actual"):
        quality, reason = reader.quality(f"{drive}/{group}/{main}")
        if quality is Quality.DISABLED and reason:
            yield Trouble(Rank.WARNING, f"no_{group}", drive, (("value", main), ("why", reason)))


def silence_of(reader: ImageReader, bus: str, nodes: Sequence[str]) -> Iterator[Trouble]:
    """None of the nodes that should be there answers, which breaks of each of them at once would not explain.
    A single one may be alone to blame, unless nobody acknowledges what the controller sends."""
    place = f"bus/{bus}"
    states = [reader.label(f"{node}/node/state") for node in nodes]
    expected = [state for state in states if state not in ("disabled", "stopped", "config_error")]
    if not expected or any(state not in ("lost", "absent") for state in expected):
        return
    if len(expected) > 1 or reader.label(f"{place}/state") == "passive":
        yield Trouble(Rank.ALARM, "bus_silent", place, (("nodes", len(expected)),))


def of_bridge(reader: ImageReader) -> Iterator[Trouble]:
    if failing := reader.words("bridge/fronts_failing"):
        facts = (("fronts", failing),)
        yield Trouble(Rank.WARNING, "fronts_failing", "bridge", facts, fronts=_fronts_in(failing))


def _fronts_in(failing: Words) -> frozenset[str]:
    parts = () if isinstance(failing, str) else dict(failing.facts)["parts"]
    texts = [one for one in parts if isinstance(one, Text)] if isinstance(parts, tuple) else []
    return frozenset(str(dict(one.facts)["front"]) for one in texts)
