"""``parameters backup``, ``compare``, ``restore``: all that can be set of a drive."""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated

import typer

from bridge.base import clock
from bridge.base.errors import FileFaults, OperationFailed
from bridge.cli.bus_runner import AsJson, print_table, tell
from bridge.cli.parameter_drive import DriveArgument, Force, SiteArgument, Target, Yes, find
from bridge.cli.parameter_sets import read_all, write_all
from bridge.image import Value
from bridge.mapping.model import Parameter
from bridge.parameter import backups
from bridge.parameter.backup_file import BackupFile
from bridge.parameter.codec import shown
from bridge.parameter.factory import DESCRIPTIONS, described
from bridge.parameter.set_file import fault_of, read_set, why_another
from bridge.text import Text

FileArgument = Annotated[Path, typer.Argument(metavar="FILE", help="a parameter set, TOML")]
Wait = Annotated[
    int, typer.Option("--wait", min=0, metavar="S", help="go on if the node answers again within S seconds")
]


def backup(
    site: SiteArgument,
    drive: DriveArgument,
    file: FileArgument,
    force: Annotated[bool, typer.Option("--force", help="overwrite FILE")] = False,
    listed: Annotated[bool, typer.Option("--listed", help="only what the mapping file lists")] = False,
    eds: Annotated[
        Path | None, typer.Option("--eds", metavar="EDS", help="also read what this device file describes")
    ] = None,
    wait: Wait = 60,
    as_json: AsJson = False,
) -> None:
    """Read all settings of a drive, and write them to FILE."""
    target = find(site, drive)
    if file.exists() and not force:
        raise typer.BadParameter(f"{file} exists already: --force overwrites it")
    also = described(eds, target.access.names) if eds else []
    began = clock.now()
    found = read_all(target, wait, also, scan=not listed)
    took_s = clock.now() - began
    saved = datetime.now(UTC).isoformat(timespec="seconds")
    entries = {entry.name: entry for entry in backups.settings(target.access.names)}
    left_out = backups.left_out(target.access.names, on_first=target.access.on_first)
    comments = {name: _comment(entries[name].definition) for name in found.values}
    content = BackupFile(
        target.node.mapping,
        target.name,
        saved,
        found.values,
        comments,
        found.missing,
        found.identity,
        found.objects,
        found.unreadable,
        left_out=left_out,
    )
    try:
        file.write_text(content.text(), encoding="utf-8")
    except OSError as error:
        raise OperationFailed(f"{file}: {error.strerror or error}") from None
    if as_json:
        facts = {"parameters": found.values, "objects": found.objects, "missing": found.missing}
        facts |= {"unreadable": found.unreadable, "identity": found.identity, "left_out": left_out}
        print(json.dumps({"ok": True, **facts, "seconds": round(took_s, 1)}))
        return
    for name, why in found.unreadable.items():
        tell(f"not read: {name}: {why}")
    for why in left_out.values():
        tell(f"left out: {why}")
    missing = f"; the drive does not have {len(found.missing)} others" if found.missing else ""
    count = len(found.values) + len(found.objects)
    print(f"{count} parameters of {target.name} in {file}, read in {took_s:.0f} s{missing}")


