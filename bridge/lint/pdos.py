"""PDOs that a node would refuse, or not evaluate."""

from __future__ import annotations

from typing import Final

from bridge.canopen import cobid
from bridge.canopen.sync import LAST_SYNCHRONOUS, REMOTE_TYPES
from bridge.lint.bus import BusView, DriveView, NodeView, PdoView
from bridge.lint.report import LintReport
from bridge.mapping.model import Family

_MOST_BYTES: Final = 8
_FIRST_EVENT: Final = 254


def check_pdos(bus: BusView, report: LintReport) -> None:
    for node in bus.nodes:
        for pdo in node.pdos:
            _check_identifier(pdo, report)
            _check_type(node.family, pdo, report)
        for drive in node.drives:
            _check_drive(bus, node, drive, report)


def _check_identifier(pdo: PdoView, report: LintReport) -> None:
    if pdo.enabled and not cobid.is_for_pdos(pdo.cob_id):
        report.error(
            pdo.cob_id_key or pdo.key,
            f"{pdo.name} cannot have COB-ID {pdo.cob_id:X}h: it is none of those for PDOs",
            "181h…57Fh or 680h…6DFh",
        )


def _check_type(family: Family, pdo: PdoView, report: LintReport) -> None:
    """A transmission type that the site sets; a factory setting is not ours to judge."""
    kind, forbidden = pdo.transmission_type, family.process.forbidden_types
    if pdo.type_key is None:
        return
    if LAST_SYNCHRONOUS < kind < REMOTE_TYPES[0]:
        why = "241…251 are reserved"
    elif pdo.receives and kind in REMOTE_TYPES:
        why = "252 and 253 are for TPDOs sent on request"
    elif kind in forbidden:
        why = f"{family.family.name} does not have {', '.join(map(str, forbidden))}"
    else:
        return
    events = " or ".join(str(one) for one in (_FIRST_EVENT, _FIRST_EVENT + 1) if one not in forbidden)
    hint = f"0…240, with SYNC, or {events}, with each change" if events else "0…240, with SYNC"
    report.error(pdo.type_key, f"{pdo.name} cannot have type {kind}: {why}", hint)


def _check_drive(bus: BusView, node: NodeView, drive: DriveView, report: LintReport) -> None:
    family = node.family
    for pdo in (*drive.rpdos, *drive.tpdos):
        length = 2 * pdo.words
        if pdo.is_optional and not pdo.enabled:
            continue
        if not pdo.enabled:
            is_downloaded = pdo.cob_id_key is not None and pdo.cob_id_key[: len(pdo.key)] != pdo.key
            key = pdo.cob_id_key if pdo.cob_id_key and is_downloaded else (*pdo.key, "enable")
            report.error(key, f"{pdo.name} is off: {drive.name} has no process data without it")
        if pdo.length > _MOST_BYTES:
            report.error(pdo.key, f"{pdo.name} has {pdo.length} bytes, a PDO has at most {_MOST_BYTES}")
        elif pdo.receives and family.process.exact_length and pdo.length != length:
            report.error(
                (*pdo.key, "mapping"),
                f"{pdo.name} has {pdo.length} bytes; {family.family.name} evaluates only {length}",
                f"{pdo.words} words of 16 bits",
            )
        if pdo.transmission_type in (*range(1, 241), 252) and not bus.sync_s:
            report.error(
                (*pdo.key, "transmission_type"),
                f"{pdo.name} waits for SYNC (type {pdo.transmission_type}), and the bus has none",
                "254, or a sync_period_ms",
            )
        if pdo.inhibit_ms and 0 < pdo.event_ms < pdo.inhibit_ms:
            report.warning(
                (*pdo.key, "event_ms"),
                f"{pdo.event_ms} ms is shorter than the inhibit time of {pdo.inhibit_ms:g} ms",
            )
