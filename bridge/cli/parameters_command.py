"""``parameters``: parameters of one drive by the vendor's own names."""

from __future__ import annotations

import json
import sys
from collections.abc import Generator
from typing import Annotated

import typer

from bridge.base.errors import OperationFailed
from bridge.cli import parameter_backup
from bridge.cli.bus_runner import AsJson, print_table, tell
from bridge.cli.parameter_drive import DriveArgument, Force, SiteArgument, Yes, find
from bridge.parameter import DriveParameters, ParameterEntry, ParameterError, ParameterReading, Transfer
from bridge.parameter.codec import parse, shown

app = typer.Typer(help="Read, write, save and compare parameters of a drive.", no_args_is_help=True)

_NameArgument = Annotated[
    str, typer.Argument(metavar="NAME", help="as the vendor writes it, or an object such as 2066:01")
]


@app.command("list")
def list_(site: SiteArgument, drive: DriveArgument, as_json: AsJson = False) -> None:
    """List the drive's parameters by its mapping file; the drive is not asked."""
    target = find(site, drive)
    definitions = target.access.names.definitions
    rows = [
        {
            "name": one.name,
            "title": one.title,
            "object": str(target.access.names.resolve(one.name).address),
            "type": one.data_type,
            "unit": one.unit,
            "low": one.low,
            "high": one.high,
            "access": one.access,
            "elements": one.elements,
            "sets": one.sets,
            "states": {str(code): text for code, text in one.states.items()},
        }
        for one in definitions
    ]
    if as_json:
        print(json.dumps(rows, indent=2))
        return
    heading = ("name", "object", "type", "range", "access", "elements", "sets", "title")
    cells = [
        (
            str(row["name"]),
            str(row["object"]),
            str(row["type"]),
            _range(one.low, one.high, one.unit),
            str(row["access"]),
            str(row["elements"] or ""),
            str(row["sets"] or ""),
            one.title,
        )
        for one, row in zip(definitions, rows, strict=True)
    ]
    print_table([heading, *cells])


@app.command()
def read(
    site: SiteArgument,
    drive: DriveArgument,
    names: Annotated[list[str], typer.Argument(metavar="NAME...", help="one or several names")],
    as_json: AsJson = False,
) -> None:
    """Read parameters from the drive."""
    target = find(site, drive)
    entries = [_resolve(target.access, name) for name in names]
    found: list[ParameterReading] = []
    target.run(lambda now: _read_all(target.access, entries, found, now))
    if as_json:
        print(json.dumps([_facts(target.access, reading) for reading in found], indent=2))
        return
    for reading in found:
        print(reading)


def _read_all(
    access: DriveParameters, entries: list[ParameterEntry], found: list[ParameterReading], now: float
) -> Generator[Transfer, tuple[bytes, float], None]:
    for entry in entries:
        reading = yield from access.read(entry, now)
        found.append(reading)


@app.command(context_settings={"ignore_unknown_options": True})
def write(
    site: SiteArgument,
    drive: DriveArgument,
    name: _NameArgument,
    value: Annotated[str, typer.Argument(metavar="VALUE", help="in its unit, or the text of a state")],
    yes: Yes = False,
    force: Force = False,
    as_json: AsJson = False,
) -> None:
    """Write a parameter and read it back; a value that the drive already holds is not written."""
    target = find(site, drive)
    entry = _resolve(target.access, name)
    if not force:
        target.refuse_unforced([entry])
    try:
        wanted = parse(entry, value)
    except ParameterError as error:
        raise typer.BadParameter(str(error)) from None
    if not yes and sys.stdin.isatty():
        question = f"write {shown(entry, wanted)} to {entry.name} of {target.name}?"
        if not typer.confirm(question, err=True):
            raise OperationFailed("nothing written")
    gate = target.alone(force=force).gate
    written = target.run(lambda now: target.access.write(entry, wanted, now, gate), writes=True)
    if written.warning:
        tell(f"warning: {written.warning}")
    if as_json:
        facts = {"ok": True, "changed": written.changed, "before": written.before}
        print(json.dumps(facts | _facts(target.access, written.reading)))
    else:
        was = "" if written.before is None else f", was {shown(entry, written.before)}"
        print(f"{written.reading}{was}" if written.changed else f"{written.reading} already: not written")


@app.command()
def save(
    site: SiteArgument, drive: DriveArgument, yes: Yes = False, force: Force = False, as_json: AsJson = False
) -> None:
    """Keep the parameters of the drive's node in its EEPROM."""
    target = find(site, drive)
    question = f"write the EEPROM of {target.node.name}?"
    if not yes and sys.stdin.isatty() and not typer.confirm(question, err=True):
        raise OperationFailed("nothing saved")
    gate = target.alone(force=force).gate
    saved = target.save(gate)
    if saved.warning:
        tell(f"warning: {saved.warning}")
    if as_json:
        print(json.dumps({"ok": True, "saved": not saved.why_not, "message": saved.why_not}))
    else:
        told = f"nothing saved: {saved.why_not}" if saved.why_not else "saved"
        print(f"{target.node.name}: {told}")


def _resolve(access: DriveParameters, name: str) -> ParameterEntry:
    try:
        return access.names.resolve(name)
    except ParameterError as error:
        raise typer.BadParameter(str(error)) from None


def _facts(access: DriveParameters, reading: ParameterReading) -> dict[str, object]:
    entry = reading.entry
    return {
        "name": entry.name,
        "object": str(entry.address),
        "value": reading.value,
        "unit": entry.unit,
        "eeprom_writes": access.writes(entry),
    }


def _range(low: float | None, high: float | None, unit: str) -> str:
    if low is None and high is None:
        return unit
    ends = ["" if end is None else f"{end:.10g}" for end in (low, high)]
    return f"{'…'.join(ends)} {unit}".rstrip()


for _command in (parameter_backup.backup, parameter_backup.compare, parameter_backup.restore):
    app.command()(_command)
