"""Descriptions of what a site has: its nodes, its drives, and its devices, the nodes that are no drives."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from bridge.config import BusTable, DriveTable, NodeTable, OutputsTable
from bridge.image.point import Point
from bridge.mapping.model import Family, Slot
from bridge.parameter import AxisNames, Names

FIRST_CHANNEL: Final = 1
"""Number of the SDO channel whose server is object 1200h."""


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
    def axis(self) -> int:
        """Logical device of the node that has its profile, 1 to 8 (CiA 301 §7.4.1)."""
        return self.slot.axis

    @property
    def sdo_channel(self) -> int | None:
        """Number of the SDO channel that reaches its parameters; None where none is open."""
        return self.family.sdo_channel(self.slot, self.node.sdo_channels)

    @property
    def is_on_first(self) -> bool:
        """True where its objects are those of the node's first SDO channel."""
        return self.family.is_on_first(self.slot)


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
    def table(self) -> OutputsTable:
        return self.node.outputs

    @property
    def slot(self) -> None:
        """None: it is no drive of its node."""
        return

    @property
    def control(self) -> str:
        """Protocol whose clients may command its outputs, ``lease`` or ``none``."""
        return self.table.control if self.is_commanded else "none"

    @property
    def stop_by_anyone(self) -> bool:
        return self.is_commanded and self.table.stop_by_anyone

    @property
    def is_commanded(self) -> bool:
        """True where it has setpoints or outputs."""
        return bool(self.family.output)

    @property
    def axis(self) -> int:
        """Logical device of the node that has its profile, 1 to 8 (CiA 301 §7.4.1)."""
        return 1

    @property
    def sdo_channel(self) -> int | None:
        """Number of the SDO channel that reaches its parameters; None where none is open."""
        return FIRST_CHANNEL

    @property
    def is_on_first(self) -> bool:
        """True where its objects are those of the node's first SDO channel."""
        return True


MemberSpec = DriveSpec | DeviceSpec
"""Member of a node: it has parameters, inputs or commands."""


@dataclass(frozen=True, slots=True, eq=False)
class NodeSpec:
    """A node with its drives, or the device that it is instead."""

    bus: BusTable
    table: NodeTable
    family: Family
    axis_names: AxisNames
    members: tuple[MemberSpec, ...]

    @property
    def name(self) -> str:
        return self.table.name

    @property
    def drives(self) -> tuple[DriveSpec, ...]:
        return tuple(one for one in self.members if isinstance(one, DriveSpec))

    @property
    def devices(self) -> tuple[DeviceSpec, ...]:
        return tuple(one for one in self.members if isinstance(one, DeviceSpec))

    @property
    def commanded(self) -> tuple[MemberSpec, ...]:
        """Members with setpoints or outputs."""
        return tuple(one for one in self.members if one.is_commanded)
