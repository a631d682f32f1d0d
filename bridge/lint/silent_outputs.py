"""Outputs of nodes that are no drives: their state when their controller or the bridge falls silent."""

from __future__ import annotations

from collections.abc import Iterator

from bridge.command.output_words import OutputWords
from bridge.command.worst_case import StopTime, output_stop_time
from bridge.drive import OwnJudgement, OwnVerdict
from bridge.drive.own_judgement import judge
from bridge.lint.checked_bus import CheckedBus, CheckedNode, CheckedPdo
from bridge.lint.interference import busy_bits, wire_of
from bridge.lint.own import WorstCase
from bridge.lint.report import LintReport
from bridge.mapping.entry_types import ObjectRef, said_of
from bridge.mapping.own_places import offline
from bridge.node.boot.device_watch import keeps_outputs, why_not_safe
from bridge.text import Text

_ASYNCHRONOUS = 255


def output_cases(bus: CheckedBus) -> Iterator[WorstCase]:
    """Worst cases of every node of the bus whose outputs are commanded, as far as known without asking it."""
    busy = busy_bits(bus)
    for node in bus.nodes:
        if not _is_commanded(node):
            continue
        rpdos = _rpdos(node)
        wire = wire_of(bus, rpdos, busy)
        kind = min((pdo.transmission_type for pdo in rpdos), default=_ASYNCHRONOUS)
        stop = StopTime()
        if not _words(node).all_hold:
            stop = output_stop_time(node.table.outputs, bus.table, kind, wire)
        yield WorstCase(node.table.name, stop, judged_outputs(bus, node), wire)


def check_outputs(bus: CheckedBus, report: LintReport) -> None:
    for node in bus.nodes:
        if not _is_commanded(node):
            continue
        name, table = node.table.name, node.table.outputs
        if table.fieldbus_timeout_ms == 0:
            said = Text.of("check.outputs_unwatched", node=name)
            report.warning((*node.key, "outputs", "fieldbus_timeout_ms"), said)
        if _words(node).all_hold:
            continue
        own = judged_outputs(bus, node)
        if own.verdict is not OwnVerdict.STOPS and not own.accepted:
            stay = own.verdict is OwnVerdict.RUNS_ON
            report.warning(
                node.key,
                Text.of(
                    "check.outputs_stay" if stay else "check.outputs_may_stay",
                    node=name,
                    why=own.because,
                ),
                Text.of("check.outputs_stay_advice"),
            )


def check_read_only(bus: CheckedBus, report: LintReport) -> None:
    """Report nodes that may be taken for drives and cannot be commanded."""
    for node in bus.nodes:
        if why := said_of(node.family.family.read_only):
            told = Text.of("check.only_read", node=node.table.name, why=why)
            report.warning((*node.key, "mapping"), told)


def judged_outputs(bus: CheckedBus, node: CheckedNode) -> OwnJudgement:
    """Judgement of what the node does with its outputs by itself, by site file and factory settings."""
    raw = {**_factory(node), **offline(node.family, node.settings.values, bus.table, node.table, None)}
    accepted = node.table.outputs.accepts.runs_on or ""
    own = judge(node.family, raw, bus.table, node.table, accepted)
    for place in _words(node).places.values():
        if place.safe is None:
            continue
        output = place.output
        mode, value = (_number(node, ref) for ref in (output.error_mode, output.error_value))
        if why := why_not_safe(place, place.safe, mode, value):
            return keeps_outputs(own, why, is_known=mode is not None and value is not None)
    return own


def _is_commanded(node: CheckedNode) -> bool:
    is_used = node.table.enabled and node.table.outputs.control != "none"
    return bool(node.family.output) and is_used


def _words(node: CheckedNode) -> OutputWords:
    return OutputWords.of(node.table, node.family)


def _rpdos(node: CheckedNode) -> list[CheckedPdo]:
    return [pdo for pdo in node.pdos if pdo.receives and pdo.sent]


def _factory(node: CheckedNode) -> dict[tuple[int, int], int]:
    """Factory values of the deciding objects, by its device description."""
    found: dict[tuple[int, int], int] = {}
    for own in node.family.own_supervision:
        for one in (own, own.reaction):
            ref = one.object if one else None
            if ref is None or one is None:
                continue
            number = _described(node, ref)
            if number is None and node.dictionary is not None:
                number = one.absent
            if number is not None:
                found[ref.index, ref.sub] = number
    return found


def _number(node: CheckedNode, ref: ObjectRef | None) -> int | None:
    if ref is None:
        return None
    setting = node.settings[ref.index, ref.sub]
    return _described(node, ref) if setting is None else setting.value


def _described(node: CheckedNode, ref: ObjectRef) -> int | None:
    if node.dictionary is None:
        return None
    return node.dictionary.number(ref.index, ref.sub, node.table.id)
