"""The nodes of a site file's bus, simulated."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from bridge.can import Bus
from bridge.config import BusTable
from bridge.derive import describe
from bridge.eds import read_whole_device_file
from bridge.mapping import Family
from bridge.mapping.loader import lineage, load_family, mapping_folders
from bridge.mapping.site import described_file
from bridge.sim.catalogue import SIMULATED, simulate_description, simulate_family, simulate_node
from bridge.sim.device import SimulatedDevice
from bridge.sim.shell import Simulation


def simulation(bus: Bus, table: BusTable, site: Path) -> Simulation:
    """All nodes of one bus."""
    return Simulation(bus, simulated_nodes(table, site))


def simulated_nodes(table: BusTable, site: Path) -> list[SimulatedDevice]:
    """The nodes of one bus, with the parameters that the site file gives their drives. A mapping of the
    site's own, under whatever name, is simulated as that file says."""
    nodes: list[SimulatedDevice] = []
    folders = mapping_folders(site)
    makers: dict[str, _Make] = {}
    for node in table.node:
        parameters: dict[str, float] = {}
        for drive in node.drive:
            parameters |= {f"{drive.slot}/{name}": value for name, value in drive.parameters.items()}
        if node.mapping not in makers:
            file = described_file(site, node.mapping)
            makers[node.mapping] = (
                _maker(node.mapping, folders) if file is None else _described(file, folders)
            )
        nodes.append(makers[node.mapping](node.id, parameters))
    return nodes


_Make = Callable[[int, dict[str, float]], SimulatedDevice]
"""A node of one mapping, by its id and parameters: files are read once for all nodes."""


def _maker(mapping: str, folders: Sequence[Path]) -> _Make:
    family = load_family(mapping, folders)
    if mapping in SIMULATED and family == load_family(mapping):
        return partial(simulate_node, mapping)
    return partial(simulate_family, lineage(mapping, folders), family)


def _described(file: Path, folders: Sequence[Path]) -> _Make:
    """A node of a device description. A drive is played as the mapping that is made of its file."""
    family = describe(file, folders)
    if family.is_device:
        description = read_whole_device_file(file)
        return lambda node_id, parameters: simulate_description(description, node_id)
    return partial(simulate_family, [file.name, *_bases(family, folders)], family)


def _bases(family: Family, folders: Sequence[Path]) -> list[str]:
    return lineage(family.extends, folders) if family.extends else []
