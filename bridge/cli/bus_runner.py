"""Common part of the commands on a bus: the choice of the bus, and running a task on it."""

from __future__ import annotations

import asyncio
import inspect
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import wraps
from pathlib import Path
from typing import Annotated, Any, TypeVar

import typer

from bridge.base import clock
from bridge.bustools.task import BusTask
from bridge.can import Bus, open_bus
from bridge.can.interface import ControllerState
from bridge.cli.stopping import until_stopped
from bridge.cli.terminal import printable
from bridge.config import BusTable
from bridge.mapping import Family
from bridge.mapping.model import SdoServer
from bridge.node.places.sdo_channels import FIRST
from bridge.parameter.number_text import NumberError, command_line_number
from bridge.project import load_project

BusName = Annotated[str | None, typer.Option("--bus", help="the bus of SITE; not needed where it has one")]
AsJson = Annotated[bool, typer.Option("--json", help="machine-readable")]

_SEND_WITHIN_S = 0.1


@dataclass(frozen=True, slots=True)
class BusChoice:
    """Options that choose the bus on which a command works."""

    bus: BusName = None
    interface: Annotated[str | None, typer.Option(help="without SITE: socketcan, or one of python-can's")] = (
        None
    )
    channel: Annotated[str | None, typer.Option(help="without SITE: such as can0")] = None
    bitrate: Annotated[
        int | None,
        typer.Option(min=10_000, max=1_000_000, help="without SITE: bit/s, stated, not set on SocketCAN"),
    ] = None


def takes_bus(command: Callable[..., None]) -> Callable[..., None]:
    """Give a command the options of ``BusChoice`` in the place of its parameter ``which``."""
    signature = inspect.signature(command, eval_str=True)
    options = inspect.signature(BusChoice, eval_str=True).parameters
    parameters: list[inspect.Parameter] = []
    for one in signature.parameters.values():
        parameters += options.values() if one.name == "which" else [one]

    @wraps(command)
    def with_options(**values: Any) -> None:
        said = {name: values.pop(name) for name in options}
        command(which=BusChoice(**said), **values)

    for_typer: Any = with_options
    for_typer.__signature__ = signature.replace(parameters=parameters)
    for_typer.__annotations__ = {one.name: one.annotation for one in parameters}
    return with_options


@dataclass(frozen=True, slots=True)
class CliBus:
    """The bus that a command works on. Without a site ``families`` is empty and ``is_of_site`` false.

    A bit rate that was not given is assumed, and not compared with the interface's.
    """

    table: BusTable
    families: dict[str, Family]
    is_of_site: bool
    states_bitrate: bool = True
    state_dir: Path | None = None
    """State folder of the site."""

    def sdo_policy(self, node_id: int) -> tuple[float, int]:
        """Time-out of an SDO answer of this node in seconds, and number of repetitions: as the site has it,
        0.5 s and 0 for a node that it does not have."""
        for node in self.table.node:
            if node.id == node_id:
                return node.sdo_timeout_ms / 1000, node.sdo_retries
        return 0.5, 0

    def sdo_server(self, node_id: int, number: int) -> SdoServer | None:
        """The further SDO server ``number`` of this node, None for the first. Raises ``BadParameter``."""
        if number == FIRST:
            return None
        node = next((node for node in self.table.node if node.id == node_id), None)
        if node is None:
            raise typer.BadParameter("a further SDO channel has the COB-IDs of the mapping: give SITE")
        for server in self.families[node.mapping_key].sdo:
            if server.number == number:
                return server
        known = ", ".join(str(server.number) for server in self.families[node.mapping_key].sdo)
        hint = f"1, {known}" if known else "1"
        raise typer.BadParameter(f"{node.mapping} has no SDO channel {number}: {hint}")

    @property
    def own_id(self) -> int | None:
        """The node id of the site's bridge on this bus, if it can be heard."""
        return self.table.master_node_id if self.is_of_site and self.table.heartbeat_ms else None

    def node_id(self, text: str) -> int:
        """The address in ``text``: a number 1…127, or the name of one of the site's nodes."""
        for node in self.table.node:
            if node.name == text:
                return node.id
        try:
            node_id = command_line_number(text)
        except NumberError:
            known = ", ".join(node.name for node in self.table.node)
            hint = f" or one of {known}" if known else ""
            raise typer.BadParameter(f"{text!r} is no node: an address 1…127{hint}") from None
        if not isinstance(node_id, int) or not 1 <= node_id <= 127:
            raise typer.BadParameter(f"{text} is no node id: 1…127")
        return node_id


