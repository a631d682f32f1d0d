"""``run``, ``demo``, ``simulate``: the commands that stay up."""

from __future__ import annotations

import asyncio
import logging
import tempfile
from collections.abc import Callable, Collection
from functools import partial
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from bridge.base.errors import BridgeError, OperationFailed
from bridge.cli import logs
from bridge.cli.ending_signals import ending_signals
from bridge.cli.stopping import Shutdown, until_stopped
from bridge.config import BusTable, ZenohTable
from bridge.service.front_process import Front, become_front, give_reason
from bridge.service.fronts import FRONTS, FrontKind, ProcessRole

# The service is not imported for a front: after one has ended, its clients wait for the next.
if TYPE_CHECKING:
    from bridge.can import Bus
    from bridge.project import Project
    from bridge.sim.runner import Simulation


SiteArgument = Annotated[Path, typer.Argument(metavar="SITE", help="the site file")]
_FRONTS: Final = " or ".join((", ".join(kind.role for kind in FRONTS[:-1]), FRONTS[-1].role))
Verbose = Annotated[bool, typer.Option("--verbose", "-v", help="log more")]
_log = logging.getLogger(__name__)
_DEMO_MOVES = (
    ("conveyor/fu4", "frequency", 40.0),
    ("pump/drive", "velocity", 1200.0),
    ("lift/drive", "velocity", 2400.0),
    ("fan/drive", "velocity", 900.0),
)
"""Movements of the demo's own controller: drive, setpoint, and its greatest value, in the setpoint's unit."""


def run(
    site: SiteArgument,
    role: Annotated[
        list[ProcessRole] | None,
        typer.Option(help=f"run one process alone: bus, {_FRONTS}; or bus with some of the others"),
    ] = None,
    parent: Annotated[int, typer.Option(hidden=True)] = 0,
    signs: Annotated[int | None, typer.Option(hidden=True)] = None,
    listening: Annotated[int | None, typer.Option(hidden=True)] = None,
    verbose: Verbose = False,
) -> None:
    """Run the bridge for SITE. Nodes of a virtual bus are simulated in the same process."""
    logs.set_up(verbose=verbose)
    roles = role or [ProcessRole.ALL]
    fronts = [kind for kind in FRONTS if kind.role in roles]
    if fronts and ProcessRole.BUS not in roles:
        if len(roles) > 1:
            raise BridgeError("a process has one role; with bus, those of the fronts that it is to start")
        [front] = fronts
        _become_front(parent, is_prompt=front.is_prompt)
        try:
            until_stopped(front.run()(site, signs, listening))
        except BridgeError as error:
            if signs is not None:
                give_reason(signs, str(error))
            raise
        return
    from bridge.project import load_project

    ending = Shutdown()
    started = FRONTS if ProcessRole.ALL in roles else fronts
    until_stopped(_serve(load_project(site), ending, fronts=started), ending)


def demo(verbose: Verbose = False) -> None:
    """Serve simulated drives on loopback: no root, no CAN, nothing to configure."""
    from bridge.project import load_project

    logs.set_up(verbose=verbose)
    with tempfile.TemporaryDirectory(prefix="drivebridge-") as folder:
        project = load_project(_demo_site(Path(folder)))
        ending = Shutdown()
        ready = partial(_print_demo, project)
        until_stopped(_serve(project, ending, controller=True, ready=ready), ending)


def simulate(
    site: SiteArgument,
    habit: Annotated[
        list[str] | None,
        typer.Option(metavar="NODE=HABIT", help="a habit, by its name or its file, that a node has"),
    ] = None,
    verbose: Verbose = False,
) -> None:
    """Simulate every node of SITE on its buses, for a bridge that runs as another process."""
    from bridge.can import open_all
    from bridge.cli.simulation import habits_of, simulation
    from bridge.project import load_project
    from bridge.service.bus_process import make_bus

    logs.set_up(verbose=verbose)
    project = load_project(site)
    habits = habits_of(habit or [], project.site)

    async def play() -> None:
        simulations = [simulation(make_bus(table), table, project.path, habits) for table in project.site.bus]
        try:
            open_all(one.open for one in simulations)
            async with asyncio.TaskGroup() as tasks:
                for one in simulations:
                    tasks.create_task(one.run())
                names = ", ".join(node.name for table in project.site.bus for node in table.node)
                print(f"simulating {names}; Ctrl-C ends it", flush=True)
        finally:
            for one in simulations:
                one.close()

    until_stopped(play())


