"""PDOs that a node would not evaluate."""

from __future__ import annotations

from typing import Final

from bridge.lint.bus import BusView, DriveView, NodeView
from bridge.lint.report import LintReport

_MOST_BYTES: Final = 8


def check_pdos(bus: BusView, report: LintReport) -> None:
    for node in bus.nodes:
        for drive in node.drives:
            _check_drive(bus, node, drive, report)


def _check_drive(bus: BusView, node: NodeView, drive: DriveView, report: LintReport) -> None:
    family = node.family
    for pdo in (*drive.rpdos, *drive.tpdos):
        length = 2 * pdo.words
        if pdo.is_optional and not pdo.enabled:
            continue
        if not pdo.enabled:
            report.error(
                (*pdo.key, "enable"), f"{pdo.name} is off: {drive.name} has no process data without it"
            )
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
