"""Writing PDO communication and mapping in the order CiA 301 asks for, only where it differs.

The node is Pre-Operational. A PDO that is to change is switched off first (bit 31 of its COB-ID), its
mapping is written with sub-index 0 at 0, and it is switched on last (CiA 301 §7.5.2.35, §7.5.2.36).
"""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass
from typing import Final

from bridge.base.sdo_texts import text_of
from bridge.canopen import cobid
from bridge.canopen.dialogue import optional
from bridge.canopen.pdo import PdoEntry
from bridge.canopen.sdo import SdoError
from bridge.config import PdoTable
from bridge.mapping.model import Pdo
from bridge.node.boot.actions import U8, Action, BootResult, Do, number, told_as, write_number
from bridge.node.boot.memory import BootMemory
from bridge.node.boot.unusable import Unusable
from bridge.text import Text

FIXED_BITS: Final = 0x6000_0000
"""Bits 30 and 29 of a COB-ID, which stay as the node has them."""
MOST_ENTRIES: Final = 64
"""Largest number of objects in one PDO (CiA 301 §7.5.2.36)."""
MPDO_KINDS: Final = {0xFE: Text.of("boot.mpdo_sources"), 0xFF: Text.of("boot.mpdo_destinations")}
"""Kinds of MPDO, by sub-index 0 of the mapping (CiA 301 §7.5.2.36, §7.5.2.38)."""


class NotTaken(Unusable):
    """A value that the node refuses, or does not keep: ``what`` says which."""

    def __init__(self, what: Text) -> None:
        super().__init__(Text.of("boot.failed", letter="J", what=what))
        self.what = what


@dataclass(frozen=True, slots=True)
class Change:
    """One object and the ``value`` that it is to hold, in ``size`` bytes."""

    index: int
    sub: int
    size: int
    value: int

    @property
    def data(self) -> bytes:
        return self.value.to_bytes(self.size, "little")


@dataclass(frozen=True, slots=True)
class PdoObjects:
    """Communication and mapping object of one PDO, and its COB-ID by the predefined connection set."""

    parameter: int
    mapping: int
    default_cob_id: int


def table_for(pdo: Pdo, factory: Sequence[PdoEntry], asked: PdoTable | None) -> PdoTable | None:
    """Settings that this PDO is to get: the site file's and, beside those, the mapping file's where it says
    ``write``. None where nothing is to be written."""
    if not pdo.write:
        return asked
    own: dict[str, object] = {
        "transmission_type": pdo.transmission_type,
        "inhibit_ms": pdo.inhibit_ms,
        "event_ms": pdo.event_ms,
        "mapping": list(factory),
    }
    given = {name: getattr(asked, name) for name in asked.model_fields_set} if asked else {}
    return PdoTable.model_validate({**own, **given})


def set_pdo(objects: PdoObjects, wanted: PdoTable, result: BootResult) -> Do:
    """Bring one PDO to ``wanted``; what that leaves out stays. Raises NotTaken where the node refuses a value
    or does not keep it."""
    have_id = number((yield from optional(objects.parameter, 1)), objects.default_cob_id)
    want_id = _cob_id(objects, wanted, have_id)
    changes: list[Change] = []
    for sub, size, value in (
        (2, 1, wanted.transmission_type),
        (3, 2, None if wanted.inhibit_ms is None else round(wanted.inhibit_ms * 10)),
        (5, 2, wanted.event_ms),
    ):
        if (
            value is not None
            and number((yield from optional(objects.parameter, sub)), -1, size=size) != value
        ):
            changes.append(Change(objects.parameter, sub, size, value))
    entries = wanted.mapping
    maps = False
    if entries:
        have = yield from _mapping(objects.mapping)
        maps = have != [entry.to_object() for entry in entries]
    if not changes and not maps and have_id == want_id:
        return
    mapped = [
        Change(objects.mapping, sub, 4, entry.to_object()) for sub, entry in enumerate(entries, 1) if maps
    ]
    yield from write_pdo(objects, have_id, want_id, mapped, len(mapped), changes, result.memory)
    done = [Text.of("boot.pdo_sub", sub=change.sub, value=change.value) for change in changes]
    if maps:
        mapped_to = " ".join(str(entry) for entry in entries)
        done.append(Text.of("boot.pdo_mapping", object=f"{objects.mapping:04X}h", entries=mapped_to))
    if have_id != want_id:
        cob_id = f"{want_id & cobid.COB_ID_MASK:03X}h"
        done.append(Text.of("boot.cob_id_off" if want_id >> 31 else "boot.cob_id_on", id=cob_id))
    result.notes.append(Text.of("boot.pdo_set", object=f"{objects.parameter:04X}h", done=tuple(done)))


