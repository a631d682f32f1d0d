"""PDOs of a drive: written where the site file or the mapping asks for it, then read back.

The node's own word wins over the mapping file. For an object that the node lacks the mapping file's word is
taken, and that is noted. A drive works as long as control and status word are there; whatever else the node
does not carry is noted and not served.
"""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass
from typing import Final

from bridge.base.sdo_texts import text_of
from bridge.canopen import cobid
from bridge.canopen.dialogue import SdoRead, optional
from bridge.canopen.pdo import MappingError, PdoCodec, PdoEntry
from bridge.canopen.sdo import SdoError
from bridge.command import Drive
from bridge.command.node import Node
from bridge.config import PdoTable
from bridge.config.model import pdo_table
from bridge.image import DataType
from bridge.mapping.model import Pdo
from bridge.node.boot.actions import (
    U8,
    U16,
    Action,
    BootResult,
    BootStep,
    Do,
    DrivePlan,
    NodePdoPlan,
    PdoPlan,
    number,
    told_as,
    wish,
)
from bridge.node.boot.pdo_settings import MOST_ENTRIES, MPDO_KINDS, PdoObjects, set_pdo, table_for
from bridge.node.boot.start_writes import write_start
from bridge.node.boot.unusable import Unusable, why_unusable
from bridge.node.boot.word_layout import (
    Layouts,
    differences,
    factory_entries,
    layouts,
    match_words,
    missing_parts,
)
from bridge.text import Text

RPDO: Final = (0x1400, 0x1600)
"""Indices of the first communication and the first mapping object."""
_TPDO: Final = (0x1800, 0x1A00)
_BYTES: Final = 2
_ALL_BITS: Final = 0xFFFF


class _Off(Unusable):
    """The PDO is switched off in the node."""


@dataclass(frozen=True, slots=True)
class _Direction:
    """RPDOs or TPDOs of one drive. ``words`` has the names of each PDO's words, ``process`` all names."""

    name: str
    group: str
    bases: tuple[int, int]
    process: Sequence[str]
    pdos: Sequence[Pdo]
    words: Sequence[Sequence[str]]
    tables: Sequence[PdoTable]
    known: Layouts

    def asked(self, pdo: Pdo) -> PdoTable | None:
        """The site file's table for this PDO, if any."""
        return pdo_table(self.tables, pdo.number, self.pdos[0].number)


def plan_drive(node: Node, drive: Drive, result: BootResult) -> Generator[Action, bytes | None, DrivePlan]:
    """Plan the PDOs of one drive; what does not fit is the drive's problem, not the node's."""
    plan = DrivePlan()
    slot, family, table = drive.slot, drive.family, drive.table
    process = family.process
    receives = [family.rpdo_words(pdo) for pdo in slot.rpdo]
    sends = [family.tpdo_words(pdo) for pdo in slot.tpdo]
    yield BootStep(Text.of("boot_step.pdos_of", slot=slot.name), "J", needed_by=f"drive.{slot.name}")
    try:
        yield from write_start(drive, result)
        for direction, found in (
            (
                _Direction(
                    "RPDO", "command", RPDO, process.rpdo, slot.rpdo, receives, table.rpdo,
                    layouts(slot.rpdo, receives, process.rpdo),
                ),
                plan.rpdos,
            ),
            (
                _Direction(
                    "TPDO", "actual", _TPDO, process.tpdo, slot.tpdo, sends, table.tpdo,
                    layouts(slot.tpdo, sends, process.tpdo),
                ),
                plan.tpdos,
            ),
        ):  # fmt: skip
            yield from _plan(node, drive, direction, found, plan, result)
        _require_followed(drive, plan)
    except (MappingError, SdoError) as error:
        if isinstance(error, SdoError) and not error.was_answered:
            raise
        plan.leave_out(why_unusable(error))
        result.notes.append(_of(slot.name, why_unusable(error)))
    return plan


def _of(slot: str, what: Text) -> Text:
    return Text.of("boot.of_slot", slot=slot, what=what)


def _require_followed(drive: Drive, plan: DrivePlan) -> None:
    """Refuse a drive without the actual value that one of its commands follows: enabling might make it
    jump."""
    for value in drive.family.values_of(drive.slot):
        if value.follows is None:
            continue
        followed = next(
            one for one in drive.family.value if (one.group, one.name) == ("actual", value.follows)
        )
        for word in followed.word_names:
            why = plan.unserved.get(f"actual/{word}")
            if why:
                said = Text.of("boot.has_to_follow", value=value.leaf, followed=followed.leaf, why=why)
                raise Unusable(said)


