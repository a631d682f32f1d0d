"""What the commands on parameters share: which drive, and how a procedure is run on its bus."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, TypeVar

import typer

from bridge import clock
from bridge.cli.bus import Line, carry_out, tell
from bridge.cli.terminal import progress
from bridge.config import BusTable, NodeTable
from bridge.errors import OperationFailed
from bridge.mapping.model import Family, Slot
from bridge.parameter import DriveParameters, Ledger, Names, ParameterError
from bridge.parameter.ledger_file import LedgerFile
from bridge.project import load_project
from bridge.southbound.parameter_errand import ParameterErrand
from bridge.southbound.parameter_run import Procedure

SiteArgument = Annotated[Path, typer.Argument(metavar="SITE", help="the site file")]
DriveArgument = Annotated[
    str, typer.Argument(metavar="DRIVE", help="NODE/DRIVE as in the site file; NODE where it has one drive")
]
Yes = Annotated[bool, typer.Option("--yes", "-y", help="do not ask")]

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Target:
    """One drive of a site, and who counts what is written to it."""

    line: Line
    node: NodeTable
    family: Family
    slot: Slot
    access: DriveParameters
    ledger: Ledger
    file: LedgerFile

    @property
    def name(self) -> str:
        return self.access.name

    def run(self, make: Callable[[float], Procedure[T]], *, writes: bool = False) -> T:
        """Carry a procedure out on the bus. Raises ``OperationFailed`` with the sentence that says why.

        Where it ``writes``, nothing is begun unless writes can be counted.
        """
        if self.line.table.interface == "virtual":
            raise typer.BadParameter("a virtual bus exists only inside the process that serves it")
        if writes:
            self.count()
        try:
            with progress(self.name):
                errand = carry_out(
                    self.line, lambda now: ParameterErrand(self.node, self.family, self.slot, make, now)
                )
        finally:
            if writes:
                self.count()
        result = errand.result
        if isinstance(result, ParameterError):
            raise OperationFailed(f"{self.name}: {result}") from None
        if not errand.is_done:
            raise OperationFailed("interrupted")
        return result  # pyright: ignore[reportReturnType]  # None is what some procedures return

    def count(self) -> None:
        """Keep the counts of the EEPROM guard. Raises ``OperationFailed`` where they cannot be kept."""
        now = clock.now()
        try:
            self.file.add(self.ledger, clock.epoch_ns(0.0) / 1e9, now)
        except OSError as error:
            raise OperationFailed(
                f"writes are counted in {self.file.path}, and that cannot be written: "
                f"{error.strerror or error}; run it as the service's user"
            ) from None
        if self.file.damaged:
            tell(f"warning: {self.file.path} could not be read; it was put aside as {self.file.damaged}")


def find(site: Path, drive: str) -> Target:
    """The drive that ``drive`` names. Raises ``BadParameter`` with the names there are."""
    project = load_project(site)
    ledger, file = Ledger(), LedgerFile(Path(project.site.site.state_dir))
    targets: dict[str, tuple[BusTable, NodeTable, Slot]] = {}
    for bus in project.site.bus:
        for node in bus.node:
            family = project.families[node.mapping]
            for table in node.drive:
                slot = family.slot_named(table.slot)
                targets[f"{node.name}/{family.leaf_of(table)}"] = (bus, node, slot)
    found = [name for name in targets if drive in (name, name.partition("/")[0])]
    if len(found) != 1:
        known = ", ".join(found or targets)
        raise typer.BadParameter(f"{drive!r} is {'more than one' if found else 'no'} drive: {known}")
    (name,) = found
    bus, node, slot = targets[name]
    family = project.families[node.mapping]
    on_first = slot.parameters_by_sdo or not any(server.slot == slot.name for server in family.sdo)
    access = DriveParameters(name, node.name, family, Names(family), ledger, on_first=on_first)
    return Target(Line(bus, project.families, is_of_site=True), node, family, slot, access, ledger, file)
