"""The PDOs of a drive: written where the site file or the mapping asks for it, then read back.

What the node says of itself wins over the mapping file. A node without an object is taken by the mapping
file's word, and that is noted.
"""

from __future__ import annotations

from collections.abc import Generator
from typing import Final

from bridge.command import Drive
from bridge.command.plant import Node
from bridge.config import PdoTable
from bridge.image import DataType
from bridge.mapping.model import ObjectRef, Pdo
from bridge.southbound.boot.actions import (
    Action,
    BootResult,
    DrivePlan,
    NodePdoPlan,
    PdoPlan,
    Read,
    Step,
    number,
    optional,
)
from bridge.southbound.boot.pdo_settings import MOST_ENTRIES, PdoObjects, set_pdo
from bridge.southbound.canopen import cobid
from bridge.southbound.canopen.pdo import Entry, MappingError, PdoCodec
from bridge.southbound.canopen.sdo import SdoError

_RPDO: Final = (0x1400, 0x1600)
_TPDO: Final = (0x1800, 0x1A00)


def plan_drive(node: Node, drive: Drive, result: BootResult) -> Generator[Action, bytes | None, DrivePlan]:
    """Both PDOs of one drive; what does not fit is the drive's problem, not the node's."""
    plan = DrivePlan()
    yield Step(f"setting and reading the process data mapping of {drive.slot.name}", "J")
    try:
        yield from _plan(node, drive, plan, result)
    except MappingError as error:
        plan.problem = str(error)
        result.notes.append(f"{drive.slot.name}: {error}")
    return plan


def _plan(
    node: Node, drive: Drive, plan: DrivePlan, result: BootResult
) -> Generator[Action, bytes | None, None]:
    slot, table = drive.slot, drive.table
    plan.rpdo = yield from _pdo(node, slot.rpdo, table.rpdo, _RPDO, result)
    plan.tpdo = yield from _pdo(node, slot.tpdo, table.tpdo, _TPDO, result)
    if 0 not in plan.rpdo.words:
        raise MappingError(f"RPDO{slot.rpdo.number} does not carry the control word")
    if 0 not in plan.tpdo.words:
        raise MappingError(f"TPDO{slot.tpdo.number} does not carry the status word")
    words = len(node.family.process.rpdo)
    if node.family.process.exact_length and plan.rpdo.codec.length != 2 * words:
        raise MappingError(
            f"RPDO{slot.rpdo.number} maps {plan.rpdo.codec.length} bytes; the interface "
            f"evaluates only {words} words"
        )


def _pdo(
    node: Node, pdo: Pdo, wanted: PdoTable | None, bases: tuple[int, int], result: BootResult
) -> Generator[Action, bytes | None, PdoPlan]:
    """One PDO as the node has it. Raises MappingError where it is off or cannot be used."""
    parameter, mapping = (base + pdo.number - 1 for base in bases)
    default_id = pdo.cob_id + node.table.id
    if wanted is not None:
        yield from set_pdo(PdoObjects(parameter, mapping, default_id), wanted, result)
    cob_id = number((yield from optional(parameter, 1)), default_id)
    if cob_id & cobid.PDO_DISABLED:
        raise MappingError(f"{parameter:04X}h:01: the PDO is switched off in the node")
    if cob_id & cobid.PDO_EXTENDED or not cobid.is_for_pdos(cob_id & cobid.COB_ID_MASK):
        raise MappingError(f"{parameter:04X}h:01 is {cob_id:08X}h: no identifier for a PDO")
    kind = number((yield from optional(parameter, 2)), 255)
    event_ms = 0
    if bases is _TPDO and kind >= 254:
        event_ms = number((yield from optional(parameter, 5)))
    count = yield from optional(mapping, 0)
    if count is None:
        result.notes.append(f"the node has no {mapping:04X}h: taken as the mapping file has it")
        entries = factory_entries(pdo)
    else:
        entries = yield from _entries(mapping, number(count))
    words = match_words(entries, pdo.objects)
    codec = PdoCodec(entries, {(ref.index, ref.sub) for ref in pdo.signed})
    remote_allowed = not cob_id & cobid.NO_REMOTE
    return PdoPlan(cob_id & cobid.COB_ID_MASK, kind, event_ms, codec, words, remote_allowed)


