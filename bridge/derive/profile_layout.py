"""PDOs in which a drive of the profile CiA 402 gets its control word and sends its status word."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

from bridge.derive.modes import MODE_DISPLAY, Mode, bits_of
from bridge.derive.pdo_words import (
    WORD_BITS,
    FurtherWords,
    NoLayout,
    PdoLayout,
    WordNames,
    Words,
    reference,
)
from bridge.eds import Description
from bridge.eds.pdos import MappedEntry, PdoSummary, pdos
from bridge.text import Said, Text

_BITS: Final = (8, 16, 32)
"""Lengths of objects that words are made of."""
_MOST_WORDS: Final = 4
_MOST_PROCESS_WORDS: Final = 9
_FIRST_COB_ID: Final = {True: 0x200, False: 0x180}
_PREDEFINED: Final = 4
_MOST_COB_ID: Final = 0x780


@dataclass(frozen=True, slots=True)
class ProfileLayout:
    """Both directions. Where one has no PDOs here, it is as the base has it."""

    rpdo_words: tuple[str, ...]
    tpdo_words: tuple[str, ...]
    rpdo: tuple[PdoLayout, ...] = field(default=())
    tpdo: tuple[PdoLayout, ...] = field(default=())
    tells_mode: bool = True

    @property
    def is_base(self) -> bool:
        return not self.rpdo and not self.tpdo


class Axes:
    """Common part of the axes of a device: the names of further words, of which the same object of each axis
    has the same, and the COB-IDs that no PDO of the device has."""

    def __init__(self, description: Description) -> None:
        self.further = FurtherWords()
        self._spare: dict[bool, list[int]] = {}
        for receives, first in _FIRST_COB_ID.items():
            bases = (_base(description, one) for one in pdos(description) if one.receives is receives)
            used = set(bases)
            predefined = (first + 0x100 * place for place in range(_PREDEFINED))
            self._spare[receives] = [base for base in predefined if base not in used]

    def spare(self, receives: bool) -> int | None:
        """A COB-ID for a PDO that has none: each is given once."""
        left = self._spare[receives]
        return left.pop(0) if left else None


def layout_of(description: Description, mode: Mode, axes: Axes | None = None) -> ProfileLayout:
    """Layout of the PDOs by which the device is driven in ``mode``. Of one with several ``axes`` the
    description is that of one axis, and the PDOs are named in any case. Raises ``NoLayout``."""
    commands = _words(mode.commanded, "control_word", "setpoint")
    told = _words(mode.told, "status_word", "value")
    tells_mode = bits_of(description, MODE_DISPLAY) == 8
    rpdo: tuple[PdoLayout, ...] = ()
    tpdo: tuple[PdoLayout, ...] = ()
    if axes or not _is_free(description, mode.commanded, receives=True):
        rpdo = _own_or_free(description, mode, commands, "setpoint", receives=True, axes=axes)
    if axes:
        mode_word = f"value_{len(told)}"
        axes.further.reserve([mode_word])
        told |= {mode_word: (MODE_DISPLAY, 8)} if tells_mode else {}
        tpdo = _own_or_free(description, mode, told, "value", receives=False, axes=axes)
        tells_mode = any(reference(MODE_DISPLAY, 8) in pdo.objects for pdo in tpdo)
    elif _is_free(description, (*mode.told, (MODE_DISPLAY, 8)), receives=False) and tells_mode:
        told[f"value_{len(told)}"] = (MODE_DISPLAY, 8)
    elif _is_free(description, mode.told, receives=False):
        tells_mode = False
        objects = tuple(reference(index) for index, _ in told.values())
        tpdo = (PdoLayout(1, 0x180, tuple(told), objects),)
    else:
        if tells_mode:
            told[f"value_{len(told)}"] = (MODE_DISPLAY, 8)
        tpdo = _own_or_free(description, mode, told, "value", receives=False)
        tells_mode = any(reference(MODE_DISPLAY, 8) in pdo.objects for pdo in tpdo)
    rpdo_words = _process(commands, rpdo)
    tpdo_words = _process(told, tpdo)
    for words in (rpdo_words, tpdo_words):
        if len(words) > _MOST_PROCESS_WORDS:
            raise NoLayout(Text.of("derive.words", words=len(words), most=_MOST_PROCESS_WORDS))
    return ProfileLayout(rpdo_words, tpdo_words, rpdo, tpdo, tells_mode)


def _words(objects: Sequence[tuple[int, int]], first: str, others: str) -> Words:
    words: Words = {first: objects[0]}
    for index, bits in objects[1:]:
        for _ in range(bits // WORD_BITS):
            words[f"{others}_{len(words)}"] = (index, bits)
    return words


def _process(words: Words, own: Sequence[PdoLayout]) -> tuple[str, ...]:
    """The words of a direction: those of the mode first, then what else its PDOs carry."""
    if not own:
        return tuple(words)
    carried = [name for pdo in own for name in pdo.words]
    first = [name for name in words if name in carried]
    return (*first, *(name for name in carried if name not in first))


def _is_free(
    description: Description, objects: Sequence[tuple[int, int]], *, receives: bool, number: int = 1
) -> bool:
    """Whether a PDO of the direction can be made to carry these objects, and be switched on."""
    mapping = description.object((0x1600 if receives else 0x1A00) + number - 1)
    communication = description.object((0x1400 if receives else 0x1800) + number - 1)
    if mapping is None or communication is None:
        return False
    subs = [mapping.entry(sub) for sub in range(len(objects) + 1)]
    if not all(entry and entry.access.writable for entry in subs):
        return False
    cob_id = communication.entry(1)
    if not cob_id or not cob_id.access.writable:
        return False
    entries = [description.entry(index) for index, _ in objects]
    return all(entry and entry.pdo_mappable for entry in entries)


def _own_or_free(
    description: Description,
    mode: Mode,
    words: Words,
    others: str,
    *,
    receives: bool,
    axes: Axes | None = None,
) -> tuple[PdoLayout, ...]:
    """PDOs that carry the objects of ``words``: those that carry them already, else one that can be made to.
    Raises ``NoLayout``, which is about the former."""
    of_direction = [one for one in pdos(description) if one.receives is receives]
    bases = {one.number: base for one in of_direction if (base := _base(description, one)) is not None}
    there = [one for one in of_direction if one.number in bases]
    if axes:
        there += [replace(one, enabled=False) for one in of_direction if _is_placeable(description, one)]
    chosen: list[PdoSummary] = []
    try:
        chosen = _own(description, there, words, receives=receives)
        names = WordNames(description, mode, words, others, axes.further if axes else FurtherWords())
        return tuple(names.layout(one, _placed(one, bases, axes)) for one in chosen)
    except NoLayout:
        wanted = dict.fromkeys(words.values())
        needed = [one for one in wanted if one[0] != MODE_DISPLAY]
        free = _free(description, there, list(wanted)) or _free(description, there, needed)
        if free is None:
            raise
    names = WordNames(description, mode, words, others, axes.further if axes else FurtherWords())
    return (names.layout(free, _placed(free, bases, axes)),)


def _is_placeable(description: Description, pdo: PdoSummary) -> bool:
    """Whether it has no COB-ID of its own and can be given one."""
    entry = description.entry((0x1400 if pdo.receives else 0x1800) + pdo.number - 1, 1)
    return _base(description, pdo) is None and entry is not None and entry.access.writable


def _placed(pdo: PdoSummary, bases: Mapping[int, int], axes: Axes | None) -> int:
    """COB-ID of a PDO without the node id. Raises ``NoLayout`` where there is none left."""
    base = bases.get(pdo.number)
    if base is None and axes:
        base = axes.spare(pdo.receives)
    if base is None:
        first = _FIRST_COB_ID[pdo.receives]
        last = first + 0x100 * (_PREDEFINED - 1)
        raise NoLayout(Text.of("derive.no_cob_id", pdo=pdo.name, first=first, last=last))
    return base


def _free(
    description: Description, there: Sequence[PdoSummary], objects: Sequence[tuple[int, int]]
) -> PdoSummary | None:
    """A PDO that the boot-up can map and switch on, one that is in nobody's way first, as it will be."""
    for one in sorted(there, key=lambda one: one.enabled and bool(one.mapped)):
        if _is_free(description, objects, receives=one.receives, number=one.number):
            mapped = tuple(MappedEntry(index, 0, bits, "") for index, bits in objects)
            return replace(one, mapped=mapped, enabled=False)
    return None


