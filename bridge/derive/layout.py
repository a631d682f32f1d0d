"""In which PDOs a drive of the profile CiA 402 gets its control word and tells its status word."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

from bridge.canopen.datatypes import REALS
from bridge.derive.modes import MODE, MODE_DISPLAY, PROFILE_402, Mode, bits_of
from bridge.derive.titles import title_of
from bridge.derive.toml import string, strings, word
from bridge.eds import DataType, Description, Entry
from bridge.eds.pdos import MappedObject, PdoSummary, pdos
from bridge.parameter.effect import Effect
from bridge.parameter.profiles import effect_of

_WORD: Final = 16
_BITS: Final = (8, 16, 32)
"""Lengths of objects that words are made of."""
_MOST_WORDS: Final = 4
_MOST_PROCESS_WORDS: Final = 9
_FIRST_COB_ID: Final = {True: 0x200, False: 0x180}
_PREDEFINED: Final = 4
_MOST_COB_ID: Final = 0x780
_DUMMIES: Final = range(0x0001, 0x0008)
"""Data types that fill a PDO (CiA 301 §7.4.7)."""


class NoLayout(Exception):
    """The device cannot be driven in this mode; the text says why."""


@dataclass(frozen=True, slots=True)
class Further:
    """An object that a PDO carries beside what the mode needs; ``words`` are those that it fills, the low one
    first. ``rest`` is what an RPDO sends in it while nobody commands it, as an integer without sign."""

    words: tuple[str, ...]
    entry: Entry
    title: str
    rest: int = 0


@dataclass(frozen=True, slots=True)
class PdoLayout:
    """One PDO; ``objects`` has for each of ``words`` what stands for it."""

    number: int
    cob_id: int
    words: tuple[str, ...]
    objects: tuple[str, ...]
    turn_on: bool = False
    """The device has it off, or with another mapping: the boot-up writes it."""
    further: tuple[Further, ...] = ()
    """What it carries beside what the mode needs."""
    signed: tuple[str, ...] = ()
    """Objects of one byte with a sign."""
    times: tuple[str, ...] = ()
    """When it is sent, where it is written: keys of the mapping file with their values."""

    def lines(self, direction: str, *, names_words: bool = True) -> list[str]:
        """As an item of ``[[slot]]``."""
        objects = ", ".join(f"[{string(one)}]" for one in self.objects)
        lines = [f"[[slot.{direction}]]", f"number = {self.number}", f"cob_id = {word(self.cob_id, 3)}"]
        if names_words:
            lines.append(f"words = {strings(self.words)}")
        lines.append(f"objects = [{objects}]")
        if self.signed:
            lines.append(f"signed = {strings(self.signed)}")
        if self.turn_on:
            lines.append("write = true                 # the device has it off, or maps it otherwise")
            lines += self.times
        return lines


@dataclass(frozen=True, slots=True)
class Layout:
    """Both directions. Where one has no PDOs here, it is as the base has it."""

    rpdo_words: tuple[str, ...]
    tpdo_words: tuple[str, ...]
    rpdo: tuple[PdoLayout, ...] = field(default=())
    tpdo: tuple[PdoLayout, ...] = field(default=())
    tells_mode: bool = True

    @property
    def is_base(self) -> bool:
        return not self.rpdo and not self.tpdo


def layout_of(description: Description, mode: Mode) -> Layout:
    """How the device can be driven in ``mode``. Raises ``NoLayout``."""
    commands = _words(mode.commanded, "control_word", "setpoint")
    told = _words(mode.told, "status_word", "value")
    tells_mode = bits_of(description, MODE_DISPLAY) == 8
    rpdo: tuple[PdoLayout, ...] = ()
    tpdo: tuple[PdoLayout, ...] = ()
    if not _is_free(description, mode.commanded, receives=True):
        rpdo = _own_or_free(description, mode, commands, "setpoint", receives=True)
    if _is_free(description, (*mode.told, (MODE_DISPLAY, 8)), receives=False) and tells_mode:
        told[f"value_{len(told)}"] = (MODE_DISPLAY, 8)
    elif _is_free(description, mode.told, receives=False):
        tells_mode = False
        objects = tuple(_ref(index) for index, _ in told.values())
        tpdo = (PdoLayout(1, 0x180, tuple(told), objects),)
    else:
        if tells_mode:
            told[f"value_{len(told)}"] = (MODE_DISPLAY, 8)
        tpdo = _own_or_free(description, mode, told, "value", receives=False)
        tells_mode = any(_ref(MODE_DISPLAY, 8) in pdo.objects for pdo in tpdo)
    rpdo_words = _process(commands, rpdo)
    tpdo_words = _process(told, tpdo)
    for words in (rpdo_words, tpdo_words):
        if len(words) > _MOST_PROCESS_WORDS:
            raise NoLayout(f"its PDOs have {len(words)} words, a drive has {_MOST_PROCESS_WORDS}")
    return Layout(rpdo_words, tpdo_words, rpdo, tpdo, tells_mode)


_Words = dict[str, tuple[int, int]]
"""By the name of each word: the object that fills it, and how many bits it has."""


def _words(objects: Sequence[tuple[int, int]], first: str, others: str) -> _Words:
    words: _Words = {first: objects[0]}
    for index, bits in objects[1:]:
        for _ in range(bits // _WORD):
            words[f"{others}_{len(words)}"] = (index, bits)
    return words


def _ref(index: int, bits: int = _WORD, sub: int = 0) -> str:
    return f"{index:04X}:{sub:02X}" + (f"/{bits}" if bits < _WORD else "")


def _process(words: _Words, own: Sequence[PdoLayout]) -> tuple[str, ...]:
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
    description: Description, mode: Mode, words: _Words, others: str, *, receives: bool
) -> tuple[PdoLayout, ...]:
    """PDOs that carry the objects of ``words``: those that carry them already, else one that can be made to.
    Raises ``NoLayout``, which is about the former."""
    of_direction = [one for one in pdos(description) if one.receives is receives]
    bases = {one.number: base for one in of_direction if (base := _base(description, one)) is not None}
    there = [one for one in of_direction if one.number in bases]
    chosen: list[PdoSummary] = []
    try:
        chosen = _own(description, there, words, receives=receives)
        names = _Names(description, mode, words, others)
        return tuple(names.layout(one, bases[one.number]) for one in chosen)
    except NoLayout:
        wanted = dict.fromkeys(words.values())
        needed = [one for one in wanted if one[0] != MODE_DISPLAY]
        free = _free(description, there, list(wanted)) or _free(description, there, needed)
        if free is None:
            raise
    return (_Names(description, mode, words, others).layout(free, bases[free.number]),)


def _free(
    description: Description, there: Sequence[PdoSummary], objects: Sequence[tuple[int, int]]
) -> PdoSummary | None:
    """A PDO that the boot-up can map and switch on, one that is in nobody's way first, as it will be."""
    for one in sorted(there, key=lambda one: one.enabled and bool(one.mapped)):
        if _is_free(description, objects, receives=one.receives, number=one.number):
            mapped = tuple(MappedObject(index, 0, bits, "") for index, bits in objects)
            return replace(one, mapped=mapped, enabled=False)
    return None


