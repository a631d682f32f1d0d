"""Checks of the words, PDOs and slots of a mapping file."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from bridge.mapping.merge import MergedFile
from bridge.mapping.model import Family, ObjectRef, Pdo
from bridge.tomlfile import Key

_STANDARD_ID_MOST: Final = 0x7FF
_PDO_BITS: Final = 64


def twice(names: Iterable[tuple[str, Key]], what: str, file: MergedFile) -> None:
    seen: dict[str, Key] = {}
    for name, key in names:
        if name in seen:
            file.fault(key, f"{what} {name!r} is there twice", f"first in line {file.line(seen[name])}")
        else:
            seen[name] = key


def check_parameter(name: str, family: Family, key: Key, file: MergedFile) -> bool:
    """Check that ``name`` is a listed parameter."""
    known = sorted(parameter.name for parameter in family.parameter)
    if name not in known:
        file.fault(key, f"there is no parameter {name!r}", f"known: {', '.join(known)}")
    return name in known


def check_process(family: Family, file: MergedFile) -> None:
    for name, words, first in (
        ("rpdo", family.process.rpdo, "control_word"),
        ("tpdo", family.process.tpdo, "status_word"),
    ):
        if words[0] != first:
            file.fault(("process", name), f"must begin with {first}")
        twice(((word, ("process", name, place)) for place, word in enumerate(words)), "word", file)
    for word in family.process.rest:
        if word not in family.process.rpdo[1:]:
            hint = f"known: {', '.join(family.process.rpdo[1:])}"
            file.fault(("process", "rest", word), f"there is no setpoint word {word!r}", hint)


def check_slots(family: Family, file: MergedFile) -> None:
    twice(((slot.name, ("slot", s, "name")) for s, slot in enumerate(family.slot)), "slot", file)
    if any(slot.axis > 1 for slot in family.slot):
        axes = ((f"{slot.axis}", ("slot", s, "axis")) for s, slot in enumerate(family.slot))
        twice(axes, "axis", file)
    for s, slot in enumerate(family.slot):
        for name, pdos, words in (
            ("rpdo", slot.rpdo, family.process.rpdo),
            ("tpdo", slot.tpdo, family.process.tpdo),
        ):
            _check_direction(family, pdos, words, ("slot", s, name), file)
        if slot.emcy_drive is not None and family.emcy.drive_byte is None:
            file.fault(("slot", s, "emcy_drive"), "has no meaning without emcy.drive_byte")


def _check_direction(family: Family, pdos: list[Pdo], process: list[str], key: Key, file: MergedFile) -> None:
    """Check all PDOs of one direction of a slot."""
    keys = [file.item(key, p) for p in range(len(pdos))]
    named = list(zip(pdos, keys, strict=True))
    twice(((f"{pdo.number}", (*at, "number")) for pdo, at in named), f"{str(key[-1]).upper()} number", file)
    carried: list[tuple[str, Key]] = []
    for pdo, at in named:
        words = pdo.words or process
        carried += [(word, (*at, "words", w) if pdo.words else at) for w, word in enumerate(words)]
        _check_pdo(family, pdo, process, at, file)
    twice(carried, "word", file)
    first = process[0]
    if not any(first in (pdo.words or process) and not pdo.optional for pdo in pdos):
        file.fault(key, f"none of them carries the {first}", "one that is not optional must")


def _check_pdo(family: Family, pdo: Pdo, process: list[str], key: Key, file: MergedFile) -> None:
    for w, word in enumerate(pdo.words):
        if word not in process:
            hint = f"known: {', '.join(process)}"
            file.fault((*key, "words", w), f"process.{_direction(key)} has no word {word!r}", hint)
    words = pdo.words or process
    if len(pdo.objects) != len(words):
        named = f"words names {len(words)}" if pdo.words else f"process.{_direction(key)} names {len(words)}"
        file.fault((*key, "objects"), f"has {len(pdo.objects)} words and {named}")
    _check_neighbours(pdo, words, process, key, file)
    for w, refs in enumerate(pdo.objects):
        for r, mapped in enumerate(refs):
            if not mapped.is_composite and mapped.bits[0] > 16 * _run(pdo, w, r):
                message = f"{mapped} is longer than the words it is named for"
                file.fault((*key, "objects", w, r), message, "name it for each word that it fills")
    bits = 16 * len(pdo.objects)
    if bits > _PDO_BITS:
        file.fault((*key, "objects"), f"has {bits} bits, a PDO has {_PDO_BITS}")
    check_cob_id(pdo.cob_id, family, (*key, "cob_id"), file)
    if pdo.static and pdo.write:
        file.fault((*key, "write"), "cannot be: a static mapping has no objects to write")
    for name in ("transmission_type", "inhibit_ms", "event_ms"):
        if getattr(pdo, name) is not None and not pdo.write:
            file.fault((*key, name), "has no effect without write = true")


def _check_neighbours(pdo: Pdo, words: list[str], process: list[str], key: Key, file: MergedFile) -> None:
    """Check that an object that fills several words fills successive ones, low words first."""
    places = [process.index(word) if word in process else None for word in words]
    for w in range(1, min(len(places), len(pdo.objects))):
        before, here = places[w - 1], places[w]
        shared = {ref.parts for ref in pdo.objects[w - 1]} & {ref.parts for ref in pdo.objects[w]}
        if shared and before is not None and here is not None and here != before + 1:
            message = f"{words[w - 1]} and {words[w]} share an object and are no neighbours"
            file.fault((*key, "objects", w), message, f"put them side by side in process.{_direction(key)}")


def _direction(key: Key) -> str:
    return next(str(part) for part in reversed(key) if isinstance(part, str))


def _run(pdo: Pdo, word: int, layout: int) -> int:
    """Number of words in a row that this object is named for."""

    def ref(place: int) -> tuple[ObjectRef, ...]:
        refs = pdo.objects[place]
        return refs[min(layout, len(refs) - 1)].parts

    run = 1
    while word + run < len(pdo.objects) and ref(word + run) == ref(word):
        run += 1
    while word and ref(word - 1) == ref(word):
        run, word = run + 1, word - 1
    return run


def check_cob_id(cob_id: int, family: Family, key: Key, file: MergedFile) -> None:
    most = _STANDARD_ID_MOST - family.family.node_id_high
    if cob_id > most:
        file.fault(key, f"{cob_id:X}h leaves no room for the node id", f"at most {most:X}h")