def _own(
    description: Description, of_direction: Sequence[PdoSummary], words: Words, *, receives: bool
) -> list[PdoSummary]:
    """The device's own PDOs that carry the objects of ``words``, and what those that can be mapped have to
    carry beside them. Raises ``NoLayout``."""
    there = [one for one in of_direction if _is_usable(description, one)]
    there.sort(key=lambda one: not one.enabled)
    # One that carries nothing else needs nobody to say what is right for the rest of it.
    there.sort(key=lambda one: sum(not _is_wanted(item, words) for item in one.mapped))
    wanted = dict.fromkeys(words.values())
    needed = [one for one in wanted if one[0] != MODE_DISPLAY]
    whole = [one for one in there if all(_carries(one, want) for want in needed)]
    whole.sort(key=lambda one: not all(_carries(one, want) for want in wanted))
    chosen = whole[:1]
    missing: list[tuple[int, int]] = []
    for want in needed if not whole else ():
        if any(_carries(one, want) for one in chosen):
            continue
        carriers = [one for one in there if _carries(one, want)]
        chosen += carriers[:1]
        if not carriers:
            missing.append(want)
    if missing:
        taken = {one.number for one in chosen}
        free = _free(description, [one for one in of_direction if one.number not in taken], missing)
        if free is None:
            raise NoLayout(_why_none(of_direction, missing[0], receives=receives))
        chosen.append(free)
    return sorted(chosen, key=lambda one: one.number)


