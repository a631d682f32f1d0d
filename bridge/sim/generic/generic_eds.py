"""A device description as the plan of a simulated node."""

from __future__ import annotations

import struct
from collections.abc import Iterator, Mapping
from typing import Final

from bridge.eds import Access, Description, Entry, StaticDataType
from bridge.eds.pdos import PdoSummary, pdos
from bridge.mapping import load_family
from bridge.mapping.axes import MOST_AXES, on_axis
from bridge.sim.core.communication_objects import DeviceIdentity
from bridge.sim.core.communication_settings import RPDO_BASES, TPDO_BASES, CobId
from bridge.sim.core.dictionary import IntegerType
from bridge.sim.generic.generic_family import MODE_DISPLAY
from bridge.sim.generic.generic_plan import (
    LEAST_ENTRIES,
    At,
    AxisPlan,
    BytesPlan,
    Copy,
    GenericPdo,
    NodePlan,
    NumberPlan,
)

_TYPES: Final = {
    StaticDataType.BOOLEAN: IntegerType.UNSIGNED8,
    StaticDataType.REAL32: IntegerType.UNSIGNED32,
    StaticDataType.REAL64: IntegerType.UNSIGNED64,
    **{StaticDataType[one.name]: one for one in IntegerType},
}
_REALS: Final = {StaticDataType.REAL32: "<f", StaticDataType.REAL64: "<d"}
_CONTROL: Final = 0x6040
_STATUS: Final = 0x6041
_ERROR: Final = 0x603F
_COPIES: Final = (
    Copy((0x6042, 0), (0x6044, 0)),
    Copy((0x60FF, 0), (0x606C, 0)),
    Copy((0x607A, 0), (0x6064, 0), stays=True),
)
_PROFILE: Final = "cia402/profile-position"
"""Mapping whose state machine a drive of the profile has; of all of them it says the most."""
_LEAST: Final = frozenset({(0x1000, 0), (0x1001, 0), (0x1018, 0), (0x1018, 1)})
"""Objects that CiA 301 requires of every node, whether its file has them or not."""


def plan_of_description(description: Description, node_id: int) -> NodePlan:
    """The node ``node_id`` as its file describes it. Of what is mapped into a PDO and not described, of other
    lengths, or shorter than a byte, nothing is known: such a PDO carries nothing."""
    entries = {(entry.index, entry.sub): entry for one in description.objects for entry in one.entries}
    axes = tuple(_axes(entries))
    plans = {True: list[GenericPdo](), False: list[GenericPdo]()}
    mapped: dict[bool, set[At]] = {True: set(), False: set()}
    for pdo in pdos(description, node_id):
        words = _mapping(pdo, entries)
        plans[pdo.receives].append(_pdo(description, pdo, words, node_id))
        mapped[pdo.receives] |= {(word >> 16, word >> 8 & 0xFF) for word in words}
    own = {at for axis in axes for at in (*axis.control, *axis.status)}
    objects = [
        _object(entry, node_id, in_rpdo=at in mapped[True], in_tpdo=at in mapped[False])
        for at, entry in entries.items()
        if at not in own
    ]
    return NodePlan(
        identity=_identity(description, node_id),
        objects=tuple(one for one in objects if one is not None),
        rpdo=tuple(plans[True]),
        tpdo=tuple(plans[False]),
        axes=axes,
        mirrors=tuple(MODE_DISPLAY.on_axis(axis) for axis in range(1, MOST_AXES + 1)),
        only=frozenset(entries) | _LEAST,
    )


def _axes(entries: Mapping[At, Entry]) -> Iterator[AxisPlan]:
    profile = load_family(_PROFILE)
    for axis in range(1, MOST_AXES + 1):
        control, status = ((on_axis(index, axis), 0) for index in (_CONTROL, _STATUS))
        if _is_word(entries.get(control)) and _is_word(entries.get(status)):
            copies = tuple(one.on_axis(axis) for one in _COPIES)
            error = (on_axis(_ERROR, axis), 0)
            yield AxisPlan((control,), (status,), profile.control_word, profile.status_word, copies, error)


def _is_word(entry: Entry | None) -> bool:
    return entry is not None and entry.data_type in (StaticDataType.UNSIGNED16, StaticDataType.INTEGER16)


