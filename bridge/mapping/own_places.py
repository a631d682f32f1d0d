"""Objects of a family's own supervision, and the values that a site file asks for in them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Final

from bridge.canopen.datatypes import INTEGERS, Integer
from bridge.config import BusTable, NodeTable
from bridge.mapping.model import Family, ObjectRef, OwnObject, OwnSupervision, Slot
from bridge.text import Said, Text, Words

LIFE_TIME_FACTOR: Final = (0x100D, 0)
"""Life time factor: the life time is guard time (100Ch) × this (CiA 301 §7.5.2.12)."""

Raw = Mapping[tuple[int, int], int]
"""Values by index and sub-index, signed where the object's type is."""


@dataclass(frozen=True, slots=True)
class OwnPlace:
    """One object of the own supervision. ``low`` and ``high`` bound what it can hold, as on the wire."""

    name: str
    ref: ObjectRef
    data_type: str
    per_drive: bool
    low: int
    high: int
    states: Mapping[int, Words]
    absent: int | None = None
    """Value that counts where a node does not have the object."""

    @property
    def key(self) -> tuple[int, int]:
        return self.ref.index, self.ref.sub

    @property
    def number(self) -> Integer:
        """Integer type on the wire."""
        return INTEGERS[self.data_type]

    def shown(self, value: int) -> str:
        """Value as in ``C00593/1 is 0 (no reaction)``."""
        state = self.states.get(value)
        return f"{self.name} is {value}{f' ({state})' if state else ''}"


def place_of(family: Family, one: OwnObject) -> OwnPlace:
    """Object of a setting. The mapping's checks have seen to it that there is one."""
    if one.parameter is None:
        ref = family.place(one.object or ObjectRef(0, 0))
        per_drive = one.per_drive or family.is_per_axis(ref)
        number = INTEGERS[one.data_type]
        return OwnPlace(str(ref), ref, one.data_type, per_drive, number.low, number.high, {}, one.absent)
    parameter = family.parameter_named(one.parameter)
    number = INTEGERS[parameter.data_type]
    low, high = number.low, number.high
    if parameter.low is not None:
        low = max(low, round(parameter.low / parameter.factor))
    if parameter.high is not None:
        high = min(high, round(parameter.high / parameter.factor))
    ref = family.object_of(parameter)
    kind, states = parameter.data_type, dict(parameter.said_states)
    per_drive = one.per_drive or family.is_per_axis(ref)
    return OwnPlace(parameter.name, ref, kind, per_drive, low, high, states)


def places(family: Family, *, link: bool = False) -> list[OwnPlace]:
    """Objects that tell what a drive of the family would do, each once; with ``link`` also those of its watch
    over its interface."""
    found: dict[tuple[tuple[int, int], bool], OwnPlace] = {}
    for entry in family.own_supervision:
        if entry.watches == "link" and not link:
            continue
        one = place_of(family, entry)
        found.setdefault((one.key, one.per_drive), one)
        if entry.watches == "guarding":
            ref = ObjectRef(*LIFE_TIME_FACTOR)
            factor = OwnPlace(str(ref), ref, "uint8", False, 0, 0xFF, {})
            found.setdefault((factor.key, False), factor)
        if entry.reaction is not None:
            one = place_of(family, entry.reaction)
            found.setdefault((one.key, one.per_drive), one)
    return list(found.values())


@dataclass(frozen=True, slots=True)
class OwnWant:
    """Value that an object is to hold. With ``only_if`` it is written where the object holds one of these."""

    place: OwnPlace
    value: int
    only_if: tuple[int, ...] = ()

    def met_by(self, value: int) -> bool:
        return value not in self.only_if if self.only_if else value == self.value


def settable(family: Family) -> OwnSupervision | None:
    """Watch whose time ``own_timeout_ms`` sets; None where only ``supervision`` sets it."""
    kinds = ("process_data", "heartbeat")
    return next((entry for entry in family.own_supervision if entry.watches in kinds), None)


def wanted(family: Family, bus: BusTable, node: NodeTable) -> list[OwnWant]:
    """Values that ``own_timeout_ms`` of the node asks for: the time first, then the reaction."""
    entry = settable(family)
    if entry is None or node.own_timeout_ms is None:
        return []
    time_ms = node.own_timeout_ms
    is_heartbeat = entry.watches == "heartbeat"
    value = bus.master_node_id << 16 | time_ms if is_heartbeat else round(time_ms / entry.unit_ms)
    wants = [OwnWant(place_of(family, entry), value)]
    reaction = entry.reaction
    if reaction is not None and reaction.stop is not None:
        wants.append(OwnWant(place_of(family, reaction), reaction.stop, tuple(reaction.nothing)))
    return wants


