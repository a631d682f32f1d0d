"""Every drive family at once: simulated nodes on a virtual bus, and the whole bridge, in a thread."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Final, TypeVar

from bridge.can import Bus
from bridge.can.virtual import VirtualWire
from bridge.canopen.frame import Frame
from bridge.command import Action, Identity, Outcome, Request, command_of
from bridge.config import BusTable
from bridge.drive import DriveState
from bridge.mapping import Family, load_family
from bridge.project import load_project
from bridge.service.bus_process import BusProcess
from bridge.sim.catalogue import simulate_node
from bridge.sim.cia402.cia402_drive import Cia402Drive
from bridge.sim.core.simulated_device import SimulatedDevice
from bridge.sim.lenze.lenze_motec import LenzeMotec
from bridge.sim.nord.nord_single import NordSingle
from bridge.sim.nord.nord_tu4 import NordTu4
from bridge.sim.runner import Simulation
from bridge.sim.stoeber.stoeber_5000 import Stoeber5000
from tests.support import sites
from tests.support.process import free_port, until

_START_S: Final = 40.0
_PARAMETERS: Final = {"P105": 50.0, "P112": 10.0, "C00011": 1500.0, "C01": 3000.0}
"""Scaling of the families, where they have it."""

_SERVERS: Final = {"modbus": sites.modbus, "opcua": sites.opcua, "zenoh": sites.zenoh}
_MORE: Final = {
    "lenze/": "tpdo = { event_ms = 50 }",  # at factory it sends on a change only
}

T = TypeVar("T")


class FamilySite:
    """A site with one node of each family, all controlled by one protocol. ``drives`` has the names of the
    drives by mapping, ``units`` their Modbus units, ``port`` is the server's."""

    def __init__(self, folder: Path, mappings: Sequence[str], protocol: str) -> None:
        self.protocol = protocol
        self.families = {mapping: load_family(mapping) for mapping in mappings}
        self.drives: dict[str, str] = {}
        self.units: dict[str, int] = {}
        self.port = free_port()
        # Families with few addresses take the lowest.
        ordered = sorted(mappings, key=lambda mapping: self.families[mapping].family.node_id_high)
        nodes = [self._node(node_id, mapping) for node_id, mapping in enumerate(ordered, 1)]
        # Twenty drives and the test's client share a process: one may hold up the other.
        bus = sites.bus(*nodes, more="bitrate = 1000000\nsync_period_ms = 20\ndeadman_ms = 1000")
        self.path = sites.write(folder, bus, _SERVERS[protocol](self.port), name="families")

    def _node(self, node_id: int, mapping: str) -> str:
        family, name = self.families[mapping], mapping.replace("/", "_").replace("-", "_")
        slot = family.slot[0].name
        self.drives[mapping] = f"{name}/{slot if len(family.slot) > 1 else 'drive'}"
        self.units[mapping] = node_id
        full = sorted({value.full for value in family.value if value.full in _PARAMETERS})
        scaled = ", ".join(f"{parameter} = {_PARAMETERS[parameter]}" for parameter in full)
        own = [text for maker, text in _MORE.items() if mapping.startswith(maker)]
        more = [f"unit_id = {node_id}", "telegram_downtime_s = 0", f"parameters = {{ {scaled} }}", *own]
        kind = "guarding" if mapping.startswith("stoeber/") else "heartbeat"
        return sites.node(
            sites.drive(slot, self.protocol, 20_000, "\n".join(more)),
            name=name,
            node_id=node_id,
            mapping=mapping,
            more=f'supervision = "{kind}"\nsupervision_ms = 2000',
        )


class FamilyBridge:
    """The bridge of such a site with its simulated nodes. ``log`` has every frame of the bus while
    ``records`` is true."""

    def __init__(self, site: FamilySite) -> None:
        self.site = site
        self.log: list[Frame] = []
        self.records = False
        self._project = load_project(site.path)
        self._nodes: dict[str, SimulatedDevice] = {}
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
        self.service = BusProcess(self._project, self._open_bus)
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
        self._wire.players.append(self._simulation.catch_up)
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
        request = Request(identity, drive, command_of(action, **more))
        assert self._loop
        self.call(lambda: self.service.view.submit(request, outcomes.append))
        until(lambda: outcomes, 5.0, f"an outcome of {action} {drive}")
        return outcomes[0]

    def fail(self, drive: str) -> str:
        """The motor of this drive gets too warm, or the nearest to it that the simulation has. What the
        fault text then says."""
        node = self._nodes[drive.partition("/")[0]]

        def happen() -> str:
            assert self._simulation
            self._simulation.poke()
            if isinstance(node, LenzeMotec):
                node.fail(0x047F_0002)
                return "01.0127.00002 CE04"
            if isinstance(node, Stoeber5000):
                node.fail(41, 2)
            elif isinstance(node, Cia402Drive):
                node.fail(0x4310)
            elif isinstance(node, NordTu4):
                node.fail_drive(1, 20)
            elif isinstance(node, NordSingle):
                node.fail_drive(20)
            return "temperature"

        return self.call(happen)

    def cut(self) -> None:
        """Cut the bus: nobody hears anybody any more; what is on its way arrives."""
        self.call(self._cut)

    def _cut(self) -> None:
        self._wire.cut = True
        self.records = False

    def start(self) -> None:
        """Until every node is operational and all servers are there."""
        self._thread.start()
        until(lambda: self._ready.is_set() or self._error, _START_S, "the bridge is ready")
        assert not self._error, self._error
        assert self._loop
        # The bridge holds the ports of its fronts before they serve: a client that connects at once would
        # spend its patience on their start.
        asyncio.run_coroutine_threadsafe(self.service.supervisor.all_known(), self._loop).result(_START_S)
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
def family_bridge(folder: Path, mappings: Sequence[str], protocol: str) -> Iterator[FamilyBridge]:
    bridge = FamilyBridge(FamilySite(folder, mappings, protocol))
    try:
        bridge.start()
        yield bridge
    finally:
        bridge.stop()


def setpoint_of(family: Family) -> tuple[str, float] | None:
    """A setpoint of the family that is soon reached: name and value; None where it has none."""
    values = [value for value in family.values_of(family.slot[0]) if value.group == "command"]
    # A drive that follows positions turns for nothing else.
    values.sort(key=lambda value: value.follows is None)
    for value in values:
        if value.name in ("frequency", "velocity", "position"):
            return value.name, {"Hz": 2.0, "1/min": 120.0, "rev": 2.0}.get(value.unit, 500.0)
    return None


def speed_of(family: Family) -> dict[str, float]:
    """Speed at which a drive goes to its position, where that is a value of its own."""
    setpoint = setpoint_of(family)
    names = {value.name for value in family.values_of(family.slot[0]) if value.group == "command"}
    speeds = {"velocity": 9000.0, "frequency": 25.0} if setpoint and setpoint[0] == "position" else {}
    return {name: speed for name, speed in speeds.items() if name in names}
