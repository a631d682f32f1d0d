"""Times that cannot work together."""

from __future__ import annotations

from typing import Final

from bridge.canopen.sync import LAST_SYNCHRONOUS, tpdo_deadline_s
from bridge.config import IGNORE_ALL_S, LIFE_SIGN_MS
from bridge.lint.bus import BusView, DriveView, NodeView
from bridge.lint.report import LintReport
from bridge.node.process.held import held_s, least_deadman_ms

_SLOW_ANSWER_MS: Final = 50
"""How long an SDO answer may take: 30 + 20 ms in an 8400 motec (EDS84DMOTCAN 3.0 §9), 50 ms and more behind
NORD's system bus."""
_SDO_LIVES: Final = 10
_ROUND_TRIP_MS: Final = 500
"""Of a life sign's token: some 200 ms until an OPC UA or zenoh client is told of it (at once where a Modbus
client reads it), a program that reads and writes every 100 ms, and the network."""
_LONGEST_DEADMAN_MS: Final = 10_000


def check_times(bus: BusView, report: LintReport) -> None:
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


def life_ms(node: NodeView) -> int:
    """After how long a silent node is lost; 0 where nothing watches it."""
    table = node.table
    factors = {"heartbeat": 1, "guarding": table.life_time_factor, "none": 0}
    return table.supervision_ms * factors[table.supervision]


def _check_supervision(bus: BusView, node: NodeView, report: LintReport) -> None:
    table, dictionary = node.table, node.dictionary
    objects = {"heartbeat": (0x1017,), "guarding": (0x100C, 0x100D), "none": ()}[table.supervision]
    missing = [f"{index:04X}h" for index in objects if dictionary and not dictionary.object(index)]
    if missing:
        other = "guarding" if table.supervision == "heartbeat" else "heartbeat"
        report.error(
            (*node.key, "supervision"),
            f"{node.family.family.name} has no {' and no '.join(missing)}",
            f'{table.supervision} is not possible; "{other}" or "none" may be',
        )
    if table.supervision == "none":
        return
    if table.supervision == "guarding" and table.life_time_factor == 1:
        message = "is 1: a single lost frame counts as a lost node"
        report.warning((*node.key, "life_time_factor"), message, "at least 2")
    if table.supervision_ms < 2 * bus.table.sync_period_ms:
        report.warning(
            (*node.key, "supervision_ms"),
            f"{table.supervision_ms} ms is less than two SYNC periods: a full cycle delays a sign of life "
            "by one",
            f"at least {2 * bus.table.sync_period_ms}",
        )


def _check_sdo(node: NodeView, report: LintReport) -> None:
    timeout_ms, life = node.table.sdo_timeout_ms, life_ms(node)
    key = (*node.key, "sdo_timeout_ms")
    if timeout_ms < _SLOW_ANSWER_MS:
        message = f"{timeout_ms} ms is shorter than drives take for some parameters"
        report.warning(key, message, f"at least {_SLOW_ANSWER_MS}")
    elif life and timeout_ms > _SDO_LIVES * life:
        report.warning(
            key,
            f"{timeout_ms} ms: the node counts as lost after {life} ms, long before this time-out ends",
            f"at most {_SDO_LIVES * life}, or a longer supervision_ms",
        )


def _check_controller(bus: BusView, drive: DriveView, report: LintReport) -> None:
    timeout_ms = drive.table.fieldbus_timeout_ms
    if not timeout_ms or drive.table.control == "none":
        return
    key = (*drive.key, "fieldbus_timeout_ms")
    period_ms = 1000 * bus.table.rpdo_period_s
    if timeout_ms < 2 * period_ms:
        report.error(
            key,
            f"{timeout_ms} ms is less than two RPDO periods of {period_ms:g} ms: one lost frame is a trip",
            f"at least {2 * period_ms:g}",
        )
    elif bus.table.deadman_ms > timeout_ms:
        report.warning(
            key,
            f"{timeout_ms} ms is shorter than deadman_ms = {bus.table.deadman_ms}: a drive would run on for "
            "longer after a hang of the bridge than after its controller fell silent",
            f"at least {bus.table.deadman_ms}, or a shorter deadman_ms",
        )


