"""Check for times that cannot work together."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from bridge.canopen.sync import LAST_SYNCHRONOUS, tpdo_deadline_s
from bridge.config import IGNORE_ALL_S, LIFE_SIGN_MS
from bridge.lint.checked_bus import CheckedBus, CheckedDrive, CheckedNode
from bridge.lint.report import LintReport
from bridge.node.process.held import held_s, least_deadman_ms
from bridge.text import Text

_SLOW_ANSWER_MS: Final = 50
"""Longest time for an SDO answer: 30 + 20 ms in an 8400 motec (EDS84DMOTCAN 3.0 §9), 50 ms and more behind
NORD's system bus."""
_SDO_LIVES: Final = 10
_ROUND_TRIP_MS: Final = 500
"""Round trip of a life sign's token: some 200 ms until an OPC UA or zenoh client is told of it (at once where
a Modbus client reads it), a program that reads and writes every 100 ms, and the network."""
_LONGEST_DEADMAN_MS: Final = 10_000


def check_times(bus: CheckedBus, report: LintReport) -> None:
    for node in bus.nodes:
        if not node.table.enabled:
            continue
        _check_supervision(bus, node, report)
        _check_sdo(node, report)
        for drive in node.drives:
            _check_controller(bus, drive, report)
            _check_life_sign(drive, report)
            _check_range(drive, report)
            _check_held(bus, drive, report)
            _check_downtime(bus, node, drive, report)


def life_ms(node: CheckedNode) -> int:
    """Silence in ms after which a node is lost; 0 where nothing watches it."""
    table = node.table
    factors = {"heartbeat": 1, "guarding": table.life_time_factor, "none": 0}
    return table.supervision_ms * factors[table.supervision]


def _check_supervision(bus: CheckedBus, node: CheckedNode, report: LintReport) -> None:
    table, dictionary = node.table, node.dictionary
    objects = {"heartbeat": (0x1017,), "guarding": (0x100C, 0x100D), "none": ()}[table.supervision]
    missing = [f"{index:04X}h" for index in objects if dictionary and not dictionary.object(index)]
    if missing:
        other = "guarding" if table.supervision == "heartbeat" else "heartbeat"
        report.error(
            (*node.key, "supervision"),
            _lacks(node.family.family.name, missing),
            Text.of("check.supervision_advice", kind=table.supervision, other=other),
        )
    if table.supervision == "none":
        return
    if table.supervision == "guarding" and table.life_time_factor == 1:
        said, advice = Text.of("check.one_lost_frame"), Text.of("check.at_least", least=2)
        report.warning((*node.key, "life_time_factor"), said, advice)
    if table.supervision_ms < 2 * bus.table.sync_period_ms:
        report.warning(
            (*node.key, "supervision_ms"),
            Text.of("check.supervision_short", time=table.supervision_ms),
            Text.of("check.at_least", least=2 * bus.table.sync_period_ms),
        )


def _check_sdo(node: CheckedNode, report: LintReport) -> None:
    timeout_ms, life = node.table.sdo_timeout_ms, life_ms(node)
    key = (*node.key, "sdo_timeout_ms")
    if timeout_ms < _SLOW_ANSWER_MS:
        said = Text.of("check.sdo_timeout_short", time=timeout_ms)
        report.warning(key, said, Text.of("check.at_least", least=_SLOW_ANSWER_MS))
    elif life and timeout_ms > _SDO_LIVES * life:
        report.warning(
            key,
            Text.of("check.sdo_timeout_long", time=timeout_ms, life=life),
            Text.of("check.sdo_timeout_advice", most=_SDO_LIVES * life),
        )


def _check_controller(bus: CheckedBus, drive: CheckedDrive, report: LintReport) -> None:
    timeout_ms = drive.table.fieldbus_timeout_ms
    if not timeout_ms or drive.table.control == "none":
        return
    key = (*drive.key, "fieldbus_timeout_ms")
    period_ms = 1000 * bus.table.rpdo_period_s
    if timeout_ms < 2 * period_ms:
        report.error(
            key,
            Text.of("check.timeout_short", time=timeout_ms, period=period_ms),
            Text.of("check.at_least", least=2 * period_ms),
        )
    elif bus.table.deadman_ms > timeout_ms:
        report.warning(
            key,
            Text.of("check.timeout_below_deadman", time=timeout_ms, deadman=bus.table.deadman_ms),
            Text.of("check.deadman_advice", least=bus.table.deadman_ms),
        )


