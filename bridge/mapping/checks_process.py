"""Checks of the words, PDOs and slots of a mapping file."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from bridge.mapping.merge import MergedFile
from bridge.mapping.model import Family, ObjectRef, Pdo
from bridge.text import Text
from bridge.tomlfile import Key

_STANDARD_ID_MOST: Final = 0x7FF
_PDO_BITS: Final = 64


def twice(names: Iterable[tuple[str, Key]], noun: Text, file: MergedFile) -> None:
    """Check that no two have the same name; ``noun`` says what they are."""
    seen: dict[str, Key] = {}
    for name, key in names:
        if name in seen:
            said = Text.of("mapping.twice", noun=noun, name=name)
            file.fault(key, said, Text.of("mapping.first_in_line", line=file.line(seen[name])))
        else:
            seen[name] = key


def check_parameter(name: str, family: Family, key: Key, file: MergedFile) -> bool:
    """Check that ``name`` is a listed parameter."""
    known = sorted(parameter.name for parameter in family.parameter)
    if name not in known:
        file.fault(
            key, Text.of("mapping.no_parameter", name=name), Text.of("mapping.known", names=tuple(known))
        )
    return name in known


def check_process(family: Family, file: MergedFile) -> None:
    for name, words, first in (
        ("rpdo", family.process.rpdo, "control_word"),
        ("tpdo", family.process.tpdo, "status_word"),
    ):
        if words[0] != first:
            file.fault(("process", name), Text.of("mapping.first_word", word=first))
        named = ((word, ("process", name, place)) for place, word in enumerate(words))
        twice(named, Text.of("mapping.noun_word"), file)
    known = family.process.rpdo[1:]
    for word in family.process.rest:
        if word not in known:
            said = Text.of("mapping.no_setpoint_word", word=word)
            file.fault(("process", "rest", word), said, Text.of("mapping.known", names=tuple(known)))


def check_slots(family: Family, file: MergedFile) -> None:
    names = ((slot.name, ("slot", s, "name")) for s, slot in enumerate(family.slot))
    twice(names, Text.of("mapping.noun_slot"), file)
    if any(slot.axis > 1 for slot in family.slot):
        axes = ((f"{slot.axis}", ("slot", s, "axis")) for s, slot in enumerate(family.slot))
        twice(axes, Text.of("mapping.noun_axis"), file)
    for s, slot in enumerate(family.slot):
        for name, pdos, words in (
            ("rpdo", slot.rpdo, family.process.rpdo),
            ("tpdo", slot.tpdo, family.process.tpdo),
        ):
            _check_direction(family, pdos, words, ("slot", s, name), file)
        if slot.emcy_drive is not None and family.emcy.drive_byte is None:
            said = Text.of("mapping.no_meaning_without", setting="emcy.drive_byte")
            file.fault(("slot", s, "emcy_drive"), said)


def _check_direction(family: Family, pdos: list[Pdo], process: list[str], key: Key, file: MergedFile) -> None:
    """Check all PDOs of one direction of a slot."""
    keys = [file.item(key, p) for p in range(len(pdos))]
    named = list(zip(pdos, keys, strict=True))
    numbers = ((f"{pdo.number}", (*at, "number")) for pdo, at in named)
    twice(numbers, Text.of("mapping.noun_pdo_number", kind=str(key[-1]).upper()), file)
    carried: list[tuple[str, Key]] = []
    for pdo, at in named:
        words = pdo.words or process
        carried += [(word, (*at, "words", w) if pdo.words else at) for w, word in enumerate(words)]
        _check_pdo(family, pdo, process, at, file)
    twice(carried, Text.of("mapping.noun_word"), file)
    first = process[0]
    if not any(first in (pdo.words or process) and not pdo.optional for pdo in pdos):
        file.fault(key, Text.of("mapping.not_carried", word=first), Text.of("mapping.not_carried_advice"))


def _check_pdo(family: Family, pdo: Pdo, process: list[str], key: Key, file: MergedFile) -> None:
    names = f"process.{_direction(key)}"
    for w, word in enumerate(pdo.words):
        if word not in process:
            said = Text.of("mapping.no_word", names=names, word=word)
            file.fault((*key, "words", w), said, Text.of("mapping.known", names=tuple(process)))
    words = pdo.words or process
    count = len(pdo.objects)
    if count != len(words):
        by = "words" if pdo.words else names
        said = Text.of("mapping.words_unequal", count=count, names=by, named=len(words))
        file.fault((*key, "objects"), said)
    _check_neighbours(pdo, words, process, key, file)
    for w, refs in enumerate(pdo.objects):
        for r, mapped in enumerate(refs):
            if not mapped.is_composite and mapped.bits[0] > 16 * _run(pdo, w, r):
                said = Text.of("mapping.object_long", object=str(mapped))
                file.fault((*key, "objects", w, r), said, Text.of("mapping.object_long_advice"))
    bits = 16 * count
    if bits > _PDO_BITS:
        file.fault((*key, "objects"), Text.of("site.pdo_bits", bits=bits, most=_PDO_BITS))
    check_cob_id(pdo.cob_id, family, (*key, "cob_id"), file)
    if pdo.static and pdo.write:
        file.fault((*key, "write"), Text.of("mapping.write_static"))
    for name in ("transmission_type", "inhibit_ms", "event_ms"):
        if getattr(pdo, name) is not None and not pdo.write:
            file.fault((*key, name), Text.of("mapping.no_effect_without", setting="write = true"))


def _check_neighbours(pdo: Pdo, words: list[str], process: list[str], key: Key, file: MergedFile) -> None:
    """Check that an object that fills several words fills successive ones, low words first."""
    places = [process.index(word) if word in process else None for word in words]
    for w in range(1, min(len(places), len(pdo.objects))):
        before, here = places[w - 1], places[w]
        shared = {ref.parts for ref in pdo.objects[w - 1]} & {ref.parts for ref in pdo.objects[w]}
        if shared and before is not None and here is not None and here != before + 1:
            said = Text.of("mapping.no_neighbours", first=words[w - 1], second=words[w])
            hint = Text.of("mapping.no_neighbours_advice", names=f"process.{_direction(key)}")
            file.fault((*key, "objects", w), said, hint)


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
        said = Text.of("mapping.cob_id_high", cob_id=cob_id)
        file.fault(key, said, Text.of("mapping.cob_id_high_advice", most=most))
