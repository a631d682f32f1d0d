"""PDO objects: those that an EDS leaves out with CompactPDO (CiA 306 §4.5.2), and a summary of all."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from bridge.eds.fields import Fields
from bridge.eds.ini import Section
from bridge.eds.model import (
    Access,
    Description,
    Entry,
    Object,
    ObjectType,
    Report,
    StaticDataType,
    Value,
    count_entry,
)
from bridge.text import Text

_MOST_PDOS: Final = 512
_MOST_MAPPED: Final = 64
_OFF: Final = 0x8000_0000
_PREDEFINED: Final = {
    "rpdo": (0x200, 0x300, 0x400, 0x500),
    "tpdo": (0x180, 0x280, 0x380, 0x480),
}
_SUBS: Final = (
    ("COB-ID used by PDO", StaticDataType.UNSIGNED32),
    ("Transmission type", StaticDataType.UNSIGNED8),
    ("Inhibit time", StaticDataType.UNSIGNED16),
    ("Reserved", StaticDataType.UNSIGNED8),
    ("Event timer", StaticDataType.UNSIGNED16),
    ("SYNC start value", StaticDataType.UNSIGNED8),
)
"""Sub-indices 1…6 of a communication parameter; bit n of CompactPDO stands for sub-index n + 1."""
_BASES: Final = {"rpdo": (0x1400, 0x1600), "tpdo": (0x1800, 0x1A00)}


def add_compact_pdos(info: Section, objects: dict[int, Object], fields: Fields, report: Report) -> None:
    """Add the PDO objects that ``info`` says the device has and the file does not describe."""
    mask = fields.number(info, "CompactPDO", 0, 0xFF) or 0
    for kind, key in (("rpdo", "NrOfRXPDO"), ("tpdo", "NrOfTXPDO")):
        count = fields.number(info, key, 0, _MOST_PDOS) or 0
        communication, mapping = _BASES[kind]
        there = sum(1 for index in objects if communication <= index < communication + _MOST_PDOS)
        if not mask:
            if count != there and info.get(key):
                said = Text.of("eds.pdo_count", key=key, count=count, there=there)
                report.warning(info.keys[key.lower()].line, said)
            continue
        for number in range(_MOST_PDOS):
            if there >= count:
                break
            if communication + number not in objects:
                there += 1
                objects[communication + number] = _communication(kind, number, mask, info.line)
            if mapping + number not in objects:
                objects[mapping + number] = _mapping(kind, number, info.line)


def _communication(kind: str, number: int, mask: int, line: int) -> Object:
    bases = _PREDEFINED[kind]
    cob_id = Value(bases[number], True) if number < len(bases) else Value(_OFF)
    defaults = {1: cob_id, 2: Value(0xFF)}
    index = _BASES[kind][0] + number
    subs = [sub for sub in range(1, len(_SUBS) + 1) if mask >> (sub - 1) & 1]
    entries = [count_entry(index, max(subs, default=0), line)]
    for sub in subs:
        name, data_type = _SUBS[sub - 1]
        default = defaults.get(sub, Value(0))
        entries.append(Entry(index, sub, name, data_type, Access.RW, default=default, line=line))
    name = f"{kind.upper()} communication parameter"
    return Object(index, name, ObjectType.RECORD, tuple(entries))


def _mapping(kind: str, number: int, line: int) -> Object:
    index = _BASES[kind][1] + number
    entries = [count_entry(index, 0, line, Access.RW)]
    for sub in range(1, _MOST_MAPPED + 1):
        name = f"Mapped object {sub}"
        entries.append(
            Entry(index, sub, name, StaticDataType.UNSIGNED32, Access.RW, default=Value(0), line=line)
        )
    return Object(index, f"{kind.upper()} mapping parameter", ObjectType.RECORD, tuple(entries))


@dataclass(frozen=True, slots=True)
class MappedEntry:
    """One entry of a PDO; ``name`` is empty where the file does not describe the object."""

    index: int
    sub: int
    bits: int
    name: str


@dataclass(frozen=True, slots=True)
class PdoSummary:
    """A PDO as the file configures it. ``cob_id`` is without its flags, and None if it is missing or depends
    on an unknown node id."""

    receives: bool
    number: int
    enabled: bool
    cob_id: int | None
    cob_id_text: str
    transmission_type: int | None
    inhibit_100us: int
    event_timer_ms: int
    mapped: tuple[MappedEntry, ...]

    @property
    def name(self) -> str:
        return f"{'RPDO' if self.receives else 'TPDO'}{self.number}"

    @property
    def bits(self) -> int:
        return sum(one.bits for one in self.mapped)


def pdos(description: Description, node_id: int | None = None) -> Iterator[PdoSummary]:
    """Every PDO of the device, RPDOs first."""
    for kind, (communication, mapping) in _BASES.items():
        for number in range(_MOST_PDOS):
            if description.object(communication + number):
                yield _summary(description, kind == "rpdo", number, communication, mapping, node_id)


def _summary(
    description: Description,
    receives: bool,
    number: int,
    communication: int,
    mapping: int,
    node_id: int | None,
) -> PdoSummary:
    entry = description.entry(communication + number, 1)
    value = entry.current if entry else None
    plain = value.plain if value and isinstance(value.plain, int) else None
    whole = description.number(communication + number, 1, node_id)
    return PdoSummary(
        receives=receives,
        number=number + 1,
        enabled=plain is not None and not plain & _OFF,
        cob_id=None if whole is None else whole & 0x7FF,
        cob_id_text=_cob_id_text(value),
        transmission_type=description.number(communication + number, 2, node_id),
        inhibit_100us=description.number(communication + number, 3, node_id) or 0,
        event_timer_ms=description.number(communication + number, 5, node_id) or 0,
        mapped=tuple(_mapped(description, mapping + number, node_id)),
    )


def _cob_id_text(value: Value | None) -> str:
    if value is None or not isinstance(value.plain, int):
        return "?"
    return f"{value.plain & 0x7FF:X}h" + ("+id" if value.plus_node_id else "")


def _mapped(description: Description, index: int, node_id: int | None) -> Iterator[MappedEntry]:
    count = description.number(index, 0, node_id) or 0
    for sub in range(1, min(count, _MOST_MAPPED) + 1):
        word = description.number(index, sub, node_id)
        if word:
            target, target_sub = word >> 16 & 0xFFFF, word >> 8 & 0xFF
            entry = description.entry(target, target_sub)
            yield MappedEntry(target, target_sub, word & 0xFF, entry.name if entry else "")
