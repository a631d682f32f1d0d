"""The nodes of a site file's bus, simulated."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Final

import typer

from bridge.can import Bus
from bridge.config import BusTable, Site
from bridge.derive import describe
from bridge.eds import read_whole_device_file
from bridge.mapping import Family
from bridge.mapping.loader import lineage, load_family, mapping_folders
from bridge.mapping.site_families import described_file
from bridge.sim.catalogue import SIMULATED, simulate_description, simulate_family, simulate_node, values_of
from bridge.sim.core.habit import Rule, load_habit
from bridge.sim.core.simulated_device import SimulatedDevice
from bridge.sim.runner import Simulation

Habits = Mapping[str, Sequence[Rule]]
"""Rules by the name of the node that has them."""
NONE: Final[Habits] = MappingProxyType({})


def simulation(bus: Bus, table: BusTable, site: Path, habits: Habits = NONE) -> Simulation:
    """All nodes of one bus."""
    return Simulation(bus, simulated_nodes(table, site, habits))


def simulated_nodes(table: BusTable, site: Path, habits: Habits = NONE) -> list[SimulatedDevice]:
    """The nodes of one bus, with the parameters that the site file gives their drives. A mapping of the
    site's own, under whatever name, is simulated as that file says."""
    nodes: list[SimulatedDevice] = []
    folders = mapping_folders(site)
    makers: dict[str, _Make] = {}
    for node in table.node:
        parameters: dict[str, float] = {}
        for drive in node.drive:
            parameters |= {f"{drive.slot}/{name}": value for name, value in drive.parameters.items()}
        key = node.mapping_key
        if key not in makers:
            file = described_file(site, key)
            makers[key] = _maker(key, folders) if file is None else _described(file, folders, node.modules)
        simulated = makers[key](node.id, parameters)
        if node.name in habits:
            simulated.adopt_habits(habits[node.name])
        nodes.append(simulated)
    return nodes


_Make = Callable[[int, dict[str, float]], SimulatedDevice]
"""A node of one mapping, by its id and parameters: files are read once for all nodes."""


def _maker(mapping: str, folders: Sequence[Path]) -> _Make:
    family = load_family(mapping, folders)
    if mapping in SIMULATED and family == load_family(mapping):
        return partial(simulate_node, mapping)
    return partial(simulate_family, lineage(mapping, folders), family)


def _described(file: Path, folders: Sequence[Path], modules: Sequence[str]) -> _Make:
    """A node of a device description. A drive with one axis is played as the mapping that is made of its
    file: it has a motor."""
    family = describe(file, folders, modules)
    if {slot.axis for slot in family.slot} != {1}:
        description = read_whole_device_file(file, modules)
        return lambda node_id, parameters: simulate_description(
            description, node_id, values_of(family, parameters)
        )
    return partial(simulate_family, [file.name, *_bases(family, folders)], family)


def _bases(family: Family, folders: Sequence[Path]) -> list[str]:
    return lineage(family.extends, folders) if family.extends else []


def habits_of(words: Sequence[str], site: Site) -> Habits:
    """Habits by node from ``NODE=HABIT``. Raises ``BadParameter`` for a node that the site does not have,
    ``FileFaults`` and ``OperationFailed`` for a habit that cannot be read."""
    names = {node.name for bus in site.bus for node in bus.node}
    found: dict[str, list[Rule]] = {}
    for word in words:
        node, _, habit = word.partition("=")
        if not habit:
            raise typer.BadParameter(f"--habit {word}: give NODE=HABIT")
        if node not in names:
            raise typer.BadParameter(f"--habit {word}: {node} is no node; {', '.join(sorted(names))}")
        found.setdefault(node, []).extend(load_habit(habit).rule)
    return found
