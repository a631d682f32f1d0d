"""A configured node: its drives, or the device that it is instead, and what has parameters."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

from bridge.catalogue import NodeSpec
from bridge.command.commanded import Commanded
from bridge.command.device import Device
from bridge.command.drive import Drive
from bridge.command.link import NodeState
from bridge.command.messages.event import EventQueue
from bridge.command.messages.request import Action, Identity
from bridge.image import Image
from bridge.mapping.axes import profile_of
from bridge.mapping.model import ObjectRef
from bridge.parameter import Ledger, Names
from bridge.text import Text

Enforce = Callable[[str, Action, Text, float], None]
"""Does something to a node in the bridge's own name; the second text says why."""


class HasParameters(Protocol):
    """A drive, or a node that is none."""

    name: str

    @property
    def is_enabled(self) -> bool:
        """True while its motor may turn; parameters that affect that are then not written."""
        ...

    def refusal(self, identity: Identity) -> Text | None:
        """Reason why ``identity`` may not command it; None where it may."""
        ...

    def on_refused(self, now: float) -> None:
        """A request about it was refused elsewhere, and counts as one that is refused here."""
        ...

    def on_sdo_refused(self, abort_code: int, now: float) -> None:
        """It has refused an SDO that a client had asked for."""
        ...

    def on_parameter(self, name: str, setting: float, now: float) -> None:
        """Its own setting of a parameter, in set 1, that decides what process data mean."""
        ...


class Node:
    """A configured node and its drives, or the device that it is instead."""

    def __init__(self, spec: NodeSpec) -> None:
        self.spec = spec
        self.name = spec.name
        self.bus, self.table, self.family = spec.bus, spec.table, spec.family
        self.drives: list[Drive] = []
        self.device: Device | None = None

    @property
    def names(self) -> Names:
        """The parameters of the node, or of its first axis."""
        return self.spec.axis_names.of()

    def names_of(self, who: HasParameters) -> Names:
        """The parameters of one of those that the node has."""
        return who.spec.names if isinstance(who, Drive) else self.names

    def is_of(self, who: HasParameters, ref: ObjectRef) -> bool:
        """An object is that of one who has parameters, and no other drive's of the node: of a node with
        several axes those of its profile."""
        if not isinstance(who, Drive) or all(one.slot.axis == 1 for one in self.drives):
            return True
        return ref.index in profile_of(who.slot.axis)

    @property
    def with_parameters(self) -> Sequence[HasParameters]:
        return [self.device] if self.device else self.drives

    @property
    def commanded(self) -> Sequence[Commanded]:
        """Its drives, or the outputs of the device that it is."""
        if self.device:
            return [self.device.outputs] if self.device.outputs else []
        return self.drives

    def on_state(self, state: NodeState, now: float) -> None:
        """The node is in another state: what is commanded of it, and what it has as a device."""
        for drive in self.drives:
            drive.channel.on_node(state, now)
        if self.device:
            self.device.on_node(state, now)
            if self.device.outputs:
                self.device.outputs.channel.on_node(state, now)

    def on_heard_again(self) -> None:
        """The node is heard again, and did not restart in between."""
        for drive in self.drives:
            drive.on_heard_again()


@dataclass(frozen=True, slots=True)
class BusSide:
    """The plant as the nodes of one bus have it: who they are, where they show their points, report events
    and count writes of an EEPROM. ``began`` is the monotonic time of what is known from the start."""

    nodes: Sequence[Node]
    image: Image
    events: EventQueue
    eeprom_writes: Ledger
    began: float
