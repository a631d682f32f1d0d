"""``run``, ``demo``, ``simulate``: the commands that stay up."""

from __future__ import annotations

import asyncio
import signal
import tempfile
from collections.abc import Callable, Coroutine
from importlib import resources
from pathlib import Path
from typing import Annotated, Any, Literal, cast

import typer

from bridge.cli import logs
from bridge.config import BusTable, ZenohTable
from bridge.errors import OperationFailed
from bridge.fronts import Front, become_front
from bridge.mapping.loader import lineage, mapping_folders
from bridge.service import Project, Service, load_project, make_bus
from bridge.sim.catalogue import SIMULATED, simulate_node
from bridge.sim.node import SimulatedNode
from bridge.sim.shell import Simulation
from bridge.southbound.bus import Bus
from bridge.southbound.bus.virtual import VirtualWire
from bridge.southbound.standstill import SignalAlarm

SiteArgument = Annotated[Path, typer.Argument(metavar="SITE", help="the site file")]
Verbose = Annotated[bool, typer.Option("--verbose", "-v", help="log more")]
_DEMO_MOVES = (
    ("conveyor/fu4", "frequency", 40.0),
    ("pump/drive", "velocity", 1200.0),
    ("lift/drive", "velocity", 2400.0),
    ("fan/drive", "velocity", 900.0),
)
"""What the demo's own controller moves: drive, setpoint, and how far, in the setpoint's unit."""


def run(
    site: SiteArgument,
    role: Annotated[
        Literal["all", "bus", "opcua"], typer.Option(help="run one process alone: bus or opcua")
    ] = "all",
    parent: Annotated[int, typer.Option(hidden=True)] = 0,
    signs: Annotated[int | None, typer.Option(hidden=True)] = None,
    verbose: Verbose = False,
) -> None:
    """Run the bridge for SITE. Nodes of a virtual bus are simulated in the same process."""
    logs.set_up(verbose=verbose)
    project = load_project(site)
    if role == "opcua":
        from bridge.front import run_opcua

        become_front(parent)
        until_stopped(run_opcua(project.site, signs))
        return
    until_stopped(_serve(project, fronts=role == "all"))


def demo(verbose: Verbose = False) -> None:
    """Serve simulated drives on loopback: no root, no CAN, nothing to configure."""
    logs.set_up(verbose=verbose)
    with tempfile.TemporaryDirectory(prefix="drivebridge-") as folder:
        project = load_project(_demo_site(Path(folder)))
        until_stopped(_serve(project, fronts=True, controller=True, ready=lambda: _print_demo(project)))


def simulate(site: SiteArgument, verbose: Verbose = False) -> None:
    """Play every node of SITE on its buses, for a bridge that runs as another process."""
    logs.set_up(verbose=verbose)
    project = load_project(site)

    async def play() -> None:
        simulations = [_simulation(make_bus(table), table, project.path) for table in project.site.bus]
        try:
            async with asyncio.TaskGroup() as tasks:
                for simulation in simulations:
                    tasks.create_task(simulation.run())
                names = ", ".join(node.name for table in project.site.bus for node in table.node)
                print(f"simulating {names}; Ctrl-C ends it", flush=True)
        finally:
            for simulation in simulations:
                simulation.close()

    until_stopped(play())


def demo_controller(endpoint: str, moves: list[str], parent: int = 0) -> None:
    """The demo's controller, a process of its own."""
    from bridge.sim.controller import Move, run_controller

    logs.set_up(verbose=False)
    become_front(parent)
    run_controller(endpoint, [Move.from_text(move) for move in moves])


async def _serve(
    project: Project,
    *,
    fronts: bool,
    controller: bool = False,
    ready: Callable[[], None] = lambda: None,
) -> None:
    """The service, with simulated nodes on its virtual buses."""
    simulations: list[Simulation] = []

    def open_bus(table: BusTable) -> Bus:
        if table.interface != "virtual":
            return make_bus(table)
        wire = VirtualWire()
        simulations.append(_simulation(wire.end(f"{table.name}-simulation"), table, project.path))
        return wire.end(table.name)

    service = Service(project, open_bus, fronts=fronts, alarm=SignalAlarm())
    if controller and project.site.zenoh:
        service.fronts.append(_demo_controller(project.site.zenoh, project.site.site.name))
    async with asyncio.TaskGroup() as tasks:
        playing = [tasks.create_task(simulation.run()) for simulation in simulations]
        try:
            await service.run(ready)
        finally:
            for task in playing:
                task.cancel()


