"""``drop-test``: proves on the real drives of one node that they notice a silent bridge."""

from __future__ import annotations

import asyncio
import getpass
import json
import socket
import sys
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated

import typer

from bridge import __version__
from bridge.base import clock
from bridge.base.errors import OperationFailed
from bridge.bustools.bystander import command_ids
from bridge.bustools.drop_test import DropTest, ForeignMaster, Phase
from bridge.bustools.muted_bus import MutableBus
from bridge.catalogue import Catalogue, MemberSpec
from bridge.cli import drop_report
from bridge.cli.bus_runner import AsJson, CliBus, carry_out, not_virtual, tell
from bridge.cli.kinds import words_of
from bridge.cli.stopping import until_stopped
from bridge.command import Plant
from bridge.config import BusTable, NodeTable, Site
from bridge.mapping import Family
from bridge.master.master import Master
from bridge.master.network import Network
from bridge.parameter.ledger_file import LedgerFile
from bridge.project import Project, load_project
from bridge.service.bus_process import make_bus

_LISTEN_S = 1.0


def drop_test(
    site: Annotated[Path, typer.Argument(metavar="SITE", help="the site file")],
    node: Annotated[str, typer.Argument(metavar="NODE", help="the node's name in the site file")],
    at_the_machine: Annotated[
        bool, typer.Option("--yes-i-am-at-the-machine", help="agree without typing the node's name")
    ] = False,
    operator: Annotated[str | None, typer.Option(help="who signs the report; the user's name")] = None,
    report: Annotated[
        Path | None, typer.Option(help="folder of the report; drop-tests in the site's state_dir")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Stop supervising the drives or outputs of NODE, measure what it does, and write a report to sign."""
    project = load_project(site)
    bus, table = find_node(project, node)
    commanded = Catalogue.of(project.site, project.families).nodes[table.name].commanded
    if not commanded:
        raise typer.BadParameter(f"{node} has neither drives nor outputs: there is nothing to stop")
    consent = agree(commanded[0], at_the_machine=at_the_machine)
    refuse_company(project, bus, table)
    occasion = drop_report.Occasion(
        operator or getpass.getuser(), socket.gethostname(), consent, datetime.now(UTC), site
    )
    plant, test = perform(project, bus, table)
    facts = drop_report.facts(occasion, plant.nodes[table.name], test)
    folder = report or Path(project.site.site.state_dir) / "drop-tests"
    try:
        files = drop_report.write(facts, drop_report.markdown(facts), folder)
    except OSError as error:
        print(json.dumps(facts, indent=2))
        raise OperationFailed(f"the report cannot be written to {folder}: {error.strerror}") from None
    if as_json:
        print(json.dumps(facts | {"files": [str(file) for file in files]}, indent=2))
    else:
        print(drop_report.markdown(facts))
        tell(f"report: {files[0]}, {files[1]}")
    if test.failure:
        raise OperationFailed(test.failure)
    if not facts["ok"]:
        raise typer.Exit(1)


def find_node(project: Project, name: str) -> tuple[BusTable, NodeTable]:
    """An enabled node on a real bus. Raises ``BadParameter``."""
    nodes = {node.name: (bus, node) for bus in project.site.bus for node in bus.node}
    if name not in nodes:
        raise typer.BadParameter(f"{name!r} is no node: {', '.join(nodes)}")
    bus, node = nodes[name]
    not_virtual(bus)
    if not node.enabled:
        raise typer.BadParameter(f"{name} is not enabled in the site file")
    return bus, node


def agree(one: MemberSpec, *, at_the_machine: bool, first: str = "") -> str:
    """Form in which the operator agreed to the test of a node, of which ``one`` is commanded. ``first`` says
    what is done before the test. Raises ``BadParameter`` or ``OperationFailed`` if nobody agreed."""
    if at_the_machine:
        return "agreed by --yes-i-am-at-the-machine"
    if not sys.stdin.isatty():
        raise typer.BadParameter("somebody has to be at the machine: run it on a terminal")
    node = one.node
    what = words_of(one).drop_test.format(node=node.name, id=node.id)
    tell(
        f"{first}{what} Nobody else may command this bus meanwhile. Be where the machine's emergency stop is."
    )
    typed = typer.prompt("The node's name, to go on", err=True, default="", show_default=False)
    if typed.strip() != node.name:
        raise OperationFailed("not agreed: nothing was done")
    return "agreed by typing the node's name"


def refuse_company(project: Project, bus: BusTable, node: NodeTable) -> None:
    """Raises ``OperationFailed`` if another master commands this bus."""
    family = project.families[node.mapping_key]
    commands = command_ids(node, family)
    listen_s = max(_LISTEN_S, 3 * bus.heartbeat_ms / 1000)
    line = CliBus(bus, project.families, is_of_site=True)
    heard = carry_out(line, lambda now: ForeignMaster(bus.master_node_id, commands, now, listen_s))
    if heard.found:
        raise OperationFailed(f"another master is active on {bus.name}: {heard.found}; stop it first")


def alone(site: Site, bus: BusTable, node: NodeTable) -> Site:
    """The site reduced to this node, commanded by no protocol."""
    drives = [drive.model_copy(update={"control": "none"}) for drive in node.drive]
    outputs = node.outputs.model_copy(update={"control": "none"})
    table = node.model_copy(update={"drive": drives, "outputs": outputs, "on_loss": "restart"})
    changes = {"node": [table], "mandatory_missing": "go_on", "reset_at_start": "none"}
    return site.model_copy(
        update={
            "bus": [bus.model_copy(update=changes)],
            "modbus": None,
            "opcua": None,
            "zenoh": None,
        }
    )


def perform(project: Project, bus: BusTable, node: NodeTable) -> tuple[Plant, DropTest]:
    """The test on the drives of ``node``. Raises ``OperationFailed`` if it was interrupted."""
    site, families = alone(project.site, bus, node), project.families
    plant = Plant(Catalogue.of(site, families), __version__, clock.now())
    file = LedgerFile(Path(site.site.state_dir))
    _count(file, plant)
    try:
        test = _carry_out(project, site, families, plant)
    finally:
        _count(file, plant)
    return plant, test


def _count(file: LedgerFile, plant: Plant) -> None:
    """Count the boot-up's EEPROM writes where the service counts its own."""
    try:
        file.add(plant.eeprom_writes, clock.epoch_ns(0.0) / 1e9, clock.now())
    except OSError as error:
        why = error.strerror or str(error)
        raise OperationFailed(
            f"EEPROM writes are counted in {file.path}: {why}; run it as the service's user"
        ) from None


def _carry_out(project: Project, site: Site, families: dict[str, Family], plant: Plant) -> DropTest:
    (table,) = site.bus
    (node,) = plant.nodes.values()
    made: list[DropTest] = []

    async def work() -> None:
        finished = asyncio.Event()
        bus = MutableBus(make_bus(table), lambda frame: made[0].on_frame(frame))
        network = Network(table, plant.side_of(table), clock.epoch_ns, project.downloads)
        test = DropTest(network, plant, node, bus, finished.set)
        made.append(test)
        told = [Phase.DONE]

        def on_round(now: float) -> None:
            test.on_round(now)
            if test.phase not in (told[0], Phase.DONE):
                told[0] = test.phase
                long = f" for {test.silent_s:g} s" if test.phase is Phase.SILENT else ""
                for outcome in test.outcomes if test.phase is Phase.SILENT else ():
                    tell(f"{outcome.drive}: own time-out {outcome.own_text}")
                tell(f"{node.name}: {test.phase}{long}")

        master = Master([(bus, network)], plant, clock.now, on_round)
        await master.start()
        try:
            async with asyncio.TaskGroup() as tasks:
                failing = tasks.create_task(master.failed())
                await finished.wait()
                failing.cancel()
        finally:
            bus.unmute()
            await master.stop_drives(clock.now())
            await master.close()

    until_stopped(work())
    test = made[0]
    if test.phase is not Phase.DONE:
        raise OperationFailed("interrupted; the drives were sent stopped words")
    return test
