"""drivebridge with a simulated plant in which things break when they are told to.

broken_plant.py SITE PORT
Serves SITE, whose bus can0 is virtual and whose node 5 is a SK TU4-CAO, with its fronts. Each datagram that
comes to the UDP port PORT of loopback is the name of one of ``Plant``'s methods.
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
from bridge.config import BusTable
from bridge.project import load_project
from bridge.service.bus_process import BusProcess
from bridge.sim.nord.nord_tu4 import NordTu4
from bridge.sim.runner import Simulation


class Plant(asyncio.DatagramProtocol):
    def __init__(self, site: Path) -> None:
        self.project = load_project(site)
        self.wire = VirtualWire()
        self.stranger = self.wire.end("stranger")
        self.simulations: list[Simulation] = []

    def bus(self, table: BusTable) -> VirtualBus:
        (self.node,) = simulated_nodes(table, self.project.path)
        playing = Simulation(self.wire.end("simulation"), [self.node])
        self.wire.players.append(playing.catch_up)
        self.simulations.append(playing)
        self.end = self.wire.end(table.name)
        return self.end

    def datagram_received(self, data: bytes, addr: object) -> None:
        getattr(self, data.decode())()
        print("done:", data.decode(), flush=True)

    # what breaks

    def cut_cable(self) -> None:
        self.wire.cut = True

    def mend_cable(self) -> None:
        self.wire.cut = False

    def pull_adapter(self) -> None:
        """What a bus shows whose interface has gone: nothing comes, and nothing is sent later."""
        status = self.end.status
        status.state = ControllerState.DOWN
        status.outages += 1
        status.note_error("the interface has vanished")
        self.cut_cable()

    def plug_adapter(self) -> None:
        self.end.status.state = ControllerState.OK
        self.mend_cable()

    def fail_drive(self) -> None:
        assert isinstance(self.node, NordTu4)
        self.node.fail_drive("fu1", 30)
        self.simulations[0].poke()

    def intrude(self) -> None:
        """Somebody else enables fu1."""
        now = asyncio.get_running_loop().time()
        self.stranger.open(lambda: None)
        self.stranger.send(Frame(0x205, bytes.fromhex("7f04004000000000")), now, now + 1)

    def set_otherwise(self) -> None:
        """At its keypad, with the parameter set of another machine, and switched on again."""
        assert isinstance(self.node, NordTu4)
        for parameter_set in range(1, 5):
            self.node.drives[0].parameters.at_keypad(546, 4, element=1, parameter_set=parameter_set)
        self.node.power_cycle()
        self.simulations[0].poke()


async def main(site: Path, port: int) -> None:
    plant = Plant(site)
    service = BusProcess(plant.project, plant.bus)
    await asyncio.get_running_loop().create_datagram_endpoint(lambda: plant, ("127.0.0.1", port))
    async with asyncio.TaskGroup() as tasks:
        for one in plant.simulations:
            tasks.create_task(one.run())
        await service.run(lambda: print("serving", flush=True))


logs.set_up(verbose=False)
asyncio.run(main(Path(sys.argv[1]), int(sys.argv[2])))