def _check_life_sign(drive: CheckedDrive, report: LintReport) -> None:
    table = drive.table
    left_ms = (table.fieldbus_timeout_ms or 0) - LIFE_SIGN_MS
    if not table.life_sign or not 0 < left_ms < _ROUND_TRIP_MS:
        return
    report.warning(
        (*drive.key, "fieldbus_timeout_ms"),
        Text.of("check.life_sign", left=left_ms, old=LIFE_SIGN_MS, most=_ROUND_TRIP_MS),
        Text.of("check.at_least", least=LIFE_SIGN_MS + _ROUND_TRIP_MS),
    )


def _check_range(drive: CheckedDrive, report: LintReport) -> None:
    """Check the range within which the owner may set its time-out."""
    table, key = drive.table, (*drive.key, "fieldbus_timeout_range_ms")
    if table.fieldbus_timeout_range_ms is None or table.control == "none":
        return
    low, high = table.timeout_range_ms
    if not table.fieldbus_timeout_writable:
        report.warning(key, Text.of("check.range_fixed"), Text.of("check.range_fixed_advice"))
        return
    if low == 0:
        report.warning(key, Text.of("check.range_from_0"), Text.of("check.range_from_0_advice"))
    own_ms = table.fieldbus_timeout_ms
    if own_ms and not low <= own_ms <= high:
        said = Text.of("check.range_without_own", low=low, high=high, time=own_ms)
        report.warning(key, said, Text.of("check.range_without_own_advice"))


def _check_held(bus: CheckedBus, drive: CheckedDrive, report: LintReport) -> None:
    """Check that a SYNC still makes the stop effective when controller and bridge fail together."""
    table, rpdo = drive.table, drive.rpdos[0]
    kind, sync_ms, timeout_ms = rpdo.transmission_type, bus.table.sync_period_ms, table.fieldbus_timeout_ms
    if not timeout_ms or table.control == "none" or table.telegram_downtime_s == IGNORE_ALL_S:
        return
    if not table.reaction.sends_stop:
        return
    if kind > LAST_SYNCHRONOUS or not sync_ms or held_s(bus.table, kind):
        return
    least_ms = least_deadman_ms(bus.table, kind)
    advice = Text.of("check.stop_waits_advice")
    if least_ms <= min(timeout_ms, _LONGEST_DEADMAN_MS):
        advice = Text.of("check.stop_waits_deadman_advice", deadman=least_ms)
    time_ms = max(1, kind) * sync_ms
    report.warning(
        rpdo.type_key or drive.key,
        Text.of(
            "check.stop_waits_for_sync", pdo=rpdo.name, type=kind, time=time_ms, deadman=bus.table.deadman_ms
        ),
        advice,
    )


def _check_downtime(bus: CheckedBus, node: CheckedNode, drive: CheckedDrive, report: LintReport) -> None:
    """Check that ``telegram_downtime_s`` exceeds the time after which the TPDO is late (``command.link``)."""
    downtime_s = drive.table.telegram_downtime_s
    key = (*drive.key, "telegram_downtime_s")
    tpdo = drive.tpdos[0]
    deadline_s = tpdo_deadline_s(
        tpdo.transmission_type, tpdo.event_ms, bus.table.sync_period_ms, tpdo.rtr_poll_ms
    )
    given_ms = drive.table.tpdo_deadline_ms
    if given_ms is not None:
        deadline_s = given_ms / 1000 or None
    if downtime_s <= 0:
        if downtime_s == 0 and node.table.supervision == "none":
            report.warning(key, Text.of("check.nobody_notices"))
        return
    if deadline_s is None:
        if given_ms == 0:
            report.warning(key, Text.of("check.tpdo_never_late"), Text.of("check.leave_one_out"))
        elif node.dictionary or drive.table.tpdo:
            said = Text.of("check.tpdo_on_change", pdo=tpdo.name)
            report.warning(key, said, Text.of("check.tpdo_on_change_advice"))
    elif downtime_s < deadline_s:
        report.warning(
            key,
            Text.of("check.downtime_short", time=downtime_s, pdo=tpdo.name, late=deadline_s),
            Text.of("check.downtime_advice", least=deadline_s),
        )


def _lacks(family: str, objects: Sequence[str]) -> Text:
    """Text on missing ``objects``, one or two that supervision needs."""
    if len(objects) == 1:
        return Text.of("check.no_error_control", family=family, object=objects[0])
    return Text.of("check.no_guarding", family=family, object=objects[0], other=objects[1])
