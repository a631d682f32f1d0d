"""Decisions of the site file that are allowed and still worth a reminder."""

from __future__ import annotations

from collections.abc import Mapping

from bridge.config import IGNORE_ALL_S, DriveTable, NodeTable, Site
from bridge.lint.report import LintReport
from bridge.mapping import Family
from bridge.tomlfile import Key


def check_decisions(site: Site, families: Mapping[str, Family], report: LintReport) -> None:
    for b, bus in enumerate(site.bus):
        for n, node in enumerate(bus.node):
            _check_commands(node, ("bus", b, "node", n), report)
            for d, drive in enumerate(node.drive):
                name = f"{node.name}/{families[node.mapping_key].leaf_of(drive)}"
                _check_drive(drive, name, ("bus", b, "node", n, "drive", d), report)
    if site.opcua and site.opcua.no_security:
        report.warning(
            ("opcua", "no_security"), "is true: anyone who reaches the port reads everything in clear text"
        )
    if site.zenoh and site.zenoh.no_security:
        report.warning(
            ("zenoh", "no_security"), "is true: anyone who reaches the port commands, under any name"
        )


def _check_commands(node: NodeTable, key: Key, report: LintReport) -> None:
    for c, entry in enumerate(node.configure):
        if entry.download.is_command and entry.read_back:
            report.warning(
                (*key, "configure", c),
                f"{entry.download.name} is a command: it never reads back as it was written",
                'read_back = false; "save" after a download is configuration_store = true',
            )


def _check_drive(drive: DriveTable, name: str, key: Key, report: LintReport) -> None:
    if drive.control != "none" and drive.fieldbus_timeout_ms == 0:
        report.warning((*key, "fieldbus_timeout_ms"), f"is 0: a silent controller will not stop {name}")
    if drive.telegram_downtime_s == IGNORE_ALL_S:
        report.warning((*key, "telegram_downtime_s"), f"is -0.1: no communication error will stop {name}")
    if drive.on_expiry == "hold" and drive.control != "none":
        report.warning((*key, "on_expiry"), f'is "hold": a silent controller of {name} is only reported')