def _identity(description: Description, node_id: int) -> DeviceIdentity:
    info = description.device_info

    def number(index: int, sub: int, otherwise: int | None) -> int:
        return description.number(index, sub, node_id) or otherwise or 0

    return DeviceIdentity(
        device_type=number(0x1000, 0, None),
        vendor_id=number(0x1018, 1, info.vendor_id),
        product_code=number(0x1018, 2, info.product_code),
        revision=number(0x1018, 3, info.revision),
        serial=number(0x1018, 4, 1),
        device_name=info.product.encode("ascii", "replace").decode() or "simulation",
        hardware_version="SIM",
        software_version="1.0",
    )


def _object(entry: Entry, node_id: int, *, in_rpdo: bool, in_tpdo: bool) -> NumberPlan | BytesPlan | None:
    """None where its length is not known."""
    if entry.data_type is None:
        return None
    at = (entry.index, entry.sub)
    plain = entry.current.at(node_id) if entry.current else None
    kind = _TYPES.get(entry.data_type)
    if kind is None:
        content = plain if isinstance(plain, bytes) else str(plain or "").encode("latin-1", "replace")
        return BytesPlan(at, content, entry.access.writable)
    value = _pattern(entry.data_type, plain)
    low, high = (_limit(limit.at(node_id) if limit else None, kind) for limit in (entry.low, entry.high))
    if entry.data_type in _REALS or (low is not None and high is not None and low > high):
        low = high = None
    return NumberPlan(
        at,
        kind,
        value,
        readable=entry.access is not Access.WO or in_tpdo,
        writable=entry.access.writable or in_rpdo,
        in_rpdo=in_rpdo or entry.pdo_mappable,
        in_tpdo=in_tpdo or entry.pdo_mappable,
        low=low,
        high=high,
    )


def _pattern(kind: StaticDataType, plain: object) -> int:
    if not isinstance(plain, int | float):
        return 0
    if kind in _REALS:
        try:
            return int.from_bytes(struct.pack(_REALS[kind], plain), "little")
        except OverflowError:
            return 0
    return int(plain)


def _limit(plain: object, kind: IntegerType) -> int | None:
    """None where it is no limit of this type: files have FFh as the highest INTEGER8."""
    if not isinstance(plain, int):
        return None
    bits = 8 * kind.size - kind.signed
    return plain if (-(1 << bits) if kind.signed else 0) <= plain < 1 << bits else None


def _mapping(pdo: PdoSummary, entries: dict[At, Entry]) -> tuple[int, ...]:
    words: list[int] = []
    for one in pdo.mapped:
        entry = entries.get((one.index, one.sub))
        kind = _TYPES.get(entry.data_type) if entry and entry.data_type else None
        is_dummy = pdo.receives and one.index < 0x20
        if not is_dummy and (kind is None or 8 * kind.size != one.bits):
            return ()
        words.append(one.index << 16 | one.sub << 8 | one.bits)
    return tuple(words) if sum(word & 0xFF for word in words) <= 64 else ()


def _pdo(description: Description, pdo: PdoSummary, words: tuple[int, ...], node_id: int) -> GenericPdo:
    communication = (0x1400 if pdo.receives else 0x1800) + pdo.number - 1
    mapping = communication + 0x200
    bases = RPDO_BASES if pdo.receives else TPDO_BASES
    cob_id = CobId(pdo.cob_id or 0, pdo.enabled)
    if pdo.cob_id is None:
        is_usual = pdo.number <= len(bases)
        cob_id = CobId(bases[pdo.number - 1] + node_id if is_usual else 0, is_usual)
    kind = pdo.transmission_type
    count = description.entry(mapping, 0)
    place = description.entry(communication, 1)
    described = description.object(mapping)
    return GenericPdo(
        number=pdo.number,
        cob_id=cob_id,
        mapping=words,
        transmission_type=255 if kind is None else kind,
        inhibit_100us=pdo.inhibit_100us,
        event_timer_ms=pdo.event_timer_ms,
        entries=max(len(described.entries) - 1 if described else 0, LEAST_ENTRIES),
        fixed_mapping=not (count and count.access.writable),
        fixed_cob_id=not (place and place.access.writable),
    )
