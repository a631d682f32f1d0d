"""PDOs of a device that is no drive, as the node has them."""

from __future__ import annotations

from collections.abc import Collection, Generator, Mapping
from types import MappingProxyType
from typing import Final

from bridge.canopen import cobid
from bridge.canopen.pdo import MappingError, PdoCodec
from bridge.command.node import Node
from bridge.mapping.device_signals import Signal
from bridge.mapping.entry_types import ObjectRef
from bridge.node.boot.actions import (
    U8,
    U16,
    Action,
    BootResult,
    BootStep,
    DevicePlan,
    PdoPlan,
    SignalPlan,
    number,
    wish,
)
from bridge.node.boot.drive_pdos import read_entries
from bridge.node.boot.unusable import why_unusable
from bridge.text import Text

_BASES: Final = {"TPDO": (0x1800, 0x1A00), "RPDO": (0x1400, 0x1600)}
_MOST: Final = 512
_ABSENT_IN_A_ROW: Final = 4
"""Missing PDOs in a row that end the search: they are numbered from 1, and the four of the predefined
connection set may be there in part."""

NONE: Final[Mapping[ObjectRef, Signal]] = MappingProxyType({})

Plan = Generator[Action, bytes | None, SignalPlan]


def plan_device(node: Node, result: BootResult) -> Generator[Action, bytes | None, DevicePlan]:
    """Plan every PDO that is switched on and carries one of the family's inputs or outputs."""
    family = node.family
    yield BootStep(Text.of("boot_step.pdos"), "J")
    inputs = {one.object: one for one in family.input}
    outputs = {one.object: one for one in family.output}
    # A TPDO that carries an output tells whether a stop of it is followed.
    tpdos = yield from _plan("TPDO", inputs, result, also=outputs)
    rpdos = yield from _plan("RPDO", outputs, result)
    return DevicePlan(tpdos, rpdos)


def _plan(
    kind: str, needed: Mapping[ObjectRef, Signal], result: BootResult, also: Mapping[ObjectRef, Signal] = NONE
) -> Plan:
    """Plan the PDOs that carry ``needed`` objects, or some of ``also``; a needed object that none carries is
    noted."""
    wanted = {**also, **needed}
    signed = {(ref.index, ref.sub) for ref, signal in wanted.items() if signal.is_signed}
    plan = SignalPlan()
    absent = 0
    for place in range(_MOST if wanted else 0):
        if absent >= _ABSENT_IN_A_ROW:
            break
        parameter, mapping = (base + place for base in _BASES[kind])
        has_object = yield from wish(result, parameter, 1)
        if has_object is None:
            absent += 1
            continue
        absent = 0
        cob_id = number(has_object, cobid.PDO_DISABLED)
        name = f"{kind}{place + 1}"
        try:
            count = number((yield from wish(result, mapping)), size=U8)
            entries = yield from read_entries(mapping, count)
            codec = PdoCodec(entries, signed)
        except MappingError as error:
            result.notes.append(Text.of("boot.pdo_not_used", pdo=name, why=why_unusable(error)))
            continue
        mapped = [ObjectRef(entry.index, entry.sub) for entry in entries if not entry.is_dummy]
        objects = [ref for ref in mapped if ref in wanted]
        if kind == "TPDO" and len(objects) < len(mapped) and not cob_id & cobid.PDO_DISABLED:
            others = tuple(str(ref) for ref in mapped if ref not in wanted)
            result.notes.append(Text.of("boot.carries_more", pdo=name, objects=others))
        if not objects:
            continue
        if cob_id & cobid.PDO_DISABLED:
            missed = (ref for ref in objects if ref in needed)
            plan.unserved |= dict.fromkeys(missed, Text.of("boot.pdo_off", pdo=name))
            continue
        if cob_id & cobid.PDO_EXTENDED or not cobid.is_for_pdos(cob_id & cobid.COB_ID_MASK):
            result.notes.append(Text.of("boot.no_pdo_id", object=f"{parameter:04X}h:01", id=cob_id))
            continue
        if kind == "RPDO" and len(objects) < len(mapped):
            others = tuple(str(ref) for ref in mapped if ref not in wanted)
            result.notes.append(Text.of("boot.carries_too", pdo=name, objects=others))
        transmission = number((yield from wish(result, parameter, 2)), 255, size=U8)
        event_ms = 0
        if kind == "TPDO" and transmission >= 254:
            event_ms = number((yield from wish(result, parameter, 5)), size=U16)
        places = (None,) * len(entries)
        plan.pdos.append(
            PdoPlan(cob_id & cobid.COB_ID_MASK, transmission, event_ms, codec, places, name=name)
        )
    _note_unserved(kind, needed, plan, result)
    return plan


def _note_unserved(kind: str, wanted: Collection[ObjectRef], plan: SignalPlan, result: BootResult) -> None:
    carried = {ObjectRef(entry.index, entry.sub) for one in plan.pdos for entry in one.codec.entries}
    for ref in wanted:
        if ref in carried:
            plan.unserved.pop(ref, None)
        else:
            why = plan.unserved.setdefault(ref, Text.of("boot.not_carried", kind=kind, object=str(ref)))
            result.notes.append(why)
