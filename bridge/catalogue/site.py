"""The catalogue of a site: everything that its servers and exports have to know of it before it runs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import chain
from typing import Self

from bridge.catalogue.points import site_points
from bridge.catalogue.specs import DeviceSpec, DriveSpec, MemberSpec, NodeSpec
from bridge.catalogue.unit_ids import DEVICE, unit_ids
from bridge.config import BusTable, NodeTable, Site
from bridge.image.point import Point
from bridge.mapping.model import Family
from bridge.parameter import AxisNames


@dataclass(frozen=True, slots=True, eq=False)
class Catalogue:
    """Points, nodes, and members of nodes, by their names and in the order of the site file."""

    site: Site
    points: tuple[Point, ...]
    nodes: Mapping[str, NodeSpec]
    members: Mapping[str, MemberSpec]
    drives: Mapping[str, DriveSpec]
    devices: Mapping[str, DeviceSpec]
    """Nodes that are no drives."""

    @classmethod
    def of(cls, site: Site, families: Mapping[str, Family]) -> Self:
        """The catalogue of ``site``, whose ``families`` are by the node's mapping. Raises ``FileFaults``
        where there are not enough unit ids."""
        names = {mapping: AxisNames(family) for mapping, family in families.items()}
        points = site_points(site, families, {mapping: one.of() for mapping, one in names.items()})
        maker = _Maker(points, unit_ids(site))
        nodes = {
            node.name: maker.node(bus, node, families[node.mapping_key], names[node.mapping_key])
            for bus in site.bus
            for node in bus.node
        }
        return cls(
            site,
            tuple(chain.from_iterable(points.values())),
            nodes,
            {one.name: one for node in nodes.values() for one in node.members},
            {one.name: one for node in nodes.values() for one in node.drives},
            {one.name: one for node in nodes.values() for one in node.devices},
        )


@dataclass(frozen=True, slots=True)
class _Maker:
    """``points`` are by what has them, ``unit_ids`` as ``unit_ids`` gives them."""

    points: Mapping[str, list[Point]]
    unit_ids: Mapping[tuple[str, int], int]

    def node(self, bus: BusTable, node: NodeTable, family: Family, names: AxisNames) -> NodeSpec:
        members: list[MemberSpec] = [
            self._drive(bus, node, place, family, names) for place in range(len(node.drive))
        ]
        if family.is_device:
            unit_id = self.unit_ids[node.name, DEVICE]
            members.append(DeviceSpec(bus, node, family, names.of(), unit_id, tuple(self.points[node.name])))
        return NodeSpec(bus, node, family, names, tuple(members))

    def _drive(
        self, bus: BusTable, node: NodeTable, place: int, family: Family, names: AxisNames
    ) -> DriveSpec:
        """The drive at ``place`` among those of its node."""
        table = node.drive[place]
        name, slot = f"{node.name}/{family.leaf_of(table)}", family.slot_named(table.slot)
        return DriveSpec(
            name,
            bus,
            node,
            table,
            slot,
            family.of_slot(slot),
            names.of(slot.axis),
            self.unit_ids[node.name, place],
            tuple(self.points[name]),
        )
