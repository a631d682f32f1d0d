"""Own supervision of drives when the bridge falls silent, judged by site file and factory settings."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import partial

from bridge.command.worst_case import StopTime, Wire, stop_time
from bridge.config import DriveTable
from bridge.drive import OwnJudgement, OwnVerdict
from bridge.drive.own_judgement import judge
from bridge.lint.checked_bus import CheckedBus, CheckedDrive, CheckedNode
from bridge.lint.interference import busy_bits, wire_of
from bridge.lint.report import LintReport
from bridge.mapping.model import OwnSupervision
from bridge.mapping.own_places import channels_needed, offline, place_of, settable, wanted
from bridge.text import Said, Text, render
from bridge.tomlfile import Key


@dataclass(frozen=True, slots=True)
class WorstCase:
    """Longest times in which one drive stops after its controller, and after the bridge, fell silent."""

    drive: str
    stop: StopTime
    own: OwnJudgement
    wire: Wire
    longest: StopTime | None = None
    """The same with the longest time-out that the owner may set; None where it may not set any."""

    def __str__(self) -> str:
        bridge = f"{self.own.bridge_ms} ms" if self.own.bridge_ms else str(self.own.verdict)
        owner = f" (as its owner may set it: {self.longest})" if self.longest else ""
        return f"{self.drive}: dead controller: {self.stop}{owner}, dead bridge: {bridge}"

    @property
    def terms(self) -> list[str]:
        """The sums, where there are any."""
        sums = [("dead controller", self.stop.sum), ("dead bridge", self.own.sum)]
        return [f"{self.drive}: {who}: {terms}" for who, terms in sums if terms]

    @property
    def facts(self) -> dict[str, object]:
        """Times and terms for programs, ready for JSON."""
        return {
            "controller_ms": self.stop.ms,
            "controller_terms": [asdict(term) for term in self.stop.terms],
            "controller_unknown": render(self.stop.unknown),
            "controller_longest_ms": self.longest.ms if self.longest else self.stop.ms,
            "bridge_ms": self.own.bridge_ms,
            "bridge_terms": [{"name": name, "ms": ms} for name, ms in self.own.terms],
        }


def worst_cases(bus: CheckedBus) -> Iterator[WorstCase]:
    """Worst cases of every drive of the bus, as far as known without asking it."""
    busy = busy_bits(bus)
    for node in bus.nodes:
        for drive in node.drives:
            timeout_ms = drive.table.fieldbus_timeout_ms or 0
            kind = drive.rpdos[0].transmission_type
            wire = wire_of(bus, drive.rpdos, busy)
            own = judged(bus, node, drive)
            of_time = partial(_stop_time, bus, drive, kind, wire, own.process_data_ms)
            writable = drive.table.fieldbus_timeout_writable and drive.table.control != "none"
            longest = of_time(longest_ms(drive.table)) if writable else None
            yield WorstCase(drive.name, of_time(timeout_ms), own, wire, longest)


def longest_ms(table: DriveTable) -> int:
    """Longest time-out in ms that the owner has or may set; 0 (off) counts as the longest."""
    low, high = table.timeout_range_ms
    own_ms = table.fieldbus_timeout_ms or 0
    return max(high, own_ms) if low and own_ms else 0


def _stop_time(
    bus: CheckedBus, drive: CheckedDrive, kind: int, wire: Wire, own_ms: float, timeout_ms: int
) -> StopTime:
    return stop_time(drive.table, bus.table, timeout_ms, kind, wire, own_ms)


def judged(bus: CheckedBus, node: CheckedNode, drive: CheckedDrive) -> OwnJudgement:
    slot = node.family.slot_named(drive.table.slot)
    family, table = node.family.of_slot(slot), node.table
    raw = offline(family, node.settings.values, bus.table, table, slot)
    return judge(family, raw, bus.table, table, drive.table.accepts.runs_on or "")


def check_own_supervision(bus: CheckedBus, report: LintReport) -> None:
    for node in bus.nodes:
        if node.table.enabled:
            _check_times(bus, node, report)
            if not _check_reaction(bus, node, report):
                _check_runs_on(bus, node, report)


def _check_times(bus: CheckedBus, node: CheckedNode, report: LintReport) -> None:
    """Check that configured time-outs exceed the longest silence of a healthy bridge."""
    entry = settable(node.family)
    if entry is None:
        return
    key, own_ms = _given(bus, node, entry)
    if not own_ms:
        return
    place, deadman_ms = str(place_of(node.family, entry).ref), bus.table.deadman_ms
    is_heartbeat = entry.watches == "heartbeat"
    period_ms = float(bus.table.heartbeat_ms) if is_heartbeat else 1000 * bus.table.rpdo_period_s
    if is_heartbeat and not period_ms:
        report.error(key, Text.of("check.own_without_heartbeat", place=place, time=own_ms))
    elif own_ms < 2 * period_ms:
        report.error(
            key,
            Text.of(
                "check.own_below_heartbeat" if is_heartbeat else "check.own_below_rpdo",
                place=place,
                time=own_ms,
                period=period_ms,
            ),
            Text.of("check.at_least_ms", least=2 * period_ms),
        )
    elif own_ms < deadman_ms:
        report.warning(
            key,
            Text.of("check.own_below_deadman", place=place, time=own_ms, deadman=deadman_ms),
            Text.of("check.own_deadman_advice", least=deadman_ms),
        )


def _given(bus: CheckedBus, node: CheckedNode, entry: OwnSupervision) -> tuple[Key, float]:
    """Time that the site file gives, and its key."""
    if node.table.own_timeout_ms is not None:
        return (*node.key, "own_timeout_ms"), float(node.table.own_timeout_ms)
    setting = node.settings[place_of(node.family, entry).key]
    if setting is None:
        return node.key, 0.0
    if entry.watches == "heartbeat":
        is_bridge = setting.value >> 16 & 0x7F == bus.table.master_node_id
        return setting.key, float(setting.value & 0xFFFF) if is_bridge and bus.table.heartbeat_ms else 0.0
    return setting.key, setting.value * entry.unit_ms


def _check_reaction(bus: CheckedBus, node: CheckedNode, report: LintReport) -> bool:
    """Report a node whose reaction to its time-out is none by factory setting. True if it was reported."""
    entry = settable(node.family)
    reaction = entry.reaction if entry else None
    if entry is None or reaction is None or reaction.factory not in reaction.nothing:
        return False
    if node.table.enforce and wanted(node.family, bus.table, node.table):
        return False
    time, place = place_of(node.family, entry), place_of(node.family, reaction)
    setting = node.settings[place.key]
    if setting is not None and setting.value not in reaction.nothing:
        return False
    key, own_ms = _given(bus, node, entry)
    if own_ms:
        said = Text.of("check.own_reaction_not_set", place=str(time.ref), reaction=str(place.ref))
        if setting is not None:
            value = setting.value
            said = Text.of("check.own_no_reaction", place=str(time.ref), reaction=str(place.ref), value=value)
        report.warning(key, said, Text.of("check.own_reaction_advice", place=str(place.ref)))
        return True
    if setting is None and any(_runs_on(judged(bus, node, drive)) for drive in node.drives):
        report.warning(
            node.key,
            Text.of("check.own_does_nothing", family=node.family.family.name, place=str(place.ref)),
            Text.of("check.own_does_nothing_advice", reaction=str(place.ref), time=str(time.ref)),
        )
        return True
    return False


def _check_runs_on(bus: CheckedBus, node: CheckedNode, report: LintReport) -> None:
    """Report drives that are not known to stop when the bridge falls silent; drives of a node with the same
    reason share one warning."""
    drives: dict[tuple[OwnVerdict, Said], list[str]] = {}
    for drive in node.drives:
        own = judged(bus, node, drive)
        if _runs_on(own):
            drives.setdefault((own.verdict, own.because), []).append(drive.name)
    for (verdict, reason), names in drives.items():
        runs_on = verdict is OwnVerdict.RUNS_ON
        said = Text.of(
            "check.runs_on" if runs_on else "check.may_run_on",
            drives=", ".join(names),
            why=reason,
        )
        report.warning(node.key, said, Text.of("check.runs_on_advice", what=_remedy(node, names)))


def _remedy(node: CheckedNode, names: Sequence[str]) -> Text:
    """Remedy for these drives, which would run on."""
    family = node.family
    if settable(family) is not None:
        slots = [family.slot_named(drive.table.slot) for drive in node.drives if drive.name in names]
        channels = channels_needed(family, node.table, slots)
        if channels:
            return Text.of("check.enforce_by_channels", channels=str(channels))
        return Text.of("check.enforce")
    if any(entry.watches == "guarding" for entry in family.own_supervision):
        return Text.of("check.guard")
    return Text.of("check.time_in_drive")


def _runs_on(own: OwnJudgement) -> bool:
    return own.verdict is not OwnVerdict.STOPS and not own.accepted
