"""RPDOs in which a node that may be running listens, read before anything that may fail."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from contextlib import suppress
from typing import Final

from bridge.canopen import cobid
from bridge.canopen.pdo import MappingError, PdoCodec, PdoEntry
from bridge.command import Drive
from bridge.command.node import Node
from bridge.mapping.model import Family, Pdo, Slot
from bridge.node.boot.actions import U8, Action, BootResult, BootStep, Do, PdoPlan, number, wish
from bridge.node.boot.drive_pdos import RPDO, read_entries
from bridge.node.boot.word_layout import factory_entries, layouts, match_words
from bridge.text import Text

_FACTORY_TYPE: Final = 255


def find_rpdos(node: Node, result: BootResult) -> Do:
    """Note the RPDOs in which the node listens for each drive's words, so that a stop reaches it there. While
    a drive may be running nothing waits for a silent node: SdoError at once."""
    yield BootStep(Text.of("boot_step.listen"), "J", needed_by="drive")
    for drive in node.drives:
        for pdo in drive.slot.rpdo:
            plan = yield from _rpdo(drive, pdo, result)
            if plan is not None:
                result.memory.note_rpdo(drive.name, pdo.number, plan)


def _rpdo(drive: Drive, pdo: Pdo, result: BootResult) -> Generator[Action, bytes | None, PdoPlan | None]:
    """One RPDO as the node has it; None where it is off, or unknown to the node."""
    parameter, mapping = (base + pdo.number - 1 for base in RPDO)
    cob_id = number((yield from wish(result, parameter, 1, may_be_silent=False)), cobid.PDO_DISABLED)
    identifier = cob_id & cobid.COB_ID_MASK
    if cob_id & (cobid.PDO_DISABLED | cobid.PDO_EXTENDED) or not cobid.is_for_pdos(identifier):
        return None
    kind = number((yield from wish(result, parameter, 2, may_be_silent=False)), _FACTORY_TYPE, size=U8)
    entries: tuple[PdoEntry, ...] = ()
    if not pdo.static:
        with suppress(MappingError):
            count = number((yield from wish(result, mapping, may_be_silent=False)), size=U8)
            entries = yield from read_entries(mapping, count)
    return rpdo_plan(drive.family, drive.slot, pdo, identifier, entries, kind)


def rpdo_plan(
    family: Family,
    slot: Slot,
    pdo: Pdo,
    cob_id: int,
    entries: Sequence[PdoEntry] = (),
    kind: int = _FACTORY_TYPE,
) -> PdoPlan:
    """Plan of a drive's RPDO with this mapping; with the mapping file's where there is none, or none that can
    be packed."""
    known = layouts(slot.rpdo, [family.rpdo_words(one) for one in slot.rpdo], family.process.rpdo)
    have = tuple(entries) or factory_entries(pdo)
    try:
        codec = PdoCodec(have)
    except MappingError:
        have = factory_entries(pdo)
        codec = PdoCodec(have)
    return PdoPlan(cob_id, kind, 0, codec, match_words(have, known))
