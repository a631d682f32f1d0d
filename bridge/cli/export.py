"""``export``: the interface of a site as a table for those who program against it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from bridge.base.errors import OperationFailed
from bridge.exports import (
    ExportTable,
    dbc_file,
    modbus_table,
    opcua_nodeset,
    opcua_table,
    zenoh_table,
)
from bridge.project import load_project

app = typer.Typer(
    help="Print what a site serves, for PLC, SCADA and fleet programmers.", no_args_is_help=True
)

SiteArgument = Annotated[Path, typer.Argument(metavar="SITE", help="the site file")]
AsJson = Annotated[bool, typer.Option("--json", help="machine-readable")]


@app.command()
def modbus(site: SiteArgument, as_json: AsJson = False) -> None:
    """Every register: unit, table, 0-based address, 1-based reference, name, type, access, unit."""
    _print(modbus_table(load_project(site)), as_json)


@app.command()
def opcua(
    site: SiteArgument,
    as_json: AsJson = False,
    nodeset2: Annotated[
        bool, typer.Option("--nodeset2", help="the whole address space as a UANodeSet file instead")
    ] = False,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="FILE", help="where to, instead of the terminal")
    ] = None,
) -> None:
    """Every variable: NodeId, data type, unit, access, description."""
    project = load_project(site)
    if nodeset2 and as_json:
        raise typer.BadParameter("--nodeset2 is XML, --json is not", param_hint="--json")
    if nodeset2:
        told = opcua_nodeset(project)
    else:
        table = opcua_table(project)
        told = table.as_json() if as_json else table.as_csv()
    if output is None:
        print(told, end="")
        return
    try:
        output.write_text(told, encoding="utf-8")
    except OSError as error:
        raise OperationFailed(f"{output}: {error.strerror or error}") from None


@app.command()
def zenoh(site: SiteArgument, as_json: AsJson = False) -> None:
    """Every key: data type, unit, access, description."""
    _print(zenoh_table(load_project(site)), as_json)


@app.command()
def dbc(
    site: SiteArgument,
    bus: Annotated[str | None, typer.Option(help="which bus, where the site has several")] = None,
    words: Annotated[bool, typer.Option("--words", help="raw words instead of values and bits")] = False,
) -> None:
    """A DBC file: PDOs with their signals, SYNC, NMT, heartbeats and emergency messages."""
    project = load_project(site)
    names = [table.name for table in project.site.bus]
    if bus is None and len(names) > 1:
        raise typer.BadParameter(f"the site has the buses {', '.join(names)}", param_hint="--bus")
    if bus is not None and bus not in names:
        raise typer.BadParameter(f"there is no {bus}; the site has {', '.join(names)}", param_hint="--bus")
    print(dbc_file(project, 0 if bus is None else names.index(bus), words=words), end="")


def _print(table: ExportTable, as_json: bool) -> None:
    """CSV for spreadsheets, or a JSON list of objects."""
    print(table.as_json() if as_json else table.as_csv(), end="")
