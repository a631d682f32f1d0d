"""Own reaction of a drive to a silent bridge, judged from the content of its objects.

The mapping file names the objects (``own_supervision``). Their content is given as numbers by index and
sub-index; one that is missing is not known.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum

from bridge.config import BusTable, NodeTable
from bridge.mapping.model import Family, OwnReaction, OwnSupervision
from bridge.mapping.own_places import LIFE_TIME_FACTOR, OwnPlace, Raw, place_of
from bridge.text import Said, Text, render


class OwnVerdict(StrEnum):
    STOPS = "stops"
    RUNS_ON = "runs on"
    UNKNOWN = "not known"


@dataclass(frozen=True, slots=True)
class DriveWatch:
    """One thing that the drive supervises. ``verdict`` is None if that is not the bridge."""

    name: str
    watches: str
    setting: str
    time_ms: float | None
    """Time-out of the drive; None where it is not known, 0 where nothing is watched."""
    reaction: str
    verdict: OwnVerdict | None
    because: Said = ""
    """Reason why the drive would not stop by it."""
    silent_ms: int = 0
    """Longest time from a hang of the bridge to its last frame."""

    @property
    def why(self) -> str:
        """Reason why the drive would not stop by it, in English."""
        return render(self.because)

    @property
    def bridge_ms(self) -> float | None:
        """Longest time in ms from the bridge's hang to this reaction; None where there is none."""
        stops = self.verdict is OwnVerdict.STOPS and self.time_ms is not None
        return self.silent_ms + (self.time_ms or 0) if stops else None


@dataclass(frozen=True, slots=True)
class OwnJudgement:
    """Judgement of one drive's own reaction to a silent bridge."""

    watches: tuple[DriveWatch, ...] = ()
    accepted: str = ""
    """Reason for which the site file accepts that it would run on."""

    @property
    def first(self) -> DriveWatch | None:
        """Watch that stops it first; None where none does."""
        stops = [(one.bridge_ms, n) for n, one in enumerate(self.watches) if one.bridge_ms is not None]
        return self.watches[min(stops)[1]] if stops else None

    @property
    def process_data_ms(self) -> float:
        """Time in ms after which it stops without its process data, while everything else goes on; 0 where it
        does not."""
        times = [
            one.time_ms
            for one in self.watches
            if one.watches == "process_data" and one.verdict is OwnVerdict.STOPS and one.time_ms
        ]
        return min(times, default=0.0)

    @property
    def verdict(self) -> OwnVerdict:
        if self.first is not None:
            return OwnVerdict.STOPS
        verdicts = [one.verdict for one in self.watches if one.verdict is not None]
        is_known = bool(verdicts) and OwnVerdict.UNKNOWN not in verdicts
        return OwnVerdict.RUNS_ON if is_known else OwnVerdict.UNKNOWN

    @property
    def own_ms(self) -> float:
        """The drive's own time-out in ms, 0 where it has none."""
        return self.first.time_ms or 0 if self.first else 0

    @property
    def bridge_ms(self) -> int:
        """Longest time in ms from the bridge's hang to the drive's own reaction; 0 where there is none."""
        return round(self.first.bridge_ms or 0) if self.first else 0

    @property
    def terms(self) -> tuple[tuple[str, float], ...]:
        """The summands of ``bridge_ms`` by their names; none where there is no such time."""
        first = self.first
        return (("silent_ms", first.silent_ms), ("own_ms", first.time_ms or 0)) if first else ()

    @property
    def sum(self) -> str:
        """The summands in one line."""
        return " + ".join(f"{name} {ms:g}" for name, ms in self.terms)

    @property
    def because(self) -> Said:
        """Reason why it would not stop, or why that is not known; empty where it would."""
        wanted = self.verdict
        if wanted is OwnVerdict.STOPS:
            return ""
        if not any(one.verdict for one in self.watches):
            return Text.of("own.nothing_said")
        return _together(one.because for one in self.watches if one.verdict is wanted)

    @property
    def reason(self) -> str:
        """Reason why it would not stop, or why that is not known, in English; empty where it would."""
        return render(self.because)


def _together(reasons: Iterable[Said]) -> Said:
    """Text of all reasons, each of them once."""
    each = tuple(dict.fromkeys(reasons))
    return each[0] if len(each) == 1 else Text.of("own.several", reasons=each)


def judge(family: Family, raw: Raw, bus: BusTable, node: NodeTable, accepted: str = "") -> OwnJudgement:
    """Judgement of one drive of this node, with ``raw`` in its objects."""
    watches = [
        _watch(family, entry, raw, bus, node)
        for entry in family.own_supervision
        if entry.watches != "link" or place_of(family, entry).key in raw
    ]
    return OwnJudgement(tuple(watches), accepted)


