"""Every drive family at once: simulated nodes on a virtual bus, and the whole bridge, in a thread."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Final, TypeVar

from bridge.command import Action, Identity, Outcome, Request
from bridge.config import BusTable
from bridge.drive import DriveState
from bridge.mapping import Family, load_family
from bridge.service import Service, load_project
from bridge.sim.catalogue import simulate_node
from bridge.sim.cia402_drive import Cia402Drive
from bridge.sim.lenze_motec import LenzeMotec
from bridge.sim.node import SimulatedNode
from bridge.sim.shell import Simulation
from bridge.sim.stoeber_5000 import Stoeber5000
from bridge.southbound.bus import Bus
from bridge.southbound.bus.frame import Frame
from bridge.southbound.bus.virtual import VirtualWire
from tests.support.process import free_port, until

_START_S: Final = 40.0
_PARAMETERS: Final = {"P105": 50.0, "P112": 10.0, "C00011": 1500.0, "C01": 3000.0}
"""Scaling of the families, where they have it."""

_SITE: Final = """
[site]
name = "families"
state_dir = "{folder}/state"
runtime_dir = "{folder}/run"

[[bus]]
name = "can0"
interface = "virtual"
bitrate = 1000000
sync_period_ms = 20
{nodes}
{servers}
"""
_NODE: Final = """
[[bus.node]]
name = "{name}"
id = {node_id}
mapping = "{mapping}"
supervision = "{supervision}"
supervision_ms = 1000