def _why_none(of_direction: Sequence[PdoSummary], want: tuple[int, int], *, receives: bool) -> Text:
    """Reason why no PDO carries an object, with what is wrong with the one that has it."""
    kind, ref = "RPDO" if receives else "TPDO", f"{want[0]:04X}h"
    for one in (one for one in of_direction if _carries(one, want)):
        if why := _why_unusable(one):
            return Text.of("derive.none_carries_because", kind=kind, object=ref, why=why)
    return Text.of("derive.none_carries", kind=kind, object=ref)


def _why_unusable(pdo: PdoSummary) -> Said:
    odd = next((item for item in pdo.mapped if item.bits not in _BITS), None)
    if odd is None:
        return "" if pdo.enabled else Text.of("derive.pdo_off", pdo=pdo.name)
    ref = f"{odd.index:04X}h:{odd.sub:02X}"
    if not odd.name:
        return Text.of("derive.odd_bits", pdo=pdo.name, object=ref, bits=odd.bits)
    return Text.of("derive.odd_bits_named", pdo=pdo.name, object=ref, name=odd.name, bits=odd.bits)


def _is_usable(description: Description, pdo: PdoSummary) -> bool:
    """Whether a mapping can say what it carries, in words and whole objects, and it can be on."""
    if not pdo.mapped or any(one.bits not in _BITS for one in pdo.mapped):
        return False
    if sum(-(-one.bits // WORD_BITS) for one in pdo.mapped) > _MOST_WORDS:
        return False
    entry = description.entry((0x1400 if pdo.receives else 0x1800) + pdo.number - 1, 1)
    return pdo.enabled or bool(entry and entry.access.writable)


def _base(description: Description, pdo: PdoSummary) -> int | None:
    """COB-ID of a PDO without the node id; None where the file does not tell."""
    entry = description.entry((0x1400 if pdo.receives else 0x1800) + pdo.number - 1, 1)
    value = entry.current if entry else None
    if value and value.plus_node_id and isinstance(value.plain, int):
        base = value.plain & 0x7FF
        return base if base <= _MOST_COB_ID else None
    if pdo.number <= _PREDEFINED:
        return _FIRST_COB_ID[pdo.receives] + 0x100 * (pdo.number - 1)
    return None


def _is_wanted(one: MappedEntry, words: Words) -> bool:
    return not one.sub and (one.index, one.bits) in words.values()


def _carries(pdo: PdoSummary, want: tuple[int, int]) -> bool:
    return any((one.index, one.bits) == want and one.sub == 0 for one in pdo.mapped)