def refuse_doubles(result: BootResult) -> None:
    """Two drives behind one identifier would get each other's words: neither is served."""
    users: dict[int, list[DrivePlan]] = {}
    for plan in result.drives.values():
        for pdo in (plan.rpdo, plan.tpdo):
            if pdo is not None:
                users.setdefault(pdo.cob_id, []).append(plan)
    for cob_id, plans in users.items():
        for plan in plans if len(plans) > 1 else ():
            plan.problem = plan.problem or f"{cob_id:03X}h is the identifier of more than one PDO"
            if plan.problem not in result.notes:
                result.notes.append(plan.problem)


def factory_entries(pdo: Pdo) -> tuple[Entry, ...]:
    """The mapping as the mapping file has it. An object that is named for several words in a row fills
    them all."""
    entries: list[Entry] = []
    for refs in pdo.objects:
        first = refs[0]
        last = entries[-1] if entries else None
        if last and (last.index, last.sub) == (first.index, first.sub):
            entries[-1] = Entry(first.index, first.sub, last.bits + 16)
        else:
            entries.append(Entry(first.index, first.sub, 16))
    return tuple(entries)


def plan_node_tpdos(node: Node, result: BootResult) -> Generator[Action, bytes | None, None]:
    """TPDOs that carry what is polled otherwise, where the node has them switched on."""
    polls = {(poll.object.index, poll.object.sub): poll for poll in node.family.poll}
    signed = {at for at, poll in polls.items() if poll.data_type in (DataType.INT16, DataType.INT32)}
    for tpdo in node.family.node_tpdo:
        parameter, mapping = (base + tpdo.number - 1 for base in _TPDO)
        cob_id = number((yield from optional(parameter, 1)), cobid.PDO_DISABLED)
        count = number((yield from optional(mapping, 0)))
        if cob_id & cobid.PDO_DISABLED or not count:
            continue
        try:
            entries = yield from _entries(mapping, count)
            codec = PdoCodec(entries, signed)
        except MappingError as error:
            result.notes.append(f"TPDO{tpdo.number} is not used: {error}")
            continue
        found = [polls.get((entry.index, entry.sub)) for entry in entries]
        if any(found):
            kind = number((yield from optional(parameter, 2)), 255)
            event_ms = number((yield from optional(parameter, 5)))
            plan = PdoPlan(cob_id & cobid.COB_ID_MASK, kind, event_ms, codec, (None,) * len(entries))
            names = tuple(poll.name if poll else "" for poll in found)
            result.node_tpdos.append(NodePdoPlan(plan, names))


def _entries(mapping: int, count: int) -> Generator[Action, bytes | None, tuple[Entry, ...]]:
    if count > MOST_ENTRIES:
        raise MappingError(f"{mapping:04X}h:00 is {count}, at most {MOST_ENTRIES} objects can be mapped")
    entries: tuple[Entry, ...] = ()
    for sub in range(1, count + 1):
        try:
            value = number((yield Read(mapping, sub)))
        except SdoError as error:
            if not error.by_server:
                raise
            raise MappingError(str(error)) from None
        entries = (*entries, Entry.from_object(value))
    return entries


def match_words(entries: tuple[Entry, ...], objects: list[list[ObjectRef]]) -> tuple[int | None, ...]:
    """For each entry the word it is, by the layout of the mapping file that explains the most of them."""
    best: tuple[int | None, ...] = (None,) * len(entries)
    for layout in range(max(len(refs) for refs in objects)):
        places: dict[tuple[int, int], int] = {}
        for word, refs in enumerate(objects):
            ref = refs[min(layout, len(refs) - 1)]
            # An object that fills several words begins with the first.
            places.setdefault((ref.index, ref.sub), word)
        found = tuple(places.get((entry.index, entry.sub)) for entry in entries)
        if best.count(None) > found.count(None):
            best = found
    return best
