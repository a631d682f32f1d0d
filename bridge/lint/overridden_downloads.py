"""Downloads that the bridge's own settings undo: the node is written twice in each boot-up and ends up with
another value than the configuration's. And nodes that wait for a heartbeat or a SYNC that never comes."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from bridge.canopen import cobid
from bridge.config import NodeTable, PdoTable
from bridge.lint.checked_bus import CheckedBus, CheckedNode
from bridge.lint.node_downloads import RPDO, TPDO, pdo_cob_id
from bridge.lint.report import LintReport
from bridge.node.boot import heartbeat_period_ms
from bridge.text import Text, Words

_CONSUMER: Final = 0x1016
_SYNC: Final = (0x1005, 0)
_SYNC_BITS: Final = 0x7FFF_FFFF
"""Bits of 1005h that count: bit 31 has no meaning (CiA 301 §7.5.2.5), bit 30 makes the node a producer of
SYNC."""
_COB_ID: Final = 1


def check_contradictions(bus: CheckedBus, report: LintReport) -> None:
    for node in bus.nodes:
        for (index, sub), value, why in _own_settings(node):
            number = "{:X}h".format if _is_cob_id(index, sub) else str
            name, hint = f"{index:04X}h:{sub:02X}", Text.of("check.leave_it_out_advice", key=why)
            setting, related = node.settings[index, sub], node.settings.related.get((index, sub))
            if related is not None:
                told = Text.of("check.decided_too", parameter=related.name, object=name, value=number(value))
                report.warning(related.key, told, hint)
            if setting is None:
                continue
            given = pdo_cob_id(setting.value) if _is_cob_id(index, sub) else setting.value
            if given != value:
                told = Text.of("check.undone", object=name, given=number(given), value=number(value))
                if setting.name:
                    told = Text.of(
                        "check.undone_named",
                        parameter=setting.name,
                        object=name,
                        given=number(given),
                        value=number(value),
                    )
                report.warning(setting.key, told, hint)
        _check_consumer(bus, node, report)
        _check_sync(node, report)


def _is_cob_id(index: int, sub: int) -> bool:
    return index >= RPDO[0] and sub == _COB_ID


def _own_settings(node: CheckedNode) -> Iterator[tuple[tuple[int, int], int, Words]]:
    """Settings of the boot-up after the configuration: object, value, and the key that causes it."""
    for index, value in _error_control(node.table).items():
        yield (index, 0), value, "supervision"
    slots = {slot.name: slot for slot in node.family.slot}
    for drive in node.drives:
        slot = slots[drive.table.slot]
        for (base, _), tables, pdos, name in (
            (RPDO, drive.table.rpdo, slot.rpdo, "rpdo"),
            (TPDO, drive.table.tpdo, slot.tpdo, "tpdo"),
        ):
            for own in tables:
                number = pdos[0].number if own.number is None else own.number
                for sub, value in _pdo_settings(own):
                    key = Text.of("check.key_of_drive", key=name, drive=drive.name)
                    yield (base + number - 1, sub), value, key


def _error_control(table: NodeTable) -> dict[int, int]:
    """1017h, 100Ch and 100Dh as ``boot.error_control`` sets them: one of the two kinds is off."""
    guarding = table.supervision == "guarding"
    return {
        0x1017: heartbeat_period_ms(table.supervision_ms) if table.supervision == "heartbeat" else 0,
        0x100C: table.supervision_ms if guarding else 0,
        0x100D: table.life_time_factor if guarding else 0,
    }


def _pdo_settings(own: PdoTable) -> Iterator[tuple[int, int]]:
    inhibit_100us = None if own.inhibit_ms is None else round(10 * own.inhibit_ms)
    for sub, value in (
        (_COB_ID, own.cob_id),
        (2, own.transmission_type),
        (3, inhibit_100us),
        (5, own.event_ms),
    ):
        if value is not None:
            yield sub, value


def _check_consumer(bus: CheckedBus, node: CheckedNode, report: LintReport) -> None:
    """1016h: node id in bits 16…22, consumer time in ms below (CiA 301, object 1016h). Other nodes'
    heartbeats are the site's own business; only that such a node exists is checked."""
    heartbeats = {
        other.table.id: heartbeat_period_ms(other.table.supervision_ms)
        for other in bus.nodes
        if other.table.supervision == "heartbeat"
    }
    if bus.table.heartbeat_ms:
        heartbeats[bus.table.master_node_id] = bus.table.heartbeat_ms
    for sub, setting in node.settings.of(_CONSUMER):
        node_id, time_ms = setting.value >> 16 & 0x7F, setting.value & 0xFFFF
        if not sub or not node_id or not time_ms:
            continue
        name = f"{_CONSUMER:04X}h:{sub:02X}"
        period_ms = heartbeats.get(node_id)
        if period_ms is None:
            report.warning(setting.key, Text.of("check.no_heartbeat", object=name, node=node_id))
        elif time_ms <= period_ms:
            told = Text.of("check.heartbeat_slow", object=name, time=time_ms, node=node_id, period=period_ms)
            if node_id == bus.table.master_node_id:
                told = Text.of("check.own_heartbeat_slow", object=name, time=time_ms, period=period_ms)
            report.warning(setting.key, told, Text.of("check.at_least", least=2 * period_ms))


def _check_sync(node: CheckedNode, report: LintReport) -> None:
    """A synchronous PDO waits for the SYNC whose identifier is in 1005h: with any other a stop would never
    become effective."""
    waiting = [pdo.name for pdo in node.pdos if pdo.enabled and pdo.is_synchronous]
    if not waiting:
        return
    waits = Text.of("check.pdo_waits_for_sync", pdo=waiting[0], sync=cobid.SYNC)
    if len(waiting) > 1:
        waits = Text.of("check.pdos_wait_for_sync", pdos=tuple(waiting), sync=cobid.SYNC)
    setting, related = node.settings[_SYNC], node.settings.related.get(_SYNC)
    hint = Text.of("check.sync_advice", sync=cobid.SYNC)
    at_factory = node.dictionary.number(*_SYNC, node.table.id) if node.dictionary else None
    value = at_factory if setting is None else setting.value
    if value is not None and value & _SYNC_BITS != cobid.SYNC:
        if setting is None:
            told = Text.of("check.other_sync_at_factory", value=value, waits=waits)
        elif setting.name:
            told = Text.of("check.other_sync_named", parameter=setting.name, value=value, waits=waits)
        else:
            told = Text.of("check.other_sync", value=value, waits=waits)
        report.error(setting.key if setting else node.key, told, hint)
    if related is not None and related.value & _SYNC_BITS != cobid.SYNC:
        told = Text.of("check.other_sync_decided", parameter=related.name, waits=waits)
        report.warning(related.key, told, hint)
