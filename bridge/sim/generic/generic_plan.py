"""Plan of a simulated node of any kind: objects, PDOs and axes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

from bridge.mapping.axes import on_axis
from bridge.mapping.model import ControlWord, StatusWord
from bridge.sim.core.communication_objects import DeviceIdentity
from bridge.sim.core.communication_settings import (
    RPDO_BASES,
    TPDO_BASES,
    CobId,
    CommunicationSettings,
    PdoSettings,
    SdoSettings,
)
from bridge.sim.core.dictionary import IntegerType

At = tuple[int, int]
"""Index and sub-index."""
LEAST_ENTRIES: Final = 8


@dataclass(frozen=True, slots=True)
class NumberPlan:
    """A number as delivered; of a real its bit pattern."""

    at: At
    data_type: IntegerType
    value: int = 0
    readable: bool = True
    writable: bool = True
    in_rpdo: bool = False
    in_tpdo: bool = False
    low: int | None = None
    high: int | None = None


@dataclass(frozen=True, slots=True)
class BytesPlan:
    """A string or a domain as delivered."""

    at: At
    value: bytes = b""
    writable: bool = True


@dataclass(frozen=True, slots=True)
class Copy:
    """An actual value that is its set-point while the axis is enabled. One that does not ``stay`` is 0
    otherwise."""

    source: At
    target: At
    stays: bool = False

    def on_axis(self, axis: int) -> Copy:
        """The same of another axis than the first."""
        (source, source_sub), (target, target_sub) = self.source, self.target
        return Copy((on_axis(source, axis), source_sub), (on_axis(target, axis), target_sub), self.stays)


@dataclass(frozen=True, slots=True)
class AxisPlan:
    """A drive of the node: where its words are, and the tables of its family."""

    control: tuple[At, ...]
    """One object, or its bytes, the low one first."""
    status: tuple[At, ...]
    control_word: ControlWord
    status_word: StatusWord
    copies: tuple[Copy, ...] = ()
    error: At | None = None
    """Object that holds the code of its last error."""


@dataclass(frozen=True, slots=True)
class GenericPdo:
    """A PDO as delivered, numbered from 1. ``mapping`` has words ``IIIISSLLh``."""

    number: int
    cob_id: CobId
    mapping: tuple[int, ...]
    transmission_type: int = 255
    inhibit_100us: int = 0
    event_timer_ms: int = 0
    entries: int = LEAST_ENTRIES
    fixed_mapping: bool = False
    """True if the mapping cannot be written."""
    fixed_cob_id: bool = False


@dataclass(frozen=True, slots=True)
class NodePlan:
    """A whole node. ``only`` has the communication objects that it has; None: all that there are."""

    identity: DeviceIdentity
    objects: tuple[NumberPlan | BytesPlan, ...]
    rpdo: tuple[GenericPdo, ...] = ()
    tpdo: tuple[GenericPdo, ...] = ()
    axes: tuple[AxisPlan, ...] = ()
    mirrors: tuple[Copy, ...] = field(default=())
    """Values that show what was written, whatever the axes do."""
    only: frozenset[At] | None = None

    def with_numbers(self, values: Mapping[At, int]) -> NodePlan:
        """The same node, commissioned with these."""
        objects = tuple(
            replace(one, value=values.get(one.at, one.value)) if isinstance(one, NumberPlan) else one
            for one in self.objects
        )
        return replace(self, objects=objects)

    def communication(self, node_id: int) -> CommunicationSettings:
        """Communication objects as delivered."""
        return CommunicationSettings(
            emcy=CobId(0x80 + node_id),
            sdo=[SdoSettings.at(0x600 + node_id, 0x580 + node_id)],
            rpdo=_settings(self.rpdo, RPDO_BASES, node_id),
            tpdo=_settings(self.tpdo, TPDO_BASES, node_id),
        )


def _settings(plans: Sequence[GenericPdo], bases: Sequence[int], node_id: int) -> list[PdoSettings]:
    """All PDOs up to the highest; those between that there are not are off."""
    by_number = {plan.number: plan for plan in plans}
    settings: list[PdoSettings] = []
    for number in range(1, max(by_number, default=0) + 1):
        plan = by_number.get(number)
        if plan is None:
            base = bases[number - 1] if number <= len(bases) else 0
            settings.append(PdoSettings(base + node_id if base else 0, False, entries=[0] * LEAST_ENTRIES))
            continue
        entries = [*plan.mapping, *[0] * (max(plan.entries, len(plan.mapping)) - len(plan.mapping))]
        times = (plan.transmission_type, plan.inhibit_100us, plan.event_timer_ms)
        cob_id = plan.cob_id
        settings.append(PdoSettings(cob_id.cob_id, cob_id.enabled, *times, entries, len(plan.mapping)))
    return settings
