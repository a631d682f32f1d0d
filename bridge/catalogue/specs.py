"""Descriptions of what a site has: its nodes, its drives, and its devices, the nodes that are no drives."""

from __future__ import annotations

from dataclasses import dataclass

from bridge.config import BusTable, DriveTable, NodeTable
from bridge.image.point import Point
from bridge.mapping.model import Family, Slot
from bridge.parameter import AxisNames, Names


@dataclass(frozen=True, slots=True, eq=False)
class DriveSpec:
    """A drive, ``<node>/<drive>``. ``family`` is the node's as this drive has it, ``names`` are those of its
    parameters."""

    name: str
    bus: BusTable
    node: NodeTable
    table: DriveTable
    slot: Slot
    family: Family
    names: Names
    unit_id: int
    points: tuple[Point, ...]

    @property
    def control(self) -> str:
        """Protocol whose clients may command it, ``lease`` or ``none``."""
        return self.table.control

    @property
    def stop_by_anyone(self) -> bool:
        return self.table.stop_by_anyone

    @property
    def is_commanded(self) -> bool:
        """True where it has setpoints or outputs."""
        return True

    @property
    def has_parameters(self) -> bool:
        """True where an SDO channel that is open reaches its parameters."""
        return self.family.sdo_channel(self.slot, self.node.sdo_channels) is not None


@dataclass(frozen=True, slots=True, eq=False)
class DeviceSpec:
    """A node that is no drive: its inputs, and its outputs where it has some. ``points`` are its own
    and those that every node has."""

    bus: BusTable
    node: NodeTable
    family: Family
    names: Names
    unit_id: int
    points: tuple[Point, ...]

    @property
    def name(self) -> str:
        return self.node.name

    @property
    def control(self) -> str:
        """Protocol whose clients may command its outputs, ``lease`` or ``none``."""
        return self.node.outputs.control if self.is_commanded else "none"

    @property
    def stop_by_anyone(self) -> bool:
        return self.is_commanded and self.node.outputs.stop_by_anyone

    @property
    def is_commanded(self) -> bool:
        """True where it has setpoints or outputs."""
        return bool(self.family.output)

    @property
    def has_parameters(self) -> bool:
        """True where an SDO channel that is open reaches its parameters."""
        return True


@dataclass(frozen=True, slots=True, eq=False)
class NodeSpec:
    """A node with its drives, or the device that it is instead."""

    bus: BusTable
    table: NodeTable
    family: Family
    axis_names: AxisNames
    drives: tuple[DriveSpec, ...]
    device: DeviceSpec | None

    @property
    def name(self) -> str:
        return self.table.name
