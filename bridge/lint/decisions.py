"""Decisions of the site file that are allowed and still worth a reminder."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from bridge.catalogue import Catalogue
from bridge.config import IGNORE_ALL_S, DriveTable, NodeTable, Site, fits
from bridge.lint.report import LintReport
from bridge.mapping import Family
from bridge.text import Text
from bridge.tomlfile import Key


def check_decisions(site: Site, families: Mapping[str, Family], report: LintReport) -> None:
    for b, bus in enumerate(site.bus):
        for n, node in enumerate(bus.node):
            _check_commands(node, ("bus", b, "node", n), report)
            for d, drive in enumerate(node.drive):
                name = f"{node.name}/{families[node.mapping_key].leaf_of(drive)}"
                _check_drive(drive, name, ("bus", b, "node", n, "drive", d), report)
    if site.opcua and site.opcua.no_security:
        report.warning(("opcua", "no_security"), Text.of("check.anyone_reads"))
    if site.opcua and "points" in site.opcua.history.model_fields_set:
        _check_history(site.opcua.history.points, Catalogue.of(site, families), report)
    if site.zenoh and site.zenoh.no_security:
        report.warning(("zenoh", "no_security"), Text.of("check.anyone_commands"))


def _check_history(patterns: Sequence[str], catalogue: Catalogue, report: LintReport) -> None:
    for number, pattern in enumerate(patterns):
        if not any(fits(point.name, pattern) for point in catalogue.points):
            key = "opcua", "history", "points", number
            report.warning(key, Text.of("check.no_such_point", pattern=pattern))


def _check_commands(node: NodeTable, key: Key, report: LintReport) -> None:
    for c, entry in enumerate(node.configure):
        if entry.download.is_command and entry.read_back:
            report.warning(
                (*key, "configure", c),
                Text.of("check.is_command", object=entry.download.name),
                Text.of("check.is_command.hint"),
            )


def _check_drive(drive: DriveTable, name: str, key: Key, report: LintReport) -> None:
    if drive.control != "none" and drive.fieldbus_timeout_ms == 0:
        report.warning((*key, "fieldbus_timeout_ms"), Text.of("check.silence_stops_nothing", drive=name))
    if drive.telegram_downtime_s == IGNORE_ALL_S:
        report.warning((*key, "telegram_downtime_s"), Text.of("check.errors_stop_nothing", drive=name))
    if drive.reaction.holds and drive.control != "none":
        report.warning((*key, "on_expiry"), Text.of("check.silence_is_reported", drive=name))