def choose_bus(site: Path | None, which: BusChoice, *, is_recorded: bool = False) -> CliBus:
    """The bus that the options name; one that was recorded has no interface. Raises ``BadParameter`` if they
    name none or two."""
    bus = which.bus
    if site is None:
        if bus is not None:
            raise typer.BadParameter("--bus names a bus of SITE, and there is no SITE")
        if is_recorded:
            which = replace(which, interface="virtual", channel="")
        if which.interface is None or which.channel is None:
            raise typer.BadParameter("which bus? Give SITE, or --interface and --channel")
        content = {"name": "bus", "interface": which.interface, "channel": which.channel}
        table = BusTable.model_validate(content | ({"bitrate": which.bitrate} if which.bitrate else {}))
        if not is_recorded:
            not_virtual(table)
        return CliBus(table, {}, is_of_site=False, states_bitrate=which.bitrate is not None)
    if which != BusChoice(bus):
        raise typer.BadParameter("SITE says interface, channel and bit rate: leave the options out")
    project = load_project(site)
    tables = {table.name: table for table in project.site.bus}
    if bus is None and len(tables) == 1:
        bus = next(iter(tables))
    if bus not in tables:
        raise typer.BadParameter(f"which bus? Give --bus, one of {', '.join(tables)}")
    state_dir = Path(project.site.site.state_dir)
    table = tables[bus] if is_recorded else not_virtual(tables[bus])
    return CliBus(table, project.families, is_of_site=True, state_dir=state_dir)


def not_virtual(table: BusTable) -> BusTable:
    """The bus, if another process can use it. Raises ``BadParameter``."""
    if table.interface == "virtual":
        raise typer.BadParameter("a virtual bus exists only inside the process that serves it")
    return table


def split_site(words: list[str], count: int, usage: str) -> tuple[Path | None, list[str]]:
    """SITE, if given, and the ``count`` words after it."""
    if len(words) == count:
        return None, words
    if len(words) == count + 1:
        return Path(words[0]), words[1:]
    raise typer.BadParameter(f"usage: {usage}")


_E = TypeVar("_E", bound=BusTask)


async def run_task(bus: Bus, task: BusTask, watch: Callable[[], None] = lambda: None) -> None:
    """Run ``task`` on ``bus`` until it is finished; ``watch`` is called after every round.

    Raises ``Unavailable`` where the bus cannot be opened.
    """
    loop = asyncio.get_running_loop()
    work = asyncio.Event()
    bus.open(work.set)
    try:
        while True:
            work.clear()
            now = clock.now()
            for frame in bus.drain(now):
                task.on_frame(frame)
            task.on_time(now)
            for frame in task.take_frames():
                task.sent += 1
                bus.send(frame, now, now + _SEND_WITHIN_S)
            bus.on_time(now)
            watch()
            if task.is_finished(now):
                return
            deadlines = [t for t in (task.next_deadline(), bus.next_deadline()) if t is not None]
            delay_s = max(0.0, min(deadlines) - clock.now()) if deadlines else None
            timer = None if delay_s is None else loop.call_later(delay_s, work.set)
            try:
                await work.wait()
            finally:
                if timer:
                    timer.cancel()
    finally:
        bus.close()


def carry_out(
    line: CliBus,
    make: Callable[[float], _E],
    watch: Callable[[_E], None] = lambda task: None,
    *,
    paced: bool = False,
) -> _E:
    """Make a task of now and run it on the bus; returns it when it is finished or was interrupted.

    One that is ``paced`` sends as much as a bus of this bit rate bears: a slower one is refused with
    ``Unavailable``.
    """
    table = line.table
    assumed = table.interface == "socketcan" and not line.states_bitrate
    bus = open_bus(
        table.name,
        table.interface,
        table.channel or "",
        0 if assumed else table.bitrate,
        at_least=table.bitrate if assumed and paced else 0,
    )
    task = make(clock.now())
    until_stopped(run_task(bus, task, lambda: watch(task)))
    task.unsent = bus.status.frames_expired
    if bus.status.state is not ControllerState.OK:
        state = bus.status.state.name.lower().replace("_", "-")
        tell(f"warning: bus {table.channel} is {state}")
    return task


def tell(text: str) -> None:
    """A sentence on standard error, apart from the results."""
    print(printable(text), file=sys.stderr)


def print_table(rows: Sequence[Sequence[str]]) -> None:
    """Rows of cells in aligned columns; the first row is the heading."""
    shown = [[printable(cell) for cell in row] for row in rows]
    widths = [max(map(len, column)) for column in zip(*shown, strict=True)]
    for row in shown:
        print("  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip())
