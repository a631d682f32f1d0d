"""``exchange``: a new device takes the place of an old one, with its settings, and is proven to stop."""

from __future__ import annotations

import getpass
import json
import socket
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Any

import typer

from bridge.base.errors import OperationFailed
from bridge.bustools.open_channels import OpenChannels
from bridge.catalogue import Catalogue
from bridge.cli import drop_report, drop_test_command, exchange_report
from bridge.cli.audit_command import audit_drives, audit_facts
from bridge.cli.bus_runner import AsJson, CliBus, carry_out, tell
from bridge.cli.exchange_report import DeviceExchange
from bridge.cli.parameter_backup import (
    Wait,
    content_for,
    differences,
    print_comparison,
    refuse_another,
    restored_facts,
)
from bridge.cli.parameter_drive import SiteArgument, Target, find
from bridge.cli.parameter_sets import write_all
from bridge.config import BusTable, NodeTable
from bridge.parameter import backups
from bridge.parameter.backup_file import BackupFile
from bridge.parameter.factory import DESCRIPTIONS
from bridge.project import Project, load_project
from bridge.text import render

_ALL_BITS = 0xFFFF_FFFF


@dataclass(frozen=True, slots=True)
class _ExchangeOptions:
    """Options of one call; ``wait_s`` is the time to wait for the node."""

    site: Path
    files: Sequence[Path]
    at_the_machine: bool
    same_serial: bool
    force: bool
    operator: str | None
    wait_s: float
    as_json: bool


@dataclass(frozen=True, slots=True)
class _DriveBackup:
    """One drive of the node, and the backup that it gets."""

    target: Target
    file: Path
    content: BackupFile

    @property
    def name(self) -> str:
        return self.target.name


def exchange(
    site: SiteArgument,
    node: Annotated[str, typer.Argument(metavar="NODE", help="the node's name in the site file")],
    files: Annotated[
        list[Path], typer.Argument(metavar="FILE...", help="a backup of each drive of the node, in any order")
    ],
    at_the_machine: Annotated[
        bool, typer.Option("--yes-i-am-at-the-machine", help="agree without typing the node's name")
    ] = False,
    same_serial: Annotated[
        bool, typer.Option("--same-serial", help="go on although the node's serial number is the old one")
    ] = False,
    force: Annotated[
        bool, typer.Option("--force", help="also if a drive does not tell whether it is enabled")
    ] = False,
    operator: Annotated[str | None, typer.Option(help="who signs the report; the user's name")] = None,
    wait: Wait = 60,
    as_json: AsJson = False,
) -> None:
    """After NODE was exchanged: restore its backups, save, do the drop test, audit, and write a report."""
    options = _ExchangeOptions(site, files, at_the_machine, same_serial, force, operator, wait, as_json)
    project = load_project(site)
    bus, table = drop_test_command.find_node(project, node)
    if not table.drive:
        raise typer.BadParameter(
            f"{node} is no drive: `drivebridge parameters restore` gives it its settings, and `drop-test` "
            "proves what becomes of its outputs"
        )
    places = _places(project, site, table, files)
    drop_test_command.refuse_company(project, bus, table)
    occasion, done = _begin(project, table, places, options)
    _open_channels(project, bus, node)
    for place in places:
        _restore(place, done, options)
    _save(places[0].target, done)
    facts, failure = _prove(project, bus, table, places, occasion, done)
    _report(done, facts, as_json=as_json)
    if not facts["ok"]:
        raise OperationFailed(failure or "the node has the settings, and is not proven to stop")


def _begin(
    project: Project, table: NodeTable, places: Sequence[_DriveBackup], options: _ExchangeOptions
) -> tuple[drop_report.Occasion, DeviceExchange]:
    """Judge the new device and ask for consent, then begin the exchange or go on with one."""
    identity: dict[str, int] = {}
    places[0].target.run(lambda now: backups.identify(identity))
    _judge(options.site, table, places, identity, same_serial=options.same_serial)
    consent = drop_test_command.agree(
        places[0].target.one,
        at_the_machine=options.at_the_machine,
        first=f"The settings of {table.name} are overwritten with those of the backups. ",
    )
    now = datetime.now(UTC)
    operator = options.operator or getpass.getuser()
    occasion = drop_report.Occasion(operator, socket.gethostname(), consent, now, options.site)
    state_dir = Path(project.site.site.state_dir)
    done = exchange_report.begin(state_dir, occasion, table.name, identity, options.files)
    if done.began != done.last:
        tell(f"{table.name}: goes on with what was begun at {done.began}")
    return occasion, done


def _prove(
    project: Project,
    bus: BusTable,
    table: NodeTable,
    places: Sequence[_DriveBackup],
    occasion: drop_report.Occasion,
    done: DeviceExchange,
) -> tuple[dict[str, Any], str]:
    """Do the drop test and the audit. Returns the facts of the report, and why the test has no result."""
    plant, test = drop_test_command.perform(project, bus, table)
    dropped = drop_report.facts(occasion, plant.nodes[table.name], test)
    audited = list(audit_drives(project, bus.name, [], of_node=table.name))
    facts = exchange_report.facts(
        occasion,
        done,
        table,
        _old(places),
        dropped,
        [audit_facts(one) for one in audited],
        ok=dropped["ok"] and all(one.is_ok for one in audited),
    )
    return facts, test.failure