def _cob_id(objects: PdoObjects, wanted: PdoTable, have: int) -> int:
    """Value for 14xxh:1 or 18xxh:1."""
    identifier = have & cobid.COB_ID_MASK
    if wanted.cob_id is not None:
        identifier = wanted.cob_id
    elif not identifier:
        identifier = objects.default_cob_id
    off = 0 if wanted.enable else cobid.PDO_DISABLED
    return have & FIXED_BITS | identifier | off


def _mapping(index: int) -> Generator[Action, bytes | None, list[int]]:
    """Mapping as the node has it, without unused places; empty where it has none."""
    count = number((yield from optional(index)), size=U8)
    words = [0] * min(count, MOST_ENTRIES)
    for place in range(len(words)):
        words[place] = number((yield from optional(index, place + 1)))
    return [word for word in words if word]


def write_pdo(
    objects: PdoObjects,
    have_id: int,
    want_id: int,
    mapped: Sequence[Change],
    count: int,
    changes: Sequence[Change],
    memory: BootMemory,
) -> Do:
    """Write one PDO: off, mapping (where ``mapped`` has entries), communication, on; then read all of it
    back.

    Raises NotTaken where the node refuses a value or does not keep it. Where one of the values was not kept
    before, nothing is written.
    """
    parameter, mapping = objects.parameter, objects.mapping
    off = Change(parameter, 1, 4, have_id | cobid.PDO_DISABLED)
    writes: list[Change] = [] if have_id & cobid.PDO_DISABLED else [off]
    if mapped:
        writes += [Change(mapping, 0, 1, 0), *mapped, Change(mapping, 0, 1, count)]
    writes += changes
    if want_id != have_id | cobid.PDO_DISABLED:
        writes.append(Change(parameter, 1, 4, want_id))
    # Of an object that is written more than once the last value counts.
    final = {(change.index, change.sub): change for change in writes}
    for change in final.values():
        if memory.was_not_kept(change.index, change.sub, change.data):
            yield from _verify(change, memory)
    for change in writes:
        yield from _write_one(change)
    for change in final.values():
        yield from _verify(change, memory)


def _write_one(change: Change) -> Do:
    def refused(error: SdoError) -> NotTaken:
        return NotTaken(Text.of("boot.not_taken", why=text_of(error), wanted=f"{change.value:X}h"))

    with told_as(refused):
        yield from write_number(change.index, change.sub, change.data, None)


def _verify(change: Change, memory: BootMemory) -> Do:
    """Read a value back. Raises NotTaken where the node holds something else, and remembers that."""
    read = number((yield from optional(change.index, change.sub)), -1, size=change.size)
    # Some nodes fix bits 30 and 29 of a COB-ID.
    ignored = FIXED_BITS if change.index & 0x0200 == 0 and change.sub == 1 else 0
    if (read ^ change.value) & ~ignored:
        memory.note_not_kept(change.index, change.sub, change.data)
        name = f"{change.index:04X}h:{change.sub:02X}"
        found, written = f"{read:X}h", f"{change.value:X}h"
        raise NotTaken(Text.of("boot.not_kept", object=name, read=found, written=written))
