"""A mapping file as the plan of a simulated node."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Final

from bridge.canopen.datatypes import INTEGERS, REALS, Plain, TypeName, encode
from bridge.image import DataType as PointType
from bridge.mapping import Family
from bridge.mapping.device_signals import Output, Signal
from bridge.mapping.entry_types import WORD_BITS
from bridge.mapping.model import (
    IdentityRule,
    MappedObject,
    ObjectRef,
    Parameter,
    Pdo,
    ProcessValue,
    Slot,
)
from bridge.sim.core.communication_objects import DeviceIdentity
from bridge.sim.core.communication_settings import RPDO_BASES, TPDO_BASES, CobId
from bridge.sim.core.dictionary import IntegerType
from bridge.sim.generic.generic_plan import At, AxisPlan, BytesPlan, Copy, GenericPdo, NodePlan, NumberPlan

NUMBER_TYPES: Final[dict[TypeName, IntegerType]] = {
    "bool": IntegerType.UNSIGNED8,
    "int8": IntegerType.INTEGER8,
    "int16": IntegerType.INTEGER16,
    "int32": IntegerType.INTEGER32,
    "int64": IntegerType.INTEGER64,
    "uint8": IntegerType.UNSIGNED8,
    "uint16": IntegerType.UNSIGNED16,
    "uint32": IntegerType.UNSIGNED32,
    "uint64": IntegerType.UNSIGNED64,
    "real32": IntegerType.UNSIGNED32,
    "real64": IntegerType.UNSIGNED64,
}
_UNSIGNED: Final = {
    8: IntegerType.UNSIGNED8,
    16: IntegerType.UNSIGNED16,
    32: IntegerType.UNSIGNED32,
    64: IntegerType.UNSIGNED64,
}
_SIGNED: Final = {
    8: IntegerType.INTEGER8,
    16: IntegerType.INTEGER16,
    32: IntegerType.INTEGER32,
    64: IntegerType.INTEGER64,
}
_POLLED: Final = {
    PointType.UINT8: IntegerType.UNSIGNED8,
    PointType.UINT16: IntegerType.UNSIGNED16,
    PointType.UINT32: IntegerType.UNSIGNED32,
    PointType.INT16: IntegerType.INTEGER16,
    PointType.INT32: IntegerType.INTEGER32,
}
MODE_DISPLAY: Final = Copy((0x6060, 0), (0x6061, 0))
_STAYS: Final = "position"
"""An actual value of this name stays where it is when the drive is not enabled."""
_PDO_BITS: Final = 64
_PDO_ENTRIES: Final = 8
_DIGITAL_OUTPUTS: Final = range(0x6200, 0x6400)
"""CiA 401: a bit of error mode and error value for each of them."""
_EVENT_MS: Final = 500
"""Longest period in ms of the TPDOs of a device whose mapping says nothing of PDOs."""


def identity_of(rule: IdentityRule, name: str, *, device_type: int = 0) -> DeviceIdentity:
    """Identity by which a node is taken for one of this family."""
    return DeviceIdentity(
        device_type=rule.device_type if rule.device_type is not None else device_type,
        vendor_id=rule.vendor_id or 0,
        product_code=rule.product_code or 0,
        revision=rule.revision or 1,
        serial=1,
        device_name=name.encode("ascii", "replace").decode(),
        hardware_version="SIM",
        software_version="1.0",
    )


def plan_of_family(family: Family, node_id: int) -> NodePlan:
    """A node that is as the mapping says. PDOs, words and parameters are those of the file."""
    objects = {plan.at: plan for plan in objects_of_family(family)}
    axes = tuple(_axis(family, slot) for slot in family.slot)
    of_device, to_device = _device_pdos(family, node_id)
    for axis in axes:
        for at in (*axis.control, *axis.status):
            objects.pop(at, None)
    return NodePlan(
        identity=identity_of(family.identity, family.family.name),
        objects=tuple(objects.values()),
        rpdo=(*(_pdo(pdo, node_id) for slot in family.slot for pdo in slot.rpdo), *to_device),
        tpdo=(*(_pdo(pdo, node_id) for slot in family.slot for pdo in slot.tpdo), *of_device),
        axes=axes,
        mirrors=tuple(MODE_DISPLAY.on_axis(slot.axis) for slot in family.slot) or (MODE_DISPLAY,),
    )


def objects_of_family(family: Family) -> list[NumberPlan | BytesPlan]:
    """Every object that the mapping speaks of, as delivered: parameters, what is polled, watched or written
    at start, and what the PDOs carry."""
    axes = [family.of_slot(slot) for slot in family.slot] or [family]
    objects = {
        (ref.index, ref.sub): parameter_plan((ref.index, ref.sub), parameter)
        for axis in axes
        for parameter in family.parameter
        for ref in (axis.object_of(parameter),)
    }
    for at, kind, value in (further for axis in axes for further in _further(axis)):
        objects.setdefault(at, NumberPlan(at, kind, value))
    for signal in family.input:
        at = (signal.object.index, signal.object.sub)
        objects[at] = NumberPlan(at, NUMBER_TYPES[signal.data_type], writable=False, in_tpdo=True)
    for output in family.output:
        objects |= {plan.at: plan for plan in _output_objects(output)}
    parts = [part for slot in family.slot for pdo in (*slot.rpdo, *slot.tpdo) for part in _parts(pdo)]
    for at, bits, is_signed in parts:
        there = objects.get(at)
        if not isinstance(there, NumberPlan) or 8 * there.data_type.size != bits:
            there = NumberPlan(at, (_SIGNED if is_signed else _UNSIGNED)[bits])
        objects[at] = replace(there, in_rpdo=True, in_tpdo=True)
    return list(objects.values())


def parameter_plan(at: At, parameter: Parameter) -> NumberPlan | BytesPlan:
    """The object of a parameter: its ``default``, else 0 or the nearest that it may be."""
    kind = NUMBER_TYPES.get(parameter.data_type)
    if kind is None:
        content = b"" if parameter.default is None else encode(parameter.data_type, parameter.default)
        return BytesPlan(at, content, parameter.writable)
    low, high = (_raw(limit, parameter) for limit in (parameter.low, parameter.high))
    if parameter.default is None:
        value = max(low or 0, 0) if high is None or high >= 0 else high
    else:
        value = pattern(parameter.data_type, parameter.default)
    return NumberPlan(at, kind, value, parameter.readable, parameter.writable, low=low, high=high)


def pattern(kind: TypeName, value: Plain) -> int:
    """The number that the bytes of ``value`` are as an integer of their length; of an integer itself.
    Raises ValueError where it does not fit."""
    if kind in INTEGERS:
        return INTEGERS[kind].decode(encode(kind, value))
    return int.from_bytes(encode(kind, value), "little")


def _raw(limit: float | None, parameter: Parameter) -> int | None:
    """A limit of an integer as it is on the wire."""
    if limit is None or parameter.data_type in REALS or parameter.data_type == "bool":
        return None
    return round(limit / parameter.factor)


def _further(family: Family) -> Iterator[tuple[At, IntegerType, int]]:
    """Objects that the bridge reads or writes beside parameters."""
    for poll in family.poll:
        yield (poll.object.index, poll.object.sub), _POLLED[poll.data_type], 0
    for own in family.own_supervision:
        for one in (own, own.reaction):
            if one is not None and one.object is not None:
                ref = family.place(one.object)
                at = (ref.index, ref.sub)
                yield at, NUMBER_TYPES.get(one.data_type, IntegerType.UNSIGNED32), one.factory or 0
    for slot in family.slot:
        for write in slot.start:
            yield (
                (write.object.index, write.object.sub),
                NUMBER_TYPES.get(write.type, IntegerType.UNSIGNED32),
                0,
            )


def _parts(pdo: Pdo) -> Iterator[tuple[At, int, bool]]:
    """The objects of a PDO as the factory has them, with their bits and whether they are signed."""
    signed = set(pdo.signed)
    before: MappedObject | None = None
    found: list[tuple[ObjectRef, int]] = []
    for layouts in pdo.objects:
        mapped = layouts[0]
        if before is not None and before == mapped and not mapped.is_composite:
            found[-1] = (found[-1][0], found[-1][1] + WORD_BITS)
        else:
            found += zip(mapped.parts, mapped.lengths, strict=True)
        before = mapped
    for ref, bits in found:
        whole = next((size for size in _UNSIGNED if size >= bits), max(_UNSIGNED))
        yield (ref.index, ref.sub), whole, ref in signed


def _pdo(pdo: Pdo, node_id: int) -> GenericPdo:
    words = tuple(index << 16 | sub << 8 | bits for (index, sub), bits, _ in _parts(pdo))
    kind = 255 if pdo.transmission_type is None else pdo.transmission_type
    inhibit, event_ms = round((pdo.inhibit_ms or 0) * 10), pdo.event_ms or 0
    return GenericPdo(pdo.number, CobId(pdo.cob_id + node_id), words, kind, inhibit, event_ms)


def _device_pdos(family: Family, node_id: int) -> tuple[list[GenericPdo], list[GenericPdo]]:
    """TPDOs with the inputs of a device and RPDOs with its outputs, in their order, as many to each as it
    holds. Beyond the fourth they have identifiers that the other direction does not need."""
    inputs, outputs = _runs(family.input), _runs(family.output)
    of_bases = (*TPDO_BASES, *RPDO_BASES[len(outputs) :])
    to_bases = (*RPDO_BASES, *TPDO_BASES[len(inputs) :])
    return (
        [
            GenericPdo(number, CobId(base + node_id), run, event_timer_ms=_EVENT_MS)
            for number, (base, run) in enumerate(zip(of_bases, inputs, strict=False), 1)
        ],
        [
            GenericPdo(number, CobId(base + node_id), run)
            for number, (base, run) in enumerate(zip(to_bases, outputs, strict=False), 1)
        ],
    )


def _runs(signals: Sequence[Signal]) -> list[tuple[int, ...]]:
    """The mapping words of the signals, for one PDO after the other."""
    runs: list[list[int]] = []
    for signal in signals:
        bits = 8 * NUMBER_TYPES[signal.data_type].size
        words = runs[-1] if runs else list[int]()
        is_full = len(words) == _PDO_ENTRIES or sum(word & 0xFF for word in words) + bits > _PDO_BITS
        if is_full or not runs:
            words = list[int]()
            runs.append(words)
        words.append(signal.object.index << 16 | signal.object.sub << 8 | bits)
    return [tuple(run) for run in runs]


def _output_objects(output: Output) -> Iterator[NumberPlan]:
    """An output, and what it becomes when the node leaves Operational: 0, as CiA 401 has it at factory."""
    kind = NUMBER_TYPES[output.data_type]
    at = (output.object.index, output.object.sub)
    yield NumberPlan(at, kind, in_rpdo=True)
    is_digital = output.object.index in _DIGITAL_OUTPUTS
    if output.error_mode:
        mode_at = (output.error_mode.index, output.error_mode.sub)
        if is_digital:
            yield NumberPlan(mode_at, kind, (1 << 8 * kind.size) - 1)
        else:
            yield NumberPlan(mode_at, IntegerType.UNSIGNED8, 1)
    if output.error_value:
        value_at = (output.error_value.index, output.error_value.sub)
        yield NumberPlan(value_at, kind if is_digital else IntegerType.INTEGER32)


def _axis(family: Family, slot: Slot) -> AxisPlan:
    commanded, told = _places(family, slot, slot.rpdo), _places(family, slot, slot.tpdo)
    actual = {value.name: value for value in family.values_of(slot) if value.group == "actual"}
    copies: list[Copy] = []
    for value in family.values_of(slot):
        twin = actual.get(value.name)
        if value.group == "actual" or twin is None or twin.width != value.width:
            continue
        source = commanded.get(_first_word(family, slot, value))
        target = told.get(_first_word(family, slot, twin))
        if source and target and len(source) == len(target) == 1:
            copies.append(Copy(source[0], target[0], stays=value.name == _STAYS))
    control, status = commanded[family.process.rpdo[0]], told[family.process.tpdo[0]]
    current = family.faults.current
    error = family.of_slot(slot).object_of(family.parameter_named(current.parameter)) if current else None
    told_by = (error.index, error.sub) if error else None
    return AxisPlan(control, status, family.control_word, family.status_word, tuple(copies), told_by)


def _first_word(family: Family, slot: Slot, value: ProcessValue) -> str:
    """Name of the first word of a value whose place a code tells, by the defaults of the mapping file; empty
    where none has it."""
    if value.word_names:
        return value.word_names[0]
    runs = family.meanings_of(slot, value.group)
    return next((one.word for run in runs for one in run if one.default == value.code[0]), "")


def _places(family: Family, slot: Slot, pdos: Sequence[Pdo]) -> dict[str, tuple[At, ...]]:
    """The objects in each word: the one that begins there, or its bytes."""
    places: dict[str, tuple[At, ...]] = {}
    for pdo in pdos:
        words = family.rpdo_words(pdo) if pdos is slot.rpdo else family.tpdo_words(pdo)
        for name, layouts in zip(words, pdo.objects, strict=True):
            places[name] = tuple((part.index, part.sub) for part in layouts[0].parts)
    return places
