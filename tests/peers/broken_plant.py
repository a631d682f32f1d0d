"""drivebridge with a simulated plant in which things break when they are told to.

broken_plant.py SITE PORT
Serves SITE, whose buses are virtual, with its fronts, until a signal ends it as it ends ``drivebridge run``.
Each datagram that comes to the UDP port PORT of loopback is the name of one of ``Plant``'s methods, and what
it is done to, a bus or a node: by default can0, and the first node, a SK TU4-CAO.
"""

from __future__ import annotations

import asyncio
import sys
from pathlib import Path

from bridge.can.interface import ControllerState
from bridge.can.virtual import VirtualBus, VirtualWire
from bridge.canopen.frame import Frame
from bridge.cli import logs
from bridge.cli.simulation import simulated_nodes
from bridge.cli.stopping import Shutdown, until_stopped
from bridge.config import BusTable
from bridge.project import load_project
from bridge.service.bus_process import BusProcess
from bridge.sim.core.simulated_device import SimulatedDevice
from bridge.sim.nord.nord_tu4 import NordTu4
from bridge.sim.runner import Simulation


class Plant(asyncio.DatagramProtocol):
    def __init__(self, site: Path) -> None:
        self.project = load_project(site)
        self.wires: dict[str, VirtualWire] = {}
        self.ends: dict[str, VirtualBus] = {}
        self.nodes: dict[str, SimulatedDevice] = {}
        self.simulations: dict[str, Simulation] = {}
        """By bus, as the wires and the ends; nodes are by their own names."""

    def bus(self, table: BusTable) -> VirtualBus:
        wire = self.wires[table.name] = VirtualWire()
        nodes = simulated_nodes(table, self.project.path)
        self.nodes |= zip((node.name for node in table.node), nodes, strict=True)
        playing = self.simulations[table.name] = Simulation(wire.end("simulation"), nodes)
        wire.players.append(playing.catch_up)
        end = self.ends[table.name] = wire.end(table.name)
        return end

    def datagram_received(self, data: bytes, addr: object) -> None:
        name, *what = data.decode().split()
        getattr(self, name)(*what)
        print("done:", data.decode(), flush=True)

    def poke(self) -> None:
        for one in self.simulations.values():
            one.poke()

    def node(self, name: str) -> NordTu4:
        found = self.nodes[name] if name else next(iter(self.nodes.values()))
        assert isinstance(found, NordTu4)
        return found

    # what breaks

    def cut_cable(self, bus: str = "can0") -> None:
        self.wires[bus].cut = True

    def mend_cable(self, bus: str = "can0") -> None:
        self.wires[bus].cut = False

    def pull_adapter(self) -> None:
        """What a bus shows whose interface has gone: nothing comes, and nothing is sent later."""
        status = self.ends["can0"].status
        status.state = ControllerState.DOWN
        status.outages += 1
        status.note_error("the interface has vanished")
        self.cut_cable()

    def plug_adapter(self) -> None:
        self.ends["can0"].status.state = ControllerState.OK
        self.mend_cable()

    def fail_drive(self, node: str = "", slot: str = "fu1") -> None:
        """With E003/3.0, overcurrent."""
        self.node(node).fail_drive(slot, 30)
        self.poke()

    def turn_knob(self, node: str = "", value: str = "0") -> None:
        """P102 of fu1, the acceleration time in 0.01 s, at its keypad."""
        self.node(node).drives[0].parameters.at_keypad(102, int(value), element=1, parameter_set=1)

    def intrude(self) -> None:
        """Somebody else enables fu1."""
        now = asyncio.get_running_loop().time()
        stranger = self.wires["can0"].end("stranger")
        stranger.open(lambda: None)
        stranger.send(Frame(0x205, bytes.fromhex("7f04004000000000")), now, now + 1)

    def set_otherwise(self) -> None:
        """At its keypad, with the parameter set of another machine, and switched on again."""
        node = self.node("")
        for parameter_set in range(1, 5):
            node.drives[0].parameters.at_keypad(546, 4, element=1, parameter_set=parameter_set)
        node.power_cycle()
        self.poke()


async def main(site: Path, port: int, ending: Shutdown) -> None:
    plant = Plant(site)
    service = BusProcess(plant.project, plant.bus)
    ending.first = service.halt
    await asyncio.get_running_loop().create_datagram_endpoint(lambda: plant, ("127.0.0.1", port))
    async with asyncio.TaskGroup() as tasks:
        playing = [tasks.create_task(one.run()) for one in plant.simulations.values()]
        try:
            await service.run(lambda: print("serving", flush=True))
        finally:
            for task in playing:
                task.cancel()


logs.set_up(verbose=False)
ending = Shutdown()
until_stopped(main(Path(sys.argv[1]), int(sys.argv[2]), ending), ending)