[[bus.node.drive]]
slot = "{slot}"
unit_id = {node_id}
control = "{control}"
fieldbus_timeout_ms = 20000
telegram_downtime_s = 0
parameters = {{ {parameters} }}
"""
_SERVERS: Final = {
    "modbus": '[modbus]\nlisten = "127.0.0.1:{port}"\n',
    "opcua": '[opcua]\nlisten = "127.0.0.1:{port}"\nno_security = true\nanonymous = "operator"\n',
    "zenoh": '[zenoh]\nlisten = ["tcp/127.0.0.1:{port}"]\n',
}

T = TypeVar("T")


def node_name(mapping: str, protocol: str) -> str:
    return f"{mapping.replace('/', '_').replace('-', '_')}_{protocol}"


class FamilySite:
    """A site with one node of each family for each protocol. ``drives`` has the names of the drives, by
    mapping and protocol; ``ports`` those of the servers."""

    def __init__(self, folder: Path, mappings: Sequence[str], protocols: Sequence[str]) -> None:
        self.path = folder / "families.toml"
        self.families = {mapping: load_family(mapping) for mapping in mappings}
        self.drives: dict[tuple[str, str], str] = {}
        self.ports = {protocol: free_port() for protocol in protocols}
        # Families with few addresses take the lowest.
        wanted = sorted(
            ((mapping, protocol) for mapping in mappings for protocol in protocols),
            key=lambda one: self.families[one[0]].family.node_id_high,
        )
        nodes = [self._node(node_id, *one) for node_id, one in enumerate(wanted, 1)]
        servers = [_SERVERS[protocol].format(port=port) for protocol, port in self.ports.items()]
        text = _SITE.format(folder=folder, nodes="".join(nodes), servers="\n".join(servers))
        self.path.write_text(text, encoding="utf-8")

    def _node(self, node_id: int, mapping: str, protocol: str) -> str:
        family, name = self.families[mapping], node_name(mapping, protocol)
        slot = family.slot[0].name
        self.drives[mapping, protocol] = f"{name}/{slot if len(family.slot) > 1 else 'drive'}"
        full = {value.full for value in family.value if value.full}
        return _NODE.format(
            name=name,
            node_id=node_id,
            mapping=mapping,
            supervision="guarding" if mapping.startswith("stoeber/") else "heartbeat",
            slot=slot,
            control=protocol,
            parameters=", ".join(f"{name} = {_PARAMETERS[name]}" for name in sorted(full)),
        )


class FamilyBridge:
    """The bridge of such a site with its simulated nodes. ``log`` has every frame of the bus while
    ``records`` is true."""

    def __init__(self, site: FamilySite) -> None:
        self.site = site
        self.log: list[Frame] = []
        self.records = False
        self._project = load_project(site.path)
        self._nodes: dict[str, SimulatedNode] = {}
        self._wire = VirtualWire()
        self._wire.listeners.append(self._on_frame)
        self._simulation: Simulation | None = None
        self._loop: asyncio.AbstractEventLoop | None = None
        self._work: asyncio.Task[None] | None = None
        self._ready = threading.Event()
        self._error: BaseException | None = None
        self._thread = threading.Thread(target=self._run, daemon=True)

    def _on_frame(self, frame: Frame) -> None:
        if self.records:
            self.log.append(frame)

    def _run(self) -> None:
        try:
            asyncio.run(self._serve())
        except asyncio.CancelledError:
            pass
        except BaseException as error:  # noqa: BLE001 - told by `running`
            self._error = error

    async def _serve(self) -> None:
        self._loop = asyncio.get_running_loop()
        self._work = asyncio.current_task()
        self.service = Service(self._project, self._open_bus, fronts="opcua" in self.site.ports)
        assert self._simulation
        playing = asyncio.create_task(self._simulation.run())
        try:
            await self.service.run(self._ready.set)
        finally:
            playing.cancel()

    def _open_bus(self, table: BusTable) -> Bus:
        nodes = {node.name: simulate_node(node.mapping, node.id, {}) for node in table.node}
        self._nodes = nodes
        self._simulation = Simulation(self._wire.end("simulation"), list(nodes.values()))
        return self._wire.end(table.name)

    def call(self, function: Callable[[], T]) -> T:
        """``function()`` in the bridge's own thread."""
        assert self._loop

        async def do() -> T:
            return function()

        return asyncio.run_coroutine_threadsafe(do(), self._loop).result(10.0)

    def value(self, point: str) -> object:
        return self.call(lambda: self.service.plant.image.read(point).value)

    def state(self, drive: str) -> DriveState:
        return self.call(lambda: self.service.plant.drives[drive].channel.state)

    def ask(self, action: Action, drive: str, identity: Identity, **more: object) -> Outcome:
        """A request as a protocol makes it, with its outcome."""
        outcomes: list[Outcome] = []
        request = Request(identity, drive, action, **more)  # pyright: ignore[reportArgumentType]
        assert self._loop
        now = self._loop.time
        self.call(lambda: self.service.plant.submit(request, now(), outcomes.append))
        until(lambda: outcomes, 5.0, f"an outcome of {action} {drive}")
        return outcomes[0]

    def fail(self, drive: str) -> None:
        """The motor of this drive gets too warm, or the nearest to it that the simulation has."""
        node = self._nodes[drive.partition("/")[0]]

        def happen() -> None:
            if isinstance(node, LenzeMotec):
                node.fail(111)
            elif isinstance(node, Stoeber5000):
                node.fail(41, 2)
            elif isinstance(node, Cia402Drive):
                node.fail(0x4310)
            else:
                node.fail_drive(1, 20)  # pyright: ignore[reportAttributeAccessIssue]: every NORD has it
            assert self._simulation
            self._simulation.poke()

        self.call(happen)

    def cut(self) -> None:
        """Nobody hears anybody any more; what is on its way arrives."""
        self.records = False
        self.call(lambda: setattr(self._wire, "cut", True))

    def start(self) -> None:
        """Until every node is operational and all servers are there."""
        self._thread.start()
        until(lambda: self._ready.is_set() or self._error, _START_S, "the bridge is ready")
        assert not self._error, self._error
        nodes = [f"{drive.partition('/')[0]}/node" for drive in self.site.drives.values()]
        for node in nodes:
            until(
                lambda node=node: str(self.value(f"{node}/boot_status")).startswith("ok"),
                _START_S,
                f"{node}: {self.value(f'{node}/boot_status')}",
            )

    def stop(self) -> None:
        if self._loop and self._work and self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._work.cancel)
        self._thread.join(15.0)
        assert not self._error, self._error


@contextmanager
def family_bridge(
    folder: Path, mappings: Sequence[str], protocols: Sequence[str]
) -> Iterator[FamilyBridge]:
    bridge = FamilyBridge(FamilySite(folder, mappings, protocols))
    try:
        bridge.start()
        yield bridge
    finally:
        bridge.stop()


def setpoint_of(family: Family) -> tuple[str, float] | None:
    """A setpoint of the family that is soon reached: name and value; None where it has none."""
    for value in family.value:
        if value.group == "command" and value.name in ("frequency", "velocity", "position"):
            return value.name, {"Hz": 5.0, "1/min": 120.0}.get(value.unit, 500.0)
    return None