def demo_controller(endpoint: str, moves: list[str], parent: int = 0) -> None:
    """The demo's controller, a process of its own."""
    from bridge.sim.controller import Move, run_controller

    logs.set_up(verbose=False)
    _become_front(parent)
    run_controller(endpoint, [Move.from_text(move) for move in moves])


def _become_front(parent: int, *, is_prompt: bool = False) -> None:
    """A front that is still starting has nothing to clean up."""
    ending_signals.let_kill()
    become_front(parent, is_prompt=is_prompt)


async def _serve(
    project: Project,
    ending: Shutdown,
    *,
    fronts: Collection[FrontKind[Any]] = FRONTS,
    controller: bool = False,
    ready: Callable[[], None] = lambda: None,
) -> None:
    """The service, with simulated nodes on its virtual buses."""
    from bridge.base.memory_lock import lock_memory
    from bridge.master.standstill import SignalAlarm
    from bridge.recorder.recorder import Recorder
    from bridge.service.bus_process import BusProcess, make_bus

    why_not = lock_memory()
    if why_not:
        _log.info("memory is not locked: %s", why_not)

    simulations: list[Simulation] = []

    def open_bus(table: BusTable) -> Bus:
        if table.interface != "virtual":
            return make_bus(table)
        from bridge.can.virtual import VirtualWire
        from bridge.cli.simulation import simulation

        wire = VirtualWire()
        nodes = simulation(wire.end(f"{table.name}-simulation"), table, project.path)
        wire.players.append(nodes.catch_up)
        simulations.append(nodes)
        return wire.end(table.name)

    recorder = Recorder(project.site) if project.site.recorder.enabled else None
    alarm = recorder.alarm() if recorder else SignalAlarm()
    service = BusProcess(project, open_bus, fronts=fronts, alarm=alarm, recorder=recorder)
    ending.first = service.halt
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


def _demo_site(folder: Path) -> Path:
    """The demo's site file, with its state and its sockets in ``folder``."""
    text = resources.files("bridge.demo").joinpath("site.toml").read_text(encoding="utf-8")
    places = f'name = "demo"\nstate_dir = "{folder}/state"\nruntime_dir = "{folder}/run"'
    path = folder / "site.toml"
    path.write_text(text.replace('name = "demo"', places, 1), encoding="utf-8")
    return path


def _print_demo(project: Project) -> None:
    site = project.site
    if not (site.page and site.modbus and site.opcua and site.zenoh):
        raise OperationFailed("the demo site serves the page and all three protocols")
    key = f"{site.zenoh.prefix}/{site.site.name}"
    print(
        f"""
drivebridge demo: simulated drives on one virtual CAN bus

  Web page    http://{site.page.listen}/        open it first

  conveyor    NORD SK TU4-CAO with the drives fu1 … fu4
  pump        Lenze 8400 motec
  lift        STÖBER MDS 5000
  fan         CiA 402, velocity mode

  Modbus TCP  {site.modbus.listen}                fu1 is yours: unit 1, holding registers 0 and 1
  OPC UA      opc.tcp://{site.opcua.listen}      fu2 is yours: Objects/Drives/conveyor/fu2
  zenoh       {site.zenoh.listen[0]}            fu3 is yours: {key}/conveyor/fu3/**
  fu4, pump, lift and fan are moved by a controller of the demo's own.

Page and OPC UA endpoint are open (no security, anonymous operator): they are bound to loopback.
Keep writing: a drive whose controller is silent for 1000 ms stops. Ctrl-C ends the demo.
""",
        flush=True,
    )