def impossible(family: Family, time_ms: int) -> Said:
    """Reason why ``own_timeout_ms`` cannot be this; empty if it can."""
    entry = settable(family)
    name = family.family.name
    if entry is None:
        guards = any(one.watches == "guarding" for one in family.own_supervision)
        return Text.of("mapping.own_time_by_guarding" if guards else "mapping.own_time_unplaced", family=name)
    step_ms = entry.unit_ms
    if time_ms % step_ms:
        return Text.of("mapping.own_time_no_step", time=time_ms, step=step_ms, name=entry.name, family=name)
    place = place_of(family, entry)
    low, high = (1, 0xFFFF) if entry.watches == "heartbeat" else (max(1, place.low), place.high)
    if not low <= time_ms / step_ms <= high:
        least_ms, most_ms = low * step_ms, high * step_ms
        return Text.of("mapping.own_time_beyond", time=time_ms, family=name, low=least_ms, high=most_ms)
    return ""


def offline(
    family: Family, settings: Raw, bus: BusTable, node: NodeTable, slot: Slot | None
) -> dict[tuple[int, int], int]:
    """Values that the drive in ``slot`` will hold, or a node that is no drive, by the site file and the
    factory alone.

    ``settings`` are the node's downloads; they reach a drive's own objects where the first SDO channel does.
    ``enforce`` reaches them over an opened one, too.
    """
    channel = family.sdo_channel(slot, node.sdo_channels) if slot else 1
    raw: dict[tuple[int, int], int] = {}
    for one in _objects(family.own_supervision):
        place = place_of(family, one)
        if one.factory is not None:
            raw[place.key] = one.factory
        reaches = not place.per_drive or slot is None or slot.parameters_by_sdo
        if place.key in settings and reaches:
            raw[place.key] = place.number.from_word(place.number.to_word(settings[place.key]))
    guards = node.supervision == "guarding"
    for entry in family.own_supervision:
        if entry.watches == "guarding":
            raw[place_of(family, entry).key] = node.supervision_ms if guards else 0
            raw[LIFE_TIME_FACTOR] = node.life_time_factor if guards else 0
    if node.enforce:
        for want in wanted(family, bus, node):
            if want.place.per_drive and channel is None:
                continue
            if want.place.key not in raw or not want.met_by(raw[want.place.key]):
                raw[want.place.key] = want.value
    return raw


def ends_own_watch(family: Family, key: tuple[int, int], value: int) -> bool:
    """Whether this value in an object ends a drive's watch over its process data, or its reaction."""
    for entry in family.own_supervision:
        if entry.watches != "process_data":
            continue
        if place_of(family, entry).key == key and value in entry.off:
            return True
        reaction = entry.reaction
        if reaction is not None and place_of(family, reaction).key == key and value in reaction.nothing:
            return True
    return False


def channels_needed(family: Family, node: NodeTable, slots: Iterable[Slot]) -> list[int]:
    """Value that ``sdo_channels`` needs for the drives' own objects to be reached; empty where they are, or
    where no server reaches them."""
    if not any(place.per_drive for place in places(family)):
        return []
    servers = {server.slot: server.number for server in family.sdo}
    hidden = {servers[slot.name] for slot in slots if not slot.parameters_by_sdo and slot.name in servers}
    return [] if hidden.issubset(node.sdo_channels) else sorted(hidden.union(node.sdo_channels))


_SUGGESTED_MS: Final = 300
_LIVES: Final = 3


def suggested_ms(family: Family, bus: BusTable, node: NodeTable) -> int:
    """Time-out in ms: the site's own, or one that a pause of the bridge does not reach."""
    entry = settable(family)
    if node.own_timeout_ms is not None or entry is None:
        return node.own_timeout_ms or 0
    least_ms = max(_SUGGESTED_MS, _LIVES * bus.deadman_ms, _LIVES * bus.heartbeat_ms)
    return round(math.ceil(least_ms / entry.unit_ms) * entry.unit_ms)


def suggested(family: Family, bus: BusTable, node: NodeTable) -> list[OwnWant]:
    """Values that would make the drives of this node stop; none where only ``supervision`` sets the time."""
    time_ms = suggested_ms(family, bus, node)
    return wanted(family, bus, node.model_copy(update={"own_timeout_ms": time_ms}))


def _objects(entries: Iterable[OwnSupervision]) -> Iterable[OwnObject]:
    for entry in entries:
        yield entry
        if entry.reaction is not None:
            yield entry.reaction
