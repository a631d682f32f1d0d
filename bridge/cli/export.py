"""``export``: the interface of a site as a table for those who program against it."""

from __future__ import annotations

import csv
import json
import sys
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Annotated

import typer

from bridge import __version__
from bridge.command import Plant, Source
from bridge.command.rights import rights_of
from bridge.dbc import BusDescription, describe
from bridge.errors import OperationFailed
from bridge.image import Point
from bridge.lint import family_dictionaries
from bridge.lint.bus import view_bus
from bridge.northbound.modbus.registers import BRIDGE_UNITS, Row
from bridge.northbound.modbus.units import device_maps, drive_maps, units_of
from bridge.northbound.zenoh.keys import KeySpace
from bridge.project import load_project

app = typer.Typer(
    help="Print what a site serves, for PLC, SCADA and fleet programmers.", no_args_is_help=True
)

SiteArgument = Annotated[Path, typer.Argument(metavar="SITE", help="the site file")]
AsJson = Annotated[bool, typer.Option("--json", help="machine-readable")]

_NAMESPACE = "urn:drivebridge:points"
_POINT = ("type", "unit", "access", "description")
_MODBUS = ("unit_id", "drive", "table", "address", "reference", "name", *_POINT)


@app.command()
def modbus(site: SiteArgument, as_json: AsJson = False) -> None:
    """Every register: unit, table, 0-based address, 1-based reference, name, type, access, unit."""
    plant = _plant(site)
    rows = [
        (drive_map.unit_id, drive_map.drive_name, *_register(row))
        for drive_map in drive_maps(plant)
        for row in drive_map.rows
    ]
    rows += [
        (device.unit_id, device.device_name, *_register(row))
        for device in device_maps(plant)
        for row in device.rows
    ]
    rows += [(BRIDGE_UNITS[0], "bridge", *_register(row)) for row in units_of(plant).bridge_rows]
    _print(_MODBUS, rows, as_json)


def _register(row: Row) -> tuple[object, ...]:
    place = (row.table.value, row.address, row.reference)
    return (*place, row.name, row.type, row.unit, row.access, row.description)


@app.command()
def opcua(site: SiteArgument, as_json: AsJson = False) -> None:
    """Every variable: NodeId, data type, unit, access, description."""
    plant = _plant(site)
    rights = rights_of(plant, Source.OPCUA)
    rows = [
        (f"nsu={_NAMESPACE};s={point.name}", *_point(point, is_writable=rights.may_write(plant, point)))
        for point in plant.image.points
    ]
    _print(("node_id", *_POINT), rows, as_json)


@app.command()
def zenoh(site: SiteArgument, as_json: AsJson = False) -> None:
    """Every key: data type, unit, access, description."""
    project = load_project(site)
    if project.site.zenoh is None:
        raise OperationFailed(f"{site} has no [zenoh] table")
    plant = _plant(site)
    points = plant.image.points
    space = KeySpace(project.site.zenoh.prefix, project.site.site.name, points)
    rights = rights_of(plant, Source.ZENOH)
    rows = [
        (key, *_point(point, is_writable=rights.may_write(plant, point)))
        for key, point in zip(space.keys, points, strict=True)
    ]
    _print(("key", *_POINT), rows, as_json)


@app.command()
def dbc(
    site: SiteArgument,
    bus: Annotated[str | None, typer.Option(help="which bus, where the site has several")] = None,
    words: Annotated[bool, typer.Option("--words", help="raw words instead of values and bits")] = False,
) -> None:
    """A DBC file: PDOs with their signals, SYNC, NMT, heartbeats and emergency messages."""
    dbc_text = _dbc_writer()
    project = load_project(site)
    names = [table.name for table in project.site.bus]
    if bus is None and len(names) > 1:
        raise typer.BadParameter(f"the site has the buses {', '.join(names)}", param_hint="--bus")
    if bus is not None and bus not in names:
        raise typer.BadParameter(f"there is no {bus}; the site has {', '.join(names)}", param_hint="--bus")
    place = 0 if bus is None else names.index(bus)
    dictionaries = family_dictionaries(project.families, project.path)
    view = view_bus(
        project.site.bus[place], ("bus", place), project.families, dictionaries, project.downloads
    )
    print(dbc_text(describe(view, words=words)), end="")


def _dbc_writer() -> Callable[[BusDescription], str]:
    """Raises OperationFailed where cantools is missing: it is an extra, because nothing else needs it."""
    try:
        from bridge.dbc.write import dbc_text
    except ModuleNotFoundError as error:
        if error.name is None or error.name.partition(".")[0] != "cantools":
            raise
        raise OperationFailed(
            "writing a DBC file needs cantools, which is not installed: "
            f"`{sys.executable} -m pip install cantools` (or install drivebridge as drivebridge[dbc])"
        ) from None
    return dbc_text


def _point(point: Point, *, is_writable: bool) -> tuple[object, ...]:
    return (point.data_type.value, point.unit, "rw" if is_writable else "r", point.description)


def _plant(site: Path) -> Plant:
    project = load_project(site)
    return Plant(project.site, project.families, __version__)


def _print(columns: Sequence[str], rows: Iterable[Sequence[object]], as_json: bool) -> None:
    """CSV for spreadsheets, or a JSON list of objects."""
    if as_json:
        print(json.dumps([dict(zip(columns, row, strict=True)) for row in rows], indent=2))
        return
    writer = csv.writer(sys.stdout, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(rows)