def why_silence_does_not_stop(family: Family, own: OwnJudgement, node: NodeTable) -> Said:
    """Reason why a drive of this node would run on if only its RPDOs ended, or an empty text.

    Heartbeat, guarding and SYNC go on then, and so do the RPDOs of the node's other drives.
    """
    entries = [entry for entry in family.own_supervision if entry.watches == "process_data"]
    if not entries:
        watched = [entry.name for entry in family.own_supervision if entry.watches != "link"]
        name = family.family.name
        if not watched:
            return Text.of("own.nothing_known", family=name)
        return Text.of("own.watches_else", family=name, watched=tuple(watched))
    alone = [entry for entry in entries if entry.per_drive or len(node.drive) == 1]
    if not alone:
        names = tuple(entry.name for entry in entries)
        return Text.of("own.watches_all", watched=names, count=len(node.drive))
    if own.process_data_ms:
        return ""
    watches = {one.name: one for one in own.watches}
    return _together(watches[entry.name].because for entry in alone)


def _watch(family: Family, entry: OwnSupervision, raw: Raw, bus: BusTable, node: NodeTable) -> DriveWatch:
    place = place_of(family, entry)
    value = raw.get(place.key)
    silent_ms = max(bus.deadman_ms, bus.heartbeat_ms if entry.watches == "heartbeat" else 0)
    if value is None:
        why = Text.of("own.not_known", place=place.name)
        return DriveWatch(entry.name, entry.watches, render(why), None, "", OwnVerdict.UNKNOWN, why)
    if entry.watches == "link":
        off = value in entry.off
        why = Text.of("own.no_link") if off else ""
        return DriveWatch(entry.name, entry.watches, place.shown(value), None, "", None, why)
    time_ms, setting, why = _time(entry, place, value, raw, bus, node)
    if time_ms is None:
        return DriveWatch(entry.name, entry.watches, setting, None, "", OwnVerdict.UNKNOWN, why)
    reaction, verdict, why_not = _reaction(family, entry.reaction, raw)
    if not time_ms:
        return DriveWatch(entry.name, entry.watches, setting, 0.0, reaction, OwnVerdict.RUNS_ON, why)
    why = why_not
    return DriveWatch(entry.name, entry.watches, setting, time_ms, reaction, verdict, why, silent_ms)


def _time(
    entry: OwnSupervision, place: OwnPlace, value: int, raw: Raw, bus: BusTable, node: NodeTable
) -> tuple[float | None, str, Said]:
    """Time-out in ms (0: nothing is watched, None: not known), the setting in words, and why it is off."""
    if entry.watches == "guarding":
        factor = raw.get(LIFE_TIME_FACTOR) if value else 0
        if factor is None:
            return None, f"{place.name} = {value} ms", Text.of("own.not_known", place="100D:00")
        setting = f"{place.name} × 100D:00 = {value} ms × {factor}"
        if not value * factor:
            return 0.0, setting, Text.of("own.guarding_off")
        if node.supervision != "guarding":
            return 0.0, setting, Text.of("own.not_guarded", supervision=node.supervision)
        return float(value * factor), setting, ""
    if entry.watches == "heartbeat":
        watched, time_ms = value >> 16 & 0x7F, value & 0xFFFF
        if not watched or not time_ms:
            return 0.0, f"{place.name} = 0", Text.of("own.no_heartbeat", place=place.name)
        setting = f"{place.name} = node {watched}, {time_ms} ms"
        if watched != bus.master_node_id:
            own = bus.master_node_id
            return 0.0, setting, Text.of("own.other_node", place=place.name, watched=watched, own=own)
        if not bus.heartbeat_ms:
            return 0.0, setting, Text.of("own.bridge_silent")
        return float(time_ms), setting, ""
    time_ms = value * entry.unit_ms
    if value in entry.off:
        return 0.0, f"{place.name} = {value} (off)", Text.of("own.off", place=place.name, value=value)
    return time_ms, f"{place.name} = {time_ms:g} ms", ""


def _reaction(family: Family, one: OwnReaction | None, raw: Raw) -> tuple[str, OwnVerdict, Said]:
    """Reaction in words, the drive's behaviour then, and the reason why that is no stop."""
    if one is None:
        return "stops", OwnVerdict.STOPS, ""
    place = place_of(family, one)
    value = raw.get(place.key)
    if value is None:
        return f"{place.name} not known", OwnVerdict.UNKNOWN, Text.of("own.not_known", place=place.name)
    text = place.shown(value)
    if value in one.nothing:
        return text, OwnVerdict.RUNS_ON, _runs_on(place, value)
    return text, OwnVerdict.STOPS, ""


def _runs_on(place: OwnPlace, value: int) -> Text:
    if state := place.states.get(value):
        return Text.of("own.runs_on_state", place=place.name, value=value, state=state)
    return Text.of("own.runs_on", place=place.name, value=value)
