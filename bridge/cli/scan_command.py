"""``scan``: which nodes are on a bus."""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from bridge.base.errors import OperationFailed
from bridge.bustools.scan import FoundNode, Scanner
from bridge.cli.bus_runner import (
    AsJson,
    BusChoice,
    CliBus,
    carry_out,
    choose_bus,
    print_table,
    takes_bus,
    tell,
)
from bridge.cli.scan_site import write_site
from bridge.cli.terminal import progress
from bridge.mapping import Family, family_names, load_family
from bridge.mapping.loader import mapping_folders
from bridge.mapping.match import Found, Match, best_match

_PASSIVE_S = 3.0
_ACTIVE_S = 0.5
_COLUMNS = ("id", "name", "NMT state", "type", "vendor", "product", "revision", "serial", "mapping", "site")


@takes_bus
def scan(
    which: BusChoice,
    site: Annotated[Path | None, typer.Argument(metavar="[SITE]", help="the site file")] = None,
    passive: Annotated[bool, typer.Option("--passive", help="send nothing, only listen")] = False,
    seconds: Annotated[
        float | None, typer.Option(min=0.1, help="how long to listen at least; 0.5, with --passive 3")
    ] = None,
    timeout_ms: Annotated[
        int, typer.Option(min=10, max=10_000, help="how long to wait for each answer")
    ] = 300,
    as_json: AsJson = False,
    write: Annotated[
        Path | None, typer.Option(help="write a site file with the nodes that were found; none may be there")
    ] = None,
    eds: Annotated[
        Path | None, typer.Option(help="with --write: a folder with EDS files, to make mappings of")
    ] = None,
) -> None:
    """List the nodes of a bus: by heartbeat, guarding and SDO."""
    if write and passive:
        raise typer.BadParameter("a site file needs what the nodes answer: leave out --passive")
    line = choose_bus(site, which)
    listen_s = seconds or (_PASSIVE_S if passive else _ACTIVE_S)
    scanner = _run(line, passive=passive, listen_s=listen_s, timeout_s=timeout_ms / 1000)
    if not passive:
        _tell_requests(scanner)
    folders = mapping_folders(write or site)
    families = {name: load_family(name, folders) for name in family_names(folders)}
    found = [_row(node, line, families) for node in scanner.nodes()]
    for phantom, owner in scanner.phantoms().items():
        whose = "nobody confirms it" if owner is None else f"they are another SDO channel of node {owner}"
        tell(f"answers for id {phantom} are no node: {whose}")
    if as_json:
        print(json.dumps([row.for_scripts() for row in found], indent=2))
    else:
        _print(found)
    if write:
        tell(write_site(write, eds, line.table, [(row.node, row.match) for row in found], families))


def _run(line: CliBus, *, passive: bool, listen_s: float, timeout_s: float) -> Scanner:
    def make(now: float) -> Scanner:
        return Scanner(
            now,
            line.table.bitrate,
            passive=passive,
            listen_s=listen_s,
            timeout_s=timeout_s,
            own_id=line.own_id,
        )

    if passive or not sys.stderr.isatty():
        tell(f"listening for {listen_s:g} s" if passive else "asking all 127 ids")
        return carry_out(line, make, paced=not passive)
    with progress("asking all 127 ids") as show:
        return carry_out(line, make, lambda s: show(s.done, s.total, ""), paced=True)


def _tell_requests(scanner: Scanner) -> None:
    """Say how many requests went out: silence says nothing of what was never asked. Raises
    ``OperationFailed`` where none did and nobody was heard."""
    went = max(0, scanner.sent - scanner.unsent)
    if scanner.sent and not went and not scanner.nodes():
        raise OperationFailed(
            f"none of {scanner.sent} requests went out: the bus takes no frames; is another node on?"
        )
    tell(f"{went} of {scanner.sent} requests went out")


@dataclass(frozen=True, slots=True)
class _Row:
    """One node of the list."""

    node: FoundNode
    match: Match | None
    site_node: str | None

    def for_scripts(self) -> dict[str, object]:
        node = self.node
        return {
            "id": node.id,
            "name": node.name,
            "identity": {
                "vendor": node.vendor,
                "product": node.product,
                "revision": node.revision,
                "serial": node.serial,
                "device_type": node.device_type,
            },
            "nmt_state": node.nmt_state.label,
            "mapping": self.match.mapping if self.match else None,
            "mapping_by": list(self.match.by) if self.match else [],
            "site_node": self.site_node,
        }

    def for_people(self) -> tuple[str, ...]:
        node = self.node
        state = node.nmt_state.label.replace("_", " ")
        numbers = (node.device_type, node.vendor, node.product, node.revision, node.serial)
        by = f"{self.match.mapping} (by {', '.join(self.match.by)})" if self.match else "none"
        shown = ("–" if number is None else f"{number:X}h" for number in numbers)
        return (str(node.id), node.name or "–", state, *shown, by, self.site_node or "–")


def _row(node: FoundNode, line: CliBus, families: dict[str, Family]) -> _Row:
    found = Found(node.device_type, node.vendor, node.product, node.revision, node.name)
    match = best_match(found, families)
    site_node = next((table.name for table in line.table.node if table.id == node.id), None)
    return _Row(node, match, site_node)


def _print(found: list[_Row]) -> None:
    if not found:
        print("no nodes")
        return
    print_table([_COLUMNS, *(row.for_people() for row in found)])
