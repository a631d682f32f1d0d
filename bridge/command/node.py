"""A configured node and its members: its drives, or the device that it is instead."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain
from typing import NamedTuple, Protocol

from bridge.catalogue import MemberSpec, NodeSpec
from bridge.catalogue.codes import NODE_CODES
from bridge.command.commanded import Commanded
from bridge.command.device import Device
from bridge.command.drive import Drive, Identification
from bridge.command.drive_link import NodeState
from bridge.command.messages.event import EventQueue
from bridge.command.messages.request import Action, Identity
from bridge.image import Image
from bridge.mapping.axes import profile_of
from bridge.mapping.model import ObjectRef
from bridge.parameter import Ledger, Names
from bridge.text import Text


class Enforcement(NamedTuple):
    """Action on a node in the bridge's own name, and its reason."""

    node: str
    action: Action
    why: Text


class ParameterHolder(Protocol):
    """Holder of parameters: a drive, or a device."""

    name: str

    @property
    def spec(self) -> MemberSpec: ...

    @property
    def is_enabled(self) -> bool:
        """True while its motor may turn; parameters that affect that are then not written."""
        ...

    def refusal(self, identity: Identity) -> Text | None:
        """Reason why ``identity`` may not command it; None where it may."""
        ...

    def on_refused(self, now: float) -> None:
        """Count a request about it that was refused elsewhere as one refused here."""
        ...

    def on_sdo_refused(self, abort_code: int, now: float) -> None:
        """Show the abort code of an SDO that a client had asked for."""
        ...

    def on_parameter(self, name: str, setting: float, now: float) -> None:
        """Take over its own setting, in set 1, of a parameter that decides the meaning of process data."""
        ...


class Member(ParameterHolder, Protocol):
    """A drive or a device of a node: what of it is commanded, and its points. Times are monotonic seconds."""

    @property
    def commanded(self) -> Sequence[Commanded]: ...

    @property
    def identification(self) -> Identification:
        """Identity of its node, by the last boot-up."""
        ...

    @property
    def refused_writes(self) -> int:
        """Requests about it that were refused since the start."""
        ...

    def begin(self, now: float) -> None:
        """Show what is known from the start."""
        ...

    def on_node(self, state: NodeState, now: float) -> None:
        """Take over the state of its node."""
        ...

    def on_heard_again(self) -> None:
        """Go on: its node is heard again, and did not restart in between."""
        ...

    def look(self, now: float) -> None:
        """Bring to ``now`` what changes by itself."""
        ...


class Node:
    """A configured node with its drives, or the device that it is instead."""

    def __init__(
        self, spec: NodeSpec, drives: Sequence[Drive], devices: Sequence[Device], image: Image
    ) -> None:
        self.spec = spec
        self.name = spec.name
        self.bus, self.table, self.family = spec.bus, spec.table, spec.family
        self.drives, self.devices = drives, devices
        self.members: Sequence[Member] = (*drives, *devices)
        self.commanded: Sequence[Commanded] = tuple(
            chain.from_iterable(one.commanded for one in self.members)
        )
        self._image = image
        self._state, self._current_fault, self._last_fault = (
            image.index[f"{spec.name}/node/{leaf}"] for leaf in ("state", "current_fault", "last_fault")
        )

    def begin(self, now: float) -> None:
        """Show what is known from the start."""
        self._image.set(self._state, NODE_CODES[NodeState.ABSENT], now)
        self._image.set(self._current_fault, 0.0, now)
        self._image.set(self._last_fault, 0.0, now)
        for member in self.members:
            member.begin(now)
        for one in self.commanded:
            one.refresh(now)

    def show(self, now: float) -> None:
        """Show the state of a node with drives or outputs, and its fault 102.0, which is there while a
        controller is silent; it clears by itself and is then the last fault, as P170 does."""
        channels = [one.channel for one in self.commanded]
        silent = [one for one in channels if one.is_tripped and one.controller_is_overdue]
        fault = self.family.faults.bridge_timeout if silent else 0.0
        image = self._image
        image.set(self._state, NODE_CODES[channels[0].link.node], now)
        before = image[self._current_fault].value
        if before and not fault:
            image.set(self._last_fault, before, now)
        image.set(self._current_fault, fault, now)

    @property
    def names(self) -> Names:
        """The parameters of the node, or of its first axis."""
        return self.spec.axis_names.of()

    def is_of(self, who: ParameterHolder, ref: ObjectRef) -> bool:
        """Whether an object belongs to ``who`` and no other drive; with several axes, by its profile."""
        if all(one.spec.axis == 1 for one in self.members):
            return True
        return ref.index in profile_of(who.spec.axis)

    def on_state(self, state: NodeState, now: float) -> None:
        """Take over the state of the node."""
        for one in self.members:
            one.on_node(state, now)

    def on_heard_again(self) -> None:
        """Go on: the node is heard again, and did not restart in between."""
        for one in self.members:
            one.on_heard_again()


@dataclass(frozen=True, slots=True)
class BusSide:
    """The plant as the nodes of one bus see it: the nodes, the image of their points, and where they report
    events and count writes of an EEPROM. ``began`` is the monotonic time of what is known from the start."""

    nodes: Sequence[Node]
    image: Image
    events: EventQueue
    eeprom_writes: Ledger
    began: float
