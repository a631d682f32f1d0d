"""Common part of the commands on parameters: the choice of the drive, and running a procedure on its bus."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Final, TypeVar

import typer

from bridge.base import clock
from bridge.base.errors import OperationFailed
from bridge.bustools.bystander import Bystander, Standstill
from bridge.bustools.parameter import ParameterTask
from bridge.catalogue import Catalogue, MemberSpec
from bridge.cli.bus_runner import CliBus, carry_out, not_virtual, tell
from bridge.cli.known_servers import KnownServers
from bridge.cli.terminal import Show, progress
from bridge.command.output_words import OutputWords
from bridge.config import NodeTable
from bridge.mapping.model import Family, Slot
from bridge.node.parameters.run import Procedure
from bridge.parameter import DriveParameters, Ledger, ParameterEntry, ParameterError, Why
from bridge.parameter.ledger_file import LedgerFile
from bridge.parameter.protection import Gate
from bridge.project import load_project
from bridge.text import Said

SiteArgument = Annotated[Path, typer.Argument(metavar="SITE", help="the site file")]
DriveArgument = Annotated[
    str,
    typer.Argument(
        metavar="DRIVE", help="NODE/DRIVE as in the site file; NODE where it has one drive or is none"
    ),
]
Yes = Annotated[bool, typer.Option("--yes", "-y", help="do not ask")]
Force = Annotated[
    bool, typer.Option("--force", help="also what supervises or addresses the drive, while it is not enabled")
]

_LISTEN_S: Final = 1.0

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class SaveOutcome:
    """Outcome of a save: the guard's ``warning``, or ``why_not`` where nothing can be saved on command."""

    warning: Said = ""
    why_not: str = ""


@dataclass(frozen=True, slots=True)
class Target:
    """One drive of a site, or a node that is none, with the ledger that counts the writes to it."""

    line: CliBus
    one: MemberSpec
    access: DriveParameters
    ledger: Ledger
    file: LedgerFile

    @property
    def name(self) -> str:
        return self.one.name

    @property
    def node(self) -> NodeTable:
        return self.one.node

    @property
    def family(self) -> Family:
        return self.one.family

    @property
    def slot(self) -> Slot | None:
        """Slot of the drive; a node that is none has no slot."""
        return self.one.slot

    def refuse_unforced(self, entries: Iterable[ParameterEntry]) -> None:
        """Raises ``BadParameter`` with all that is written with ``--force`` only, if at all."""
        protection = self.access.names.protection
        reasons = "; ".join(str(why) for entry in entries if (why := protection.why_forced(entry)))
        if reasons:
            raise typer.BadParameter(
                f"{reasons}. Nothing was written. --force writes what decides and supervises, while the "
                "drive is not enabled"
            )

    def alone(self, *, force: bool = False, whole: bool = False) -> Standstill:
        """Listen, and return what is known of the drive's state. Raises ``OperationFailed`` if another master
        commands this bus. ``whole`` is that of ``Standstill``."""
        table = not_virtual(self.line.table)
        listen_s = max(_LISTEN_S, 3 * table.heartbeat_ms / 1000)
        heard = carry_out(
            self.line,
            lambda now: Bystander(table.master_node_id, self.node, self.family, self.slot, now, listen_s),
        )
        if heard.found:
            raise OperationFailed(
                f"another master is active on {table.name}: {heard.found}; write through it, or stop it first"
            )
        return Standstill(
            self.access.names,
            self.family,
            self.slot,
            heard.status,
            force=force,
            whole=whole,
            outputs=OutputWords.of(self.node, self.family),
        )

    def run(
        self,
        make: Callable[[float], Procedure[T]],
        *,
        writes: bool = False,
        watch: Callable[[Show], None] = lambda show: None,
    ) -> T:
        """Run a procedure on the bus. Raises ``OperationFailed`` with the reason.

        Where it ``writes``, nothing is begun unless writes can be counted. ``watch`` shows how far it is.
        """
        result = self.attempt(make, writes=writes, watch=watch)
        if isinstance(result, ParameterError):
            raise OperationFailed(f"{self.name}: {result}") from None
        return result

    def save(self, gate: Gate) -> SaveOutcome:
        """Have the node keep its parameters. Raises ``OperationFailed``, but not where it has no command for
        that: it may keep them by itself."""
        result = self.attempt(lambda now: self.access.save(now, gate), writes=True)
        if not isinstance(result, ParameterError):
            return SaveOutcome(warning=result)
        if result.why is Why.NOT_CONFIGURED:
            return SaveOutcome(why_not=str(result))
        raise OperationFailed(f"{self.name}: {result}") from None

    def attempt(
        self,
        make: Callable[[float], Procedure[T]],
        *,
        writes: bool = False,
        watch: Callable[[Show], None] = lambda show: None,
    ) -> T | ParameterError:
        """Result of ``run``, with the reason of a failure as the result."""
        not_virtual(self.line.table)
        if writes:
            self.count()
        servers = KnownServers(self.line)
        known = servers.known()
        try:
            with progress(self.name) as show:
                task = carry_out(
                    self.line,
                    lambda now: ParameterTask(self.node, self.family, self.slot, make, now, known),
                    lambda _: watch(show),
                )
        finally:
            if writes:
                self.count()
        servers.learn(task.take_learned())
        if not task.is_done:
            raise OperationFailed("interrupted")
        return task.result  # pyright: ignore[reportReturnType]  # None is what some procedures return

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
    """The drive, or the node that is none, that ``drive`` names. Raises ``BadParameter`` with the names that
    there are."""
    project = load_project(site)
    ledger, file = Ledger(), LedgerFile(Path(project.site.site.state_dir))
    targets = Catalogue.of(project.site, project.families).members
    found = [name for name in targets if drive in (name, name.partition("/")[0])]
    if len(found) != 1:
        known = ", ".join(found or targets)
        raise typer.BadParameter(f"{drive!r} is {'more than one' if found else 'no'} drive: {known}")
    one = targets[found[0]]
    access = DriveParameters(one.name, one.node.name, one.family, one.names, ledger, on_first=one.is_on_first)
    line = CliBus(one.bus, project.families, is_of_site=True, state_dir=Path(project.site.site.state_dir))
    return Target(line, one, access, ledger, file)
