"""``parameters backup``, ``compare``, ``restore``: all that can be set of a drive."""

from __future__ import annotations

import json
import sys
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated

import typer

from bridge.cli.bus import AsJson, print_table, tell
from bridge.cli.parameter_drive import DriveArgument, Force, SiteArgument, Target, Yes, find
from bridge.errors import OperationFailed
from bridge.image import Value
from bridge.mapping.model import Parameter
from bridge.parameter import ParameterError, backups
from bridge.parameter.backup_file import BackupFile, read_backup
from bridge.parameter.codec import shown

FileArgument = Annotated[Path, typer.Argument(metavar="FILE", help="a parameter set, TOML")]


def backup(
    site: SiteArgument,
    drive: DriveArgument,
    file: FileArgument,
    force: Annotated[bool, typer.Option("--force", help="overwrite FILE")] = False,
    as_json: AsJson = False,
) -> None:
    """Read every setting that the mapping file lists, and write them to FILE."""
    target = find(site, drive)
    if file.exists() and not force:
        raise typer.BadParameter(f"{file} exists already: --force overwrites it")
    found = backups.Backup()
    target.run(lambda now: backups.back_up(target.access, found, now))
    saved = datetime.now(UTC).isoformat(timespec="seconds")
    entries = {entry.name: entry for entry in backups.settings(target.access.names)}
    comments = {name: _comment(entries[name].definition) for name in found.values}
    content = BackupFile(target.node.mapping, target.name, saved, found.values, comments, found.missing)
    try:
        file.write_text(content.text(), encoding="utf-8")
    except OSError as error:
        raise OperationFailed(f"{file}: {error.strerror or error}") from None
    if as_json:
        print(json.dumps({"ok": True, "parameters": found.values, "missing": found.missing}))
        return
    missing = f"; the drive does not have {len(found.missing)} others" if found.missing else ""
    print(f"{len(found.values)} parameters of {target.name} in {file}{missing}")


def compare(site: SiteArgument, drive: DriveArgument, file: FileArgument, as_json: AsJson = False) -> None:
    """Compare FILE with the drive; exit code 1 where they differ."""
    target = find(site, drive)
    found = _compare(target, _values(target, file))
    _print_comparison(target, found, as_json)
    if found.differences or found.missing:
        raise typer.Exit(OperationFailed.exit_code)


def restore(
    site: SiteArgument,
    drive: DriveArgument,
    file: FileArgument,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="only say what would be written")] = False,
    yes: Yes = False,
    force: Force = False,
    as_json: AsJson = False,
) -> None:
    """Write FILE to the drive where it differs, in the order of the mapping file, and read it back."""
    target = find(site, drive)
    values = _values(target, file)
    asks = not yes and sys.stdin.isatty()
    found = _compare(target, values)
    if dry_run or asks:
        _print_comparison(target, found, as_json)
        if dry_run or not found.differences:
            return
    changed = [one.entry for one in found.differences]
    if not force:
        target.refuse_unforced(changed)
    if asks and not typer.confirm(f"write {len(changed)} parameters of {target.name}?", err=True):
        raise OperationFailed("nothing written")
    check = target.alone(force=force).check
    target.run(lambda now: check(changed))
    done = backups.Restored()
    try:
        target.run(
            lambda now: backups.restore(target.access, values, done, now, before_it=check), writes=True
        )
    except OperationFailed:
        _print_restored(target, done)
        raise
    for warning in (one.warning for one in done.written if one.warning):
        tell(f"warning: {warning}")
    if done.warning:
        tell(f"warning: {done.warning}")
    if as_json:
        print(json.dumps(_as_json(done)))
    else:
        _print_restored(target, done)
    if done.error:
        raise OperationFailed(
            f"{target.name}: {done.error}; it ended there: {len(done.written)} written, "
            f"{len(done.left)} not reached"
        )


def _values(target: Target, file: Path) -> dict[str, Value]:
    """The values of a file that fit this drive. Raises ``BadParameter`` where they do not."""
    content = read_backup(file)
    if content.mapping != target.node.mapping:
        raise typer.BadParameter(
            f"{file} is of {content.mapping}, and {target.name} has {target.node.mapping}"
        )
    values = dict(content.values)
    try:
        backups.in_order(target.access.names, values)
    except ParameterError as error:
        raise typer.BadParameter(f"{file}: {error}") from None
    return values


def _compare(target: Target, values: dict[str, Value]) -> backups.Comparison:
    found = backups.Comparison()
    target.run(lambda now: backups.compare(target.access, values, found, now))
    return found


def _print_comparison(target: Target, found: backups.Comparison, as_json: bool) -> None:
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
        print_table([("name", "in the drive", "in the file"), *rows])
    for name in found.missing:
        print(f"{name}: the drive does not have it")
    print(f"{target.name}: {len(found.differences)} differ, {len(found.same)} are the same")


def _print_restored(target: Target, done: backups.Restored) -> None:
    for one in done.written:
        was = "" if one.before is None else f", was {shown(one.reading.entry, one.before)}"
        print(f"{one.reading}{was}")
    for name in done.missing:
        print(f"{name}: the drive does not have it")
    print(f"{target.name}: {len(done.written)} written, {len(done.same)} were the same")


def _as_json(done: backups.Restored) -> dict[str, object]:
    return {
        "ok": done.error is None,
        "written": [
            {"name": one.reading.entry.name, "value": one.reading.value, "before": one.before}
            for one in done.written
        ],
        "same": len(done.same),
        "missing": done.missing,
        "failed": done.failed or None,
        "message": str(done.error or ""),
        "left": done.left,
    }


def _comment(definition: Parameter | None) -> str:
    if definition is None:
        return ""
    unit = f"{definition.unit}, " if definition.unit else ""
    return f"{unit}{definition.title}"
