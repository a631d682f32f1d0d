"""Check for PDOs that a node would refuse, or not evaluate."""

from __future__ import annotations

from collections.abc import Container
from typing import Final

from bridge.canopen import cobid
from bridge.canopen.sync import LAST_SYNCHRONOUS, REMOTE_TYPES
from bridge.lint.checked_bus import CheckedBus, CheckedDrive, CheckedNode, CheckedPdo
from bridge.lint.report import LintReport
from bridge.mapping.model import Family
from bridge.text import Text

_MOST_BYTES: Final = 8
_FIRST_EVENT: Final = 254


def check_pdos(bus: CheckedBus, report: LintReport) -> None:
    for node in bus.nodes:
        for pdo in node.pdos:
            _check_identifier(pdo, report)
            _check_type(node.family, pdo, report)
        for drive in node.drives:
            _check_drive(bus, node, drive, report)


def _check_identifier(pdo: CheckedPdo, report: LintReport) -> None:
    if pdo.enabled and not cobid.is_for_pdos(pdo.cob_id):
        report.error(
            pdo.cob_id_key or pdo.key,
            Text.of("check.no_pdo_cob_id", pdo=pdo.name, cob_id=pdo.cob_id),
            Text.of("check.pdo_cob_ids"),
        )


def _check_type(family: Family, pdo: CheckedPdo, report: LintReport) -> None:
    """Judge a transmission type that the site sets; factory settings are not judged."""
    kind, forbidden = pdo.transmission_type, family.process.forbidden_types
    if pdo.type_key is None:
        return
    if LAST_SYNCHRONOUS < kind < REMOTE_TYPES[0]:
        why = Text.of("check.type_reserved")
    elif pdo.receives and kind in REMOTE_TYPES:
        why = Text.of("check.type_on_request")
    elif kind in forbidden:
        types = ", ".join(map(str, forbidden))
        why = Text.of("check.type_unknown", family=family.family.name, types=types)
    else:
        return
    said = Text.of("check.pdo_type", pdo=pdo.name, type=kind, why=why)
    report.error(pdo.type_key, said, _types_instead(forbidden))


def _types_instead(forbidden: Container[int]) -> Text:
    events = [one for one in (_FIRST_EVENT, _FIRST_EVENT + 1) if one not in forbidden]
    if len(events) > 1:
        return Text.of("check.type_events_advice", event=events[0], other=events[1])
    if events:
        return Text.of("check.type_advice", event=events[0])
    return Text.of("check.type_sync_advice")


def _check_drive(bus: CheckedBus, node: CheckedNode, drive: CheckedDrive, report: LintReport) -> None:
    family = node.family
    for pdo in (*drive.rpdos, *drive.tpdos):
        length = 2 * pdo.words
        if pdo.is_optional and not pdo.enabled:
            continue
        if not pdo.enabled:
            is_downloaded = pdo.cob_id_key is not None and pdo.cob_id_key[: len(pdo.key)] != pdo.key
            key = pdo.cob_id_key if pdo.cob_id_key and is_downloaded else (*pdo.key, "enable")
            report.error(key, Text.of("check.pdo_off", pdo=pdo.name, drive=drive.name))
        if pdo.length > _MOST_BYTES:
            said = Text.of("check.pdo_long", pdo=pdo.name, length=pdo.length, most=_MOST_BYTES)
            report.error(pdo.key, said)
        elif pdo.receives and family.process.exact_length and pdo.length != length:
            report.error(
                (*pdo.key, "mapping"),
                Text.of(
                    "check.pdo_length",
                    pdo=pdo.name,
                    length=pdo.length,
                    family=family.family.name,
                    wanted=length,
                ),
                Text.of("check.pdo_length_advice", words=pdo.words),
            )
        if pdo.transmission_type in (*range(1, 241), 252) and not bus.sync_s:
            report.error(
                (*pdo.key, "transmission_type"),
                Text.of("check.pdo_without_sync", pdo=pdo.name, type=pdo.transmission_type),
                Text.of("check.pdo_without_sync_advice"),
            )
        if pdo.inhibit_ms and 0 < pdo.event_ms < pdo.inhibit_ms:
            report.warning(
                (*pdo.key, "event_ms"),
                Text.of("check.event_short", time=pdo.event_ms, inhibit=pdo.inhibit_ms),
            )