def _demo_controller(table: ZenohTable, site: str) -> Front:
    from bridge.sim.controller import Move

    moves = [str(Move(f"{table.prefix}/{site}/{drive}", value, most)) for drive, value, most in _DEMO_MOVES]
    return Front("demo controller", ["demo-controller", table.listen[0], *moves])


def _simulation(bus: Bus, table: BusTable, site: Path) -> Simulation:
    """All nodes of one bus, with the parameters that the site file gives their drives. A mapping that has
    no simulation of its own is played by the nearest that it extends."""
    nodes: list[SimulatedNode] = []
    folders = mapping_folders(site)
    for node in table.node:
        parameters: dict[str, float] = {}
        for drive in node.drive:
            parameters |= {f"{drive.slot}/{name}": value for name, value in drive.parameters.items()}
        known = [name for name in lineage(node.mapping, folders) if name in SIMULATED]
        nodes.append(simulate_node(known[0] if known else node.mapping, node.id, parameters))
    return Simulation(bus, nodes)


def _demo_site(folder: Path) -> Path:
    """The demo's site file, with its state and its sockets in ``folder``."""
    text = resources.files("bridge.demo").joinpath("site.toml").read_text(encoding="utf-8")
    places = f'name = "demo"\nstate_dir = "{folder}/state"\nruntime_dir = "{folder}/run"'
    path = folder / "site.toml"
    path.write_text(text.replace('name = "demo"', places, 1), encoding="utf-8")
    return path


def _print_demo(project: Project) -> None:
    site = project.site
    if not (site.modbus and site.opcua and site.zenoh):
        raise OperationFailed("the demo site serves all three protocols")
    key = f"{site.zenoh.prefix}/{site.site.name}"
    print(
        f"""
drivebridge demo: simulated drives on one virtual CAN bus

  conveyor    NORD SK TU4-CAO with the drives fu1 … fu4
  pump        Lenze 8400 motec
  lift        STÖBER MDS 5000
  fan         CiA 402, velocity mode

  Modbus TCP  {site.modbus.listen}                fu1 is yours: unit 1, holding registers 0 and 1
  OPC UA      opc.tcp://{site.opcua.listen}      fu2 is yours: Objects/Drives/conveyor/fu2
  zenoh       {site.zenoh.listen[0]}            fu3 is yours: {key}/conveyor/fu3/**
  fu4, pump, lift and fan are moved by a controller of the demo's own.

The OPC UA endpoint is open (no security, anonymous operator): it is bound to loopback.
Keep writing: a drive whose controller is silent for 1000 ms stops. Ctrl-C ends the demo.
""",
        flush=True,
    )


def until_stopped(work: Coroutine[Any, Any, None]) -> None:
    """Run ``work`` until it ends or SIGINT or SIGTERM arrives. Its one error is raised bare."""

    async def supervised() -> None:
        task = asyncio.ensure_future(work)
        loop = asyncio.get_running_loop()
        loop.set_exception_handler(logs.LoopFaults())
        stopped = False

        def stop() -> None:
            nonlocal stopped
            stopped = True
            task.cancel()

        for number in (signal.SIGINT, signal.SIGTERM):
            loop.add_signal_handler(number, stop)
        try:
            await task
        except asyncio.CancelledError:
            if not stopped:
                raise

    try:
        asyncio.run(supervised())
    except BaseExceptionGroup as group:
        raise _first(cast("BaseException", group)) from None


def _first(error: BaseException) -> BaseException:
    """The first error of nested groups: what a user is told."""
    while isinstance(error, BaseExceptionGroup):
        error = cast("BaseExceptionGroup[BaseException]", error).exceptions[0]
    return error