def _check_life_sign(drive: DriveView, report: LintReport) -> None:
    table = drive.table
    left_ms = (table.fieldbus_timeout_ms or 0) - LIFE_SIGN_MS
    if not table.life_sign or not 0 < left_ms < _ROUND_TRIP_MS:
        return
    report.warning(
        (*drive.key, "fieldbus_timeout_ms"),
        f"leaves {left_ms} ms for a token of the life sign: it may be {LIFE_SIGN_MS} ms old when it is read, "
        f"and reading it, the program's cycle and writing it back take up to {_ROUND_TRIP_MS} ms",
        f"at least {LIFE_SIGN_MS + _ROUND_TRIP_MS}",
    )


def _check_range(drive: DriveView, report: LintReport) -> None:
    """The range within which the owner may set its time-out."""
    table, key = drive.table, (*drive.key, "fieldbus_timeout_range_ms")
    if table.fieldbus_timeout_range_ms is None or table.control == "none":
        return
    low, high = table.timeout_range_ms
    if not table.fieldbus_timeout_writable:
        message = "has no effect: the owner may not set its time-out"
        report.warning(key, message, "fieldbus_timeout_writable = true, or leave it out")
        return
    if low == 0:
        message = "begins with 0: the owner may switch off the time-out that stops its drive"
        report.warning(key, message, "at least 1, better two RPDO periods and more")
    own_ms = table.fieldbus_timeout_ms
    if own_ms and not low <= own_ms <= high:
        message = f"{low}…{high} ms does not include the site's own fieldbus_timeout_ms = {own_ms}"
        report.warning(key, message, "a range that does: an owner that changed it cannot set it back")


def _check_held(bus: BusView, drive: DriveView, report: LintReport) -> None:
    """Whether a SYNC still makes the stop effective when controller and bridge fail together."""
    table, rpdo = drive.table, drive.rpdos[0]
    kind, sync_ms, timeout_ms = rpdo.transmission_type, bus.table.sync_period_ms, table.fieldbus_timeout_ms
    if not timeout_ms or table.control == "none" or table.telegram_downtime_s == IGNORE_ALL_S:
        return
    if table.on_expiry in ("hold", "silence"):
        return
    if kind > LAST_SYNCHRONOUS or not sync_ms or held_s(bus.table, kind):
        return
    least_ms = least_deadman_ms(bus.table, kind)
    longer = f", or deadman_ms = {least_ms}" if least_ms <= min(timeout_ms, _LONGEST_DEADMAN_MS) else ""
    report.warning(
        rpdo.type_key or drive.key,
        f"{rpdo.name} of type {kind} waits for SYNC for up to {max(1, kind) * sync_ms} ms: with deadman_ms = "
        f"{bus.table.deadman_ms} no SYNC makes the stop effective if bridge and controller fail together; "
        "then only the drive's own time-out stops it",
        f"type 254 or 255, a shorter sync_period_ms{longer}",
    )


def _check_downtime(bus: BusView, node: NodeView, drive: DriveView, report: LintReport) -> None:
    """``telegram_downtime_s`` must exceed the time after which the TPDO is late (``command.link``)."""
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
            message = "is 0, and the node is not supervised: nobody would notice a lost drive"
            report.warning(key, message)
        return
    if deadline_s is None:
        if given_ms == 0:
            message = "has no effect: tpdo_deadline_ms = 0 says that the TPDO is never late"
            report.warning(key, message, "leave one of the two out")
        elif node.dictionary or drive.table.tpdo:
            message = f"has no effect: {tpdo.name} is sent only when a value changes"
            report.warning(key, message, "an event_ms, or a synchronous transmission type")
    elif downtime_s < deadline_s:
        report.warning(
            key,
            f"{downtime_s:g} s is shorter than the pauses of {tpdo.name}, which is late only after "
            f"{deadline_s:.3g} s",
            f"at least {deadline_s:.3g}, or a shorter event_ms or transmission type",
        )
