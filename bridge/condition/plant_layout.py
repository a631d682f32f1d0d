"""Layout of a plant: its drives by node, its nodes by bus. Sans-IO."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

from bridge.catalogue import Catalogue
from bridge.condition.point_troubles import OwnFault
from bridge.image import Point

MOVES_BY: Final = ("velocity", "frequency", "speed", "position", "torque")
"""Values by which a drive is moved, the most telling first."""


@dataclass(frozen=True, slots=True)
class PlantLayout:
    """Drives ``<node>/<drive>`` with their nodes, nodes with their buses, by their names."""

    drives: Mapping[str, str]
    nodes: Mapping[str, str]
    buses: tuple[str, ...]
    mains: Mapping[str, str] = field(default_factory=dict[str, str])
    """Main value of each drive, such as ``frequency``, as far as it has one."""
    own_faults: Mapping[str, OwnFault] = field(default_factory=dict[str, OwnFault])
    bus_faults: Mapping[str, frozenset[str]] = field(default_factory=dict[str, frozenset[str]])
    """The numbers of the faults with which each drive answers a silent bus."""

    def above(self, place: str) -> tuple[str, ...]:
        """``place`` and what contains it, such as a drive, its node and its bus: ``conveyor/fu1``,
        ``conveyor``, ``bus/can0``."""
        if node := self.drives.get(place):
            return place, node, f"bus/{self.nodes[node]}"
        if bus := self.nodes.get(place):
            return place, f"bus/{bus}"
        return (place,)


def layout_of(points: Sequence[Point], catalogue: Catalogue) -> PlantLayout:
    """Layout of a site, with the main value of each drive by the ``points`` that are served."""
    units = {point.name: point.unit for point in points}
    drives = {drive.name: drive.node.name for drive in catalogue.drives.values()}
    return PlantLayout(
        drives=drives,
        nodes={node.name: node.bus.name for node in catalogue.nodes.values()},
        buses=tuple(bus.name for bus in catalogue.site.bus),
        mains=_mains(drives, units),
    )


def _mains(drives: Iterable[str], units: Mapping[str, str]) -> dict[str, str]:
    """The leaf of setpoint and actual value that tell most of each drive that has such a pair."""
    pairs: dict[str, list[str]] = {}
    for name, unit in units.items():
        drive, command, leaf = name.rpartition("/command/")
        if command and unit and f"{drive}/actual/{leaf}" in units:
            pairs.setdefault(drive, []).append(leaf)
    return {
        drive: next((leaf for leaf in MOVES_BY if leaf in pairs[drive]), pairs[drive][0])
        for drive in drives
        if drive in pairs
    }