def _plan(
    node: Node, drive: Drive, direction: _Direction, found: list[PdoPlan], plan: DrivePlan, result: BootResult
) -> Do:
    """Plan all PDOs of one direction, into ``found``. Raises MappingError where none carries the first
    word."""
    first = direction.process[0]
    reasons: dict[str, Text] = {}
    for pdo, words in zip(direction.pdos, direction.words, strict=True):
        try:
            one = yield from _pdo(node, drive, pdo, direction, result)
            if direction.name == "RPDO" and node.family.process.exact_length:
                _check_length(one, len(words))
            found.append(one)
        except MappingError as error:
            if first in words:
                raise
            reasons |= dict.fromkeys(words, why_unusable(error))
            expected = pdo.optional and isinstance(error, _Off) and direction.asked(pdo) is None
            if not expected:
                result.notes.append(_of(drive.slot.name, why_unusable(error)))
    carried = {place for one in found for place in one.words}
    if 0 not in carried:
        word, names = Text.word("word", first), tuple(one.name for one in found)
        if len(names) == 1:
            raise Unusable(Text.of("boot.pdo_without_word", pdo=names[0], word=word))
        raise Unusable(Text.of("boot.pdos_without_word", pdos=names, word=word))
    found.sort(key=lambda one: 0 not in one.words)
    for pdo, words in zip(direction.pdos, direction.words, strict=True):
        for word in words:
            if direction.process.index(word) in carried:
                continue
            name = f"{direction.name}{pdo.number}"
            why = reasons.get(word) or Text.of("boot.pdo_without_it", pdo=name)
            plan.unserved[f"{direction.group}/{word}"] = why
            if word not in reasons:
                missing = Text.of("boot.word_not_in_pdo", word=word, pdo=name)
                result.notes.append(_of(drive.slot.name, missing))
    _leave_out_parts(drive, direction, found, plan, result)


def _leave_out_parts(
    drive: Drive, direction: _Direction, found: Sequence[PdoPlan], plan: DrivePlan, result: BootResult
) -> None:
    """Leave out values of words that are mapped in part, whose other bits would read as 0. Raises
    MappingError where the control or status word cannot do without them."""
    family, group = drive.family, direction.group
    needed = family.needed_bits(group)
    mapped = {(entry.index, entry.sub) for one in found for entry in one.codec.entries}
    for place, refs in direction.known.items():
        for part, mask in missing_parts(refs, mapped):
            word = direction.process[place]
            kind, ref = direction.name, str(part)
            why = Text.of("boot.not_carried", kind=kind, object=ref)
            if place == 0 and needed & mask:
                name = Text.word("word", word)
                raise Unusable(Text.of("boot.needed_part", kind=kind, object=ref, word=name))
            note = Text.of("boot.part_not_carried", kind=kind, object=ref, word=word)
            result.notes.append(_of(drive.slot.name, note))
            for value in family.values_of(drive.slot):
                bits = _ALL_BITS if value.bit is None else 1 << value.bit
                if value.group == group and word in value.word_names and bits & mask:
                    plan.unserved[value.leaf] = why


def _check_length(pdo: PdoPlan, words: int) -> None:
    if pdo.codec.length != _BYTES * words:
        length = pdo.codec.length
        if words == 1:
            raise Unusable(Text.of("boot.maps_more_than_word", pdo=pdo.name, length=length))
        raise Unusable(Text.of("boot.maps_more", pdo=pdo.name, length=length, words=words))


