"""The nodes of a site file's bus, simulated."""

from __future__ import annotations

from pathlib import Path

from bridge.can import Bus
from bridge.config import BusTable
from bridge.mapping.loader import lineage, mapping_folders
from bridge.sim.catalogue import SIMULATED, simulate_node
from bridge.sim.device import SimulatedDevice
from bridge.sim.shell import Simulation


def simulation(bus: Bus, table: BusTable, site: Path) -> Simulation:
    """All nodes of one bus, with the parameters that the site file gives their drives. A mapping that has
    no simulation of its own is played by the nearest that it extends."""
    nodes: list[SimulatedDevice] = []
    folders = mapping_folders(site)
    simulated: dict[str, str] = {}
    for node in table.node:
        parameters: dict[str, float] = {}
        for drive in node.drive:
            parameters |= {f"{drive.slot}/{name}": value for name, value in drive.parameters.items()}
        if node.mapping not in simulated:
            known = (name for name in lineage(node.mapping, folders) if name in SIMULATED)
            simulated[node.mapping] = next(known, node.mapping)
        nodes.append(simulate_node(simulated[node.mapping], node.id, parameters))
    return Simulation(bus, nodes)