def _own(
    description: Description, of_direction: Sequence[PdoSummary], words: _Words, *, receives: bool
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


def _why_none(of_direction: Sequence[PdoSummary], want: tuple[int, int], *, receives: bool) -> str:
    """Why no PDO brings or tells an object, with what is wrong with the one that has it."""
    kind = "RPDO" if receives else "TPDO"
    why = f"no {kind} of the device carries {want[0]:04X}h, and none can be made to"
    for one in (one for one in of_direction if _carries(one, want)):
        odd = next((item for item in one.mapped if item.bits not in _BITS), None)
        if odd is not None:
            named = f" ({odd.name})" if odd.name else ""
            return f"{why}: {one.name} has {odd.index:04X}h:{odd.sub:02X}{named} of {odd.bits} bits beside it"
        if not one.enabled:
            return f"{why}: {one.name} is off and cannot be switched on"
    return why


def _is_usable(description: Description, pdo: PdoSummary) -> bool:
    """Whether a mapping can say what it carries, in words and whole objects, and it can be on."""
    if not pdo.mapped or any(one.bits not in _BITS for one in pdo.mapped):
        return False
    if sum(-(-one.bits // _WORD) for one in pdo.mapped) > _MOST_WORDS:
        return False
    entry = description.entry((0x1400 if pdo.receives else 0x1800) + pdo.number - 1, 1)
    return pdo.enabled or bool(entry and entry.access.writable)


def _base(description: Description, pdo: PdoSummary) -> int | None:
    """Its COB-ID without the node id; None where the file does not tell."""
    entry = description.entry((0x1400 if pdo.receives else 0x1800) + pdo.number - 1, 1)
    value = entry.current if entry else None
    if value and value.plus_node_id and isinstance(value.plain, int):
        base = value.plain & 0x7FF
        return base if base <= _MOST_COB_ID else None
    if pdo.number <= _PREDEFINED:
        return _FIRST_COB_ID[pdo.receives] + 0x100 * (pdo.number - 1)
    return None


def _is_wanted(one: MappedObject, words: _Words) -> bool:
    return not one.sub and (one.index, one.bits) in words.values()


def _carries(pdo: PdoSummary, want: tuple[int, int]) -> bool:
    return any((one.index, one.bits) == want and one.sub == 0 for one in pdo.mapped)


def _times(description: Description, pdo: PdoSummary) -> Iterator[str]:
    """How one that is switched on is sent, as far as it can be set: with each change, and a TPDO every
    100 ms, as those of the base. A PDO that is off has often a type that waits for SYNC or for a request."""
    index = (0x1400 if pdo.receives else 0x1800) + pdo.number - 1
    subs = ((2, "transmission_type = 255"),)
    if not pdo.receives:
        subs = (*subs, (3, "inhibit_ms = 10.0"), (5, "event_ms = 100"))
    for sub, line in subs:
        entry = description.entry(index, sub)
        if entry and entry.access.writable:
            yield line


class _Names:
    """Gives each word of the chosen PDOs a name, and none twice."""

    def __init__(self, description: Description, mode: Mode, words: _Words, others: str) -> None:
        self._description = description
        self._mode = mode
        self._free = dict(words)
        self._others = others
        self._next = len(words)

    def layout(self, pdo: PdoSummary, cob_id: int) -> PdoLayout:
        words: list[str] = []
        objects: list[str] = []
        further: list[Further] = []
        for one in pdo.mapped:
            names = self._known(one)
            if not names:
                names = self._new(max(1, one.bits // _WORD))
                if one.index not in _DUMMIES:
                    further.append(self._further(pdo, one, tuple(names)))
            words += names
            objects += [_ref(one.index, one.bits, one.sub)] * len(names)
        signed = tuple(_ref(one.index, sub=one.sub) for one in pdo.mapped if self._is_signed_byte(pdo, one))
        times = () if pdo.enabled else tuple(_times(self._description, pdo))
        return PdoLayout(
            pdo.number, cob_id, tuple(words), tuple(objects), not pdo.enabled, tuple(further), signed, times
        )

    def _is_signed_byte(self, pdo: PdoSummary, one: MappedObject) -> bool:
        """Whether it has to be told that a byte of a TPDO has a sign."""
        entry = None if pdo.receives else self._description.entry(one.index, one.sub)
        return entry is not None and entry.data_type is DataType.INTEGER8

    def _further(self, pdo: PdoSummary, one: MappedObject, words: tuple[str, ...]) -> Further:
        """Raises ``NoLayout`` for what an RPDO carries and nobody says a right value for: 0 is not right for
        a torque limit, and as a mode of operation it is none."""
        entry = self._description.entry(one.index, one.sub)
        if entry is None:
            kind = "RPDO" if pdo.receives else "TPDO"
            ref = _ref(one.index, one.bits, one.sub)
            raise NoLayout(f"{kind}{pdo.number} carries {ref}, which the file does not describe")
        title = title_of(self._description, entry)
        if not pdo.receives:
            return Further(words, entry, title)
        mask = (1 << one.bits) - 1
        if one.index == MODE:
            return Further(words, entry, title, self._mode.number & mask)
        value = entry.current.at(None) if entry.current else None
        if entry.data_type is DataType.REAL32 and isinstance(value, int | float):
            return Further(words, entry, title, int.from_bytes(REALS["real32"].encode(value), "little"))
        if isinstance(value, int):
            return Further(words, entry, title, value & mask)
        if effect_of(one.index, PROFILE_402) is Effect.COMMANDS:
            return Further(words, entry, title)
        raise NoLayout(
            f"RPDO{pdo.number} carries {one.index:04X}h:{one.sub:02X} ({entry.name}) too, and line "
            f"{entry.line} of the file has no default value to be sent in it: give it one, or write the "
            "mapping by hand"
        )

    def _known(self, one: MappedObject) -> list[str]:
        names = [name for name, want in self._free.items() if want == (one.index, one.bits) and not one.sub]
        for name in names:
            del self._free[name]
        return names

    def _new(self, count: int) -> list[str]:
        names = [f"{self._others}_{self._next + place}" for place in range(count)]
        self._next += count
        return names
