"""Tables of all that a site serves, for PLC, SCADA and fleet programmers, and DBC files."""

from __future__ import annotations

import csv
import io
import json
import sys
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

from bridge import __version__
from bridge.base.errors import OperationFailed
from bridge.catalogue import Catalogue, Source, rights_of
from bridge.dbc import BusDescription, describe
from bridge.image.point import Point
from bridge.lint import family_dictionaries
from bridge.lint.checked_bus import view_bus
from bridge.northbound.modbus.registers import BRIDGE_UNITS, Row
from bridge.northbound.modbus.units import device_maps, drive_maps, units_of
from bridge.northbound.opcua.models.nodeset_export import nodeset_of
from bridge.northbound.zenoh.keys import KeySpace
from bridge.project import Project
from bridge.text import Text

_NAMESPACE: Final = "urn:drivebridge:points"
_POINT: Final = ("type", "unit", "access", "description")
_MODBUS: Final = ("unit_id", "drive", "table", "address", "reference", "name", *_POINT)


@dataclass(frozen=True, slots=True)
class ExportTable:
    """``rows`` have a cell for each of ``columns``."""

    columns: tuple[str, ...]
    rows: list[tuple[object, ...]]

    @property
    def facts(self) -> list[dict[str, Any]]:
        return [dict(zip(self.columns, row, strict=True)) for row in self.rows]

    def as_csv(self) -> str:
        """For spreadsheets."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(self.columns)
        writer.writerows(self.rows)
        return text.getvalue()

    def as_json(self) -> str:
        return json.dumps(self.facts, indent=2) + "\n"


def modbus_table(project: Project) -> ExportTable:
    """Every register: unit, table, 0-based address, 1-based reference, name, type, access, unit."""
    catalogue = _catalogue(project)
    rows = [
        (drive_map.unit_id, drive_map.drive_name, *_register(row))
        for drive_map in drive_maps(catalogue)
        for row in drive_map.rows
    ]
    rows += [
        (device.unit_id, device.device_name, *_register(row))
        for device in device_maps(catalogue)
        for row in device.rows
    ]
    rows += [(BRIDGE_UNITS[0], "bridge", *_register(row)) for row in units_of(catalogue).bridge_rows]
    return ExportTable(_MODBUS, list(rows))


def opcua_table(project: Project) -> ExportTable:
    """Every variable: NodeId, data type, unit, access, description."""
    catalogue = _catalogue(project)
    rights = rights_of(catalogue, Source.OPCUA)
    rows = [
        (f"nsu={_NAMESPACE};s={point.name}", *_point(point, is_writable=rights.may_write(catalogue, point)))
        for point in catalogue.points
    ]
    return ExportTable(("node_id", *_POINT), list(rows))


def opcua_nodeset(project: Project) -> str:
    """The address space as a UANodeSet file."""
    return nodeset_of(_catalogue(project), __version__)


def zenoh_table(project: Project) -> ExportTable:
    """Every key: data type, unit, access, description. Raises ``OperationFailed`` without zenoh."""
    if project.site.zenoh is None:
        raise OperationFailed(Text.of("export.no_zenoh", site=str(project.path)))
    catalogue = _catalogue(project)
    points = catalogue.points
    space = KeySpace(project.site.zenoh.prefix, project.site.site.name, points)
    rights = rights_of(catalogue, Source.ZENOH)
    rows = [
        (key, *_point(point, is_writable=rights.may_write(catalogue, point)))
        for key, point in zip(space.keys, points, strict=True)
    ]
    return ExportTable(("key", *_POINT), list(rows))


def dbc_file(project: Project, bus: int, *, words: bool = False) -> str:
    """The DBC file of the bus at this place: PDOs with their signals, SYNC, NMT, heartbeats and emergency
    messages; ``words``: raw words instead of values and bits. Raises ``OperationFailed`` without cantools."""
    dbc_text = _dbc_writer()
    dictionaries = family_dictionaries(project.families, project.path)
    table = project.site.bus[bus]
    view = view_bus(table, ("bus", bus), project.families, dictionaries, project.downloads)
    return dbc_text(describe(view, words=words))


def _register(row: Row) -> tuple[object, ...]:
    place = (row.table.value, row.address, row.reference)
    return (*place, row.name, row.type, row.unit, row.access, row.description)


def _point(point: Point, *, is_writable: bool) -> tuple[object, ...]:
    return (point.data_type.value, point.unit, "rw" if is_writable else "r", str(point.description))


def _catalogue(project: Project) -> Catalogue:
    return Catalogue.of(project.site, project.families)


def _dbc_writer() -> Callable[[BusDescription], str]:
    """cantools is an extra, because nothing else needs it."""
    try:
        from bridge.dbc.write import dbc_text
    except ModuleNotFoundError as error:
        if error.name is None or error.name.partition(".")[0] != "cantools":
            raise
        raise OperationFailed(Text.of("export.no_cantools", python=sys.executable)) from None
    return dbc_text
