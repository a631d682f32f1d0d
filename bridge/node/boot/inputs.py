"""The TPDOs of a device that is no drive, as the node has them."""

from __future__ import annotations

from collections.abc import Generator
from typing import Final

from bridge.canopen import cobid
from bridge.canopen.dialogue import optional
from bridge.canopen.pdo import MappingError, PdoCodec
from bridge.command.plant import Node
from bridge.mapping.fields import ObjectRef
from bridge.node.boot.actions import Action, BootResult, InputPlan, PdoPlan, Step, number
from bridge.node.boot.pdos import read_entries

_TPDO: Final = (0x1800, 0x1A00)
_MOST: Final = 512
_ABSENT_IN_A_ROW: Final = 4
"""TPDOs are numbered from 1; the four of the predefined connection set may be there in part."""


def plan_inputs(node: Node, result: BootResult) -> Generator[Action, bytes | None]:
    """Every TPDO that is switched on and carries one of the family's inputs."""
    wanted = {signal.object: signal for signal in node.family.input}
    signed = {(ref.index, ref.sub) for ref, signal in wanted.items() if signal.is_signed}
    plan = result.inputs = InputPlan()
    yield Step("reading the process data mapping", "J")
    absent = 0
    for place in range(_MOST):
        if absent >= _ABSENT_IN_A_ROW:
            break
        parameter, mapping = (base + place for base in _TPDO)
        has_object = yield from optional(parameter, 1)
        if has_object is None:
            absent += 1
            continue
        absent = 0
        cob_id = number(has_object, cobid.PDO_DISABLED)
        name = f"TPDO{place + 1}"
        try:
            entries = yield from read_entries(mapping, number((yield from optional(mapping, 0))))
            codec = PdoCodec(entries, signed)
        except MappingError as error:
            result.notes.append(f"{name} is not used: {error}")
            continue
        objects = [ref for ref in (ObjectRef(entry.index, entry.sub) for entry in entries) if ref in wanted]
        if not objects:
            continue
        if cob_id & cobid.PDO_DISABLED:
            plan.unserved |= dict.fromkeys(objects, f"{name} is switched off in the node")
            continue
        if cob_id & cobid.PDO_EXTENDED or not cobid.is_for_pdos(cob_id & cobid.COB_ID_MASK):
            result.notes.append(f"{parameter:04X}h:01 is {cob_id:08X}h: no identifier for a PDO")
            continue
        kind = number((yield from optional(parameter, 2)), 255)
        event_ms = number((yield from optional(parameter, 5))) if kind >= 254 else 0
        places = (None,) * len(entries)
        plan.tpdos.append(PdoPlan(cob_id & cobid.COB_ID_MASK, kind, event_ms, codec, places, name=name))
    carried = {ObjectRef(entry.index, entry.sub) for one in plan.tpdos for entry in one.codec.entries}
    for ref in wanted:
        if ref in carried:
            plan.unserved.pop(ref, None)
        else:
            why = plan.unserved.setdefault(ref, f"no TPDO of the node carries {ref}")
            result.notes.append(why)