def _report(done: DeviceExchange, facts: dict[str, Any], *, as_json: bool) -> None:
    """Write the report and print it. Raises ``OperationFailed`` where it cannot be written."""
    try:
        written = done.end(facts)
    except OSError as error:
        print(json.dumps(facts, indent=2))
        raise OperationFailed(f"the report cannot be written to {done.folder}: {error.strerror}") from None
    if as_json:
        print(json.dumps(facts | {"report_files": [str(file) for file in written]}, indent=2))
    else:
        print(exchange_report.markdown(facts))
        tell(f"report: {written[0]}, {written[1]}")


def _places(project: Project, site: Path, node: NodeTable, files: Sequence[Path]) -> list[_DriveBackup]:
    """Each drive of the node with its file. Raises ``BadParameter`` where one has none, or two."""
    family = project.families[node.mapping_key]
    targets = {
        name: find(site, name) for name in (f"{node.name}/{family.leaf_of(one)}" for one in node.drive)
    }
    found: dict[str, _DriveBackup] = {}
    for file in files:
        if file.suffix.lower() in DESCRIPTIONS:
            raise typer.BadParameter(f"{file} is a device description, and no backup")
        # The file says whose it is; all drives of a node have the same mapping.
        content = content_for(next(iter(targets.values())), file)
        if content.drive not in targets:
            raise typer.BadParameter(
                f"{file} is of {content.drive or 'no drive'}, and {node.name} has {', '.join(targets)}"
            )
        if content.drive in found:
            raise typer.BadParameter(f"{file} and {found[content.drive].file} are both of {content.drive}")
        found[content.drive] = _DriveBackup(targets[content.drive], file, content)
    if lacking := [name for name in targets if name not in found]:
        raise typer.BadParameter(f"no backup is given of {', '.join(lacking)}")
    return [found[name] for name in targets]


def _old(places: Sequence[_DriveBackup]) -> dict[str, int]:
    """Identity of the old device by the files."""
    for place in places:
        if place.content.identity:
            return dict(place.content.identity)
    return {}


def _judge(
    site: Path,
    node: NodeTable,
    places: Sequence[_DriveBackup],
    identity: dict[str, int],
    *,
    same_serial: bool,
) -> None:
    """Raises ``FileFaults`` where a file is of another kind of node, and ``OperationFailed`` unless the node
    is a new device that the site file lets be used."""
    for place in places:
        refuse_another(place.file, place.content, identity)
    # CiA 301 §7.5.2.21: 0 is no serial number.
    old, new = _old(places).get("serial", 0), identity.get("serial", 0)
    if old and old == new and not same_serial:
        raise OperationFailed(
            f"{node.name} still has the serial number {new}: it was not exchanged. If what was exchanged is "
            "a drive behind it, say --same-serial"
        )
    tell(f"{node.name}: serial number {new or 'not told'}, was {old or 'not told'}")
    wanted, mask = node.identity.serial, node.identity.serial_mask
    if wanted is not None and (wanted ^ new) & (_ALL_BITS if mask is None else mask):
        raise OperationFailed(
            f"{site} has serial = {wanted} for {node.name}, and would refuse {new}: change it there first"
        )


def _open_channels(project: Project, bus: BusTable, name: str) -> None:
    """A new interface may have only its first SDO channel open, which does not reach all of its drives."""
    node = Catalogue.of(project.site, project.families).nodes[name]
    task = carry_out(CliBus(bus, project.families, is_of_site=True), lambda now: OpenChannels(node, now))
    for note in task.notes:
        tell(f"{name}: {note}")
    if task.failure:
        raise OperationFailed(f"{name}: {task.failure}")


def _restore(place: _DriveBackup, done: DeviceExchange, options: _ExchangeOptions) -> None:
    """Show the differences, write the backup, and keep what was written also where it ends early. Raises
    ``OperationFailed``."""
    found = differences(place.target, place.content.all)
    if not options.as_json:
        print_comparison(place.target, found, as_json=False)
    target = place.target
    restored = backups.Restored(same=found.same, missing=found.missing)
    try:
        if found.differences:
            changes = [one.entry for one in found.differences]
            standstill = target.alone(force=options.force, whole=True)
            target.run(lambda now: standstill.check(changes))
            write_all(target, place.content.all, done.identity, restored, standstill.gate, options.wait_s)
    finally:
        done.keep(place.name, _facts(restored))
    tell(f"{target.name}: {len(restored.written)} written")
    if restored.error:
        raise OperationFailed(
            f"{target.name}: {restored.error}; {len(restored.left)} parameters not reached. Begin again when "
            "it is mended: what is written already is not written again"
        )


def _facts(restored: backups.Restored) -> dict[str, Any]:
    warnings = {render(one.warning) for one in restored.written if one.warning} | {restored.warning} - {""}
    return restored_facts(restored) | {"warnings": sorted(warnings)}


def _save(target: Target, done: DeviceExchange) -> None:
    """Have the node keep what was written; one that has no command for that may keep it by itself."""
    if not done.is_unsaved:
        return
    # Written is written: only a drive that is known to be enabled does not save it now.
    saved = target.save(target.alone(force=True).gate)
    if saved.why_not:
        lack = f"not saved: {saved.why_not}; switch it off and on, and compare it with the backup"
        tell(f"{target.node.name}: {lack}")
        done.saved(lack)
        return
    done.saved(render(saved.warning))