def compare(
    site: SiteArgument,
    drive: DriveArgument,
    file: FileArgument,
    other: Annotated[
        Path | None, typer.Option("--with", metavar="OTHER", help="a file in place of the drive")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Compare FILE with the drive, or with another file; exit code 1 where they differ."""
    target = find(site, drive)
    content = content_for(target, file)
    if other is None:
        found = differences(target, content.all)
    else:
        found = backups.Comparison()
        names, second = target.access.names, content_for(target, other)
        backups.compare_sets(names, second.all, content.all, found)
    print_comparison(target, found, as_json, str(other) if other else "")
    if found.differences or found.missing:
        raise typer.Exit(OperationFailed.exit_code)


def restore(
    site: SiteArgument,
    drive: DriveArgument,
    file: FileArgument,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="only say what would be written")] = False,
    yes: Yes = False,
    force: Force = False,
    wait: Wait = 60,
    as_json: AsJson = False,
) -> None:
    """Write FILE to the drive where it differs, in the order of the mapping file, and read it back."""
    target = find(site, drive)
    if file.suffix.lower() in DESCRIPTIONS:
        raise typer.BadParameter(
            "a device description is no backup: have the drive load its factory settings"
        )
    content = content_for(target, file)
    identity: dict[str, int] = {}
    target.run(lambda now: backups.identify(identity))
    refuse_another(file, content, identity)
    serial = content.identity.get("serial")
    if serial != identity.get("serial") and serial is not None:
        tell(f"{target.name} has the serial number {identity.get('serial', 'unknown')}, the file {serial}")
    asks = not yes and sys.stdin.isatty()
    found = differences(target, content.all)
    if dry_run or asks:
        print_comparison(target, found, as_json)
        if dry_run or not found.differences:
            return
    changed = [one.entry for one in found.differences]
    if not force:
        target.refuse_unforced(changed)
    if asks and not typer.confirm(f"write {len(changed)} parameters of {target.name}?", err=True):
        raise OperationFailed("nothing written")
    standstill = target.alone(force=force, whole=bool(changed))
    target.run(lambda now: standstill.check(changed))
    done = backups.Restored()
    try:
        write_all(target, content.all, identity, done, standstill.gate, wait)
    except OperationFailed:
        print_restored(target, done)
        raise
    for warning in (one.warning for one in done.written if one.warning):
        tell(f"warning: {warning}")
    if done.warning:
        tell(f"warning: {done.warning}")
    if as_json:
        print(json.dumps(restored_facts(done)))
    else:
        print_restored(target, done)
    if done.error:
        raise OperationFailed(
            f"{target.name}: {done.error}; it ended there: {len(done.written)} written, "
            f"{len(done.left)} not reached"
        )


def content_for(target: Target, file: Path) -> BackupFile:
    """A file that fits this drive, or the factory settings of a device description. Raises ``FileFaults``
    where it does not fit."""
    return read_set(file, target.access.names, target.node.mapping, target.name, target.node.id)


def refuse_another(file: Path, content: BackupFile, identity: Mapping[str, int]) -> None:
    """Raises ``FileFaults`` where the file is of another kind of node than has told ``identity``."""
    if found := why_another(content.identity, identity):
        name, why = found
        said = Text.of("set_file.nothing_written", why=why)
        raise FileFaults([fault_of(file, content, name, said, Text.of("set_file.other_node_advice"))])


def differences(target: Target, values: Mapping[str, Value]) -> backups.Comparison:
    found = backups.Comparison()
    target.run(lambda now: backups.compare(target.access, values, found, now))
    return found


def print_comparison(target: Target, found: backups.Comparison, as_json: bool, other: str = "") -> None:
    if as_json:
        differences = [
            {"name": one.entry.name, "in_drive": one.in_drive, "in_file": one.in_set, "unit": one.entry.unit}
            for one in found.differences
        ]
        same = not found.differences and not found.missing
        facts = {"ok": same, "same": len(found.same), "differences": differences, "missing": found.missing}
        print(json.dumps(facts))
        return
    if found.differences:
        rows = [
            (one.entry.name, shown(one.entry, one.in_drive), shown(one.entry, one.in_set))
            for one in found.differences
        ]
        print_table([("name", f"in {other or 'the drive'}", "in the file"), *rows])
    for name in found.missing:
        print(f"{name}: {other or 'the drive'} does not have it")
    print(f"{target.name}: {len(found.differences)} differ, {len(found.same)} are the same")


def print_restored(target: Target, done: backups.Restored) -> None:
    for one in done.written:
        was = "" if one.before is None else f", was {shown(one.reading.entry, one.before)}"
        print(f"{one.reading}{was}")
    for name in done.missing:
        print(f"{name}: the drive does not have it")
    for name in done.read_only:
        print(f"{name}: the drive says that it is read-only")
    print(f"{target.name}: {len(done.written)} written, {len(done.same)} were the same")


def restored_facts(done: backups.Restored) -> dict[str, object]:
    return {
        "ok": done.error is None,
        "written": [
            {"name": one.reading.entry.name, "value": one.reading.value, "before": one.before}
            for one in done.written
        ],
        "same": len(done.same),
        "missing": done.missing,
        "read_only": done.read_only,
        "failed": done.failed or None,
        "message": str(done.error or ""),
        "left": done.left,
    }


def _comment(definition: Parameter | None) -> str:
    if definition is None:
        return ""
    unit = f"{definition.unit}, " if definition.unit else ""
    return f"{unit}{definition.title}"