def _pdo(
    node: Node, drive: Drive, pdo: Pdo, direction: _Direction, result: BootResult
) -> Generator[Action, bytes | None, PdoPlan]:
    """One PDO as the node has it, after it was set. Raises MappingError where it is off or cannot be used."""
    name = f"{direction.name}{pdo.number}"
    parameter, mapping = (base + pdo.number - 1 for base in direction.bases)
    default_id = pdo.cob_id + node.table.id
    expected = factory_entries(pdo)
    wanted = table_for(pdo, expected, direction.asked(pdo))
    if wanted is not None:
        yield from set_pdo(PdoObjects(parameter, mapping, default_id), wanted, result)
    has_object = yield from optional(parameter, 1)
    if has_object is None and pdo.optional:
        raise _Off(Text.of("boot.has_no", object=name))
    cob_id = number(has_object, default_id)
    if cob_id & cobid.PDO_DISABLED:
        raise _Off(Text.of("boot.object_off", object=f"{parameter:04X}h:01"))
    if cob_id & cobid.PDO_EXTENDED or not cobid.is_for_pdos(cob_id & cobid.COB_ID_MASK):
        raise Unusable(Text.of("boot.no_pdo_id", object=f"{parameter:04X}h:01", id=cob_id))
    kind = number((yield from optional(parameter, 2)), 255, size=U8)
    event_ms = 0
    if direction.bases is _TPDO and kind >= 254:
        event_ms = number((yield from optional(parameter, 5)), size=U16)
    entries = expected
    if not pdo.static:
        count = yield from optional(mapping, 0)
        if count is None:
            result.notes.append(Text.of("boot.taken_by_file", object=f"{mapping:04X}h"))
        else:
            entries = yield from read_entries(mapping, number(count, size=U8))
    places = match_words(entries, direction.known)
    told = differences(entries, expected, places)
    result.notes += [
        Text.of("boot.of_pdo", slot=drive.slot.name, pdo=name, what=difference) for difference in told
    ]
    codec = PdoCodec(entries, {(ref.index, ref.sub) for each in direction.pdos for ref in each.signed})
    remote_allowed = not cob_id & cobid.NO_REMOTE
    return PdoPlan(cob_id & cobid.COB_ID_MASK, kind, event_ms, codec, places, remote_allowed, name)


def refuse_doubles(result: BootResult) -> None:
    """Leave out drives that share an identifier: they would get each other's words."""
    users: dict[int, list[DrivePlan]] = {}
    for plan in result.drives.values():
        for pdo in (*plan.rpdos, *plan.tpdos):
            users.setdefault(pdo.cob_id, []).append(plan)
    for cob_id, plans in users.items():
        for plan in plans if len(plans) > 1 else ():
            why = Text.of("boot.same_id", id=f"{cob_id:03X}h")
            plan.leave_out(why)
            if isinstance(plan.problem, Text) and plan.problem not in result.notes:
                result.notes.append(plan.problem)


def plan_node_tpdos(node: Node, result: BootResult) -> Generator[Action, bytes | None, None]:
    """Plan the node's TPDOs that carry polled objects, where they are switched on."""
    polls = {(poll.object.index, poll.object.sub): poll for poll in node.family.poll}
    signed = {at for at, poll in polls.items() if poll.data_type in (DataType.INT16, DataType.INT32)}
    for tpdo in node.family.node_tpdo:
        parameter, mapping = (base + tpdo.number - 1 for base in _TPDO)
        cob_id = number((yield from wish(result, parameter, 1)), cobid.PDO_DISABLED)
        count = number((yield from wish(result, mapping)), size=U8)
        if cob_id & cobid.PDO_DISABLED or not count:
            continue
        try:
            entries = yield from read_entries(mapping, count)
            codec = PdoCodec(entries, signed)
        except MappingError as error:
            result.notes.append(
                Text.of("boot.pdo_not_used", pdo=f"TPDO{tpdo.number}", why=why_unusable(error))
            )
            continue
        found = [polls.get((entry.index, entry.sub)) for entry in entries]
        if any(found):
            kind = number((yield from wish(result, parameter, 2)), 255, size=U8)
            event_ms = number((yield from wish(result, parameter, 5)), size=U16)
            plan = PdoPlan(cob_id & cobid.COB_ID_MASK, kind, event_ms, codec, (None,) * len(entries))
            names = tuple(poll.name if poll else "" for poll in found)
            result.node_tpdos.append(NodePdoPlan(plan, names))


def read_entries(mapping: int, count: int) -> Generator[Action, bytes | None, tuple[PdoEntry, ...]]:
    """Mapping as the node has it. Raises MappingError where it cannot be one, or cannot be read."""
    if count in MPDO_KINDS:
        kind = MPDO_KINDS[count]
        raise Unusable(Text.of("boot.mpdo", object=f"{mapping:04X}h:00", count=count, kind=kind))
    if count > MOST_ENTRIES:
        name = f"{mapping:04X}h:00"
        raise Unusable(Text.of("boot.too_many_entries", object=name, count=count, most=MOST_ENTRIES))
    entries: tuple[PdoEntry, ...] = ()
    for sub in range(1, count + 1):
        with told_as(lambda error: Unusable(text_of(error))):
            value = number((yield SdoRead(mapping, sub)))
        if value:  # some nodes have a fixed count, and 0 in the places that they do not use
            entries = (*entries, PdoEntry.from_object(value))
    return entries
