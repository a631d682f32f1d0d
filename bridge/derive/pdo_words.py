"""Words of a PDO of a drive: names, contents, and the values that are sent in them at rest."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace
from typing import Final

from bridge.canopen.datatypes import REALS
from bridge.derive.axis_descriptions import AxisDescription
from bridge.derive.modes import MODE, PROFILE_402, Mode
from bridge.derive.titles import title_of
from bridge.derive.toml import string, strings, word
from bridge.eds import Description, Entry, StaticDataType
from bridge.eds.pdos import MappedEntry, PdoSummary
from bridge.parameter.profiles import effect_of
from bridge.parameter.write_effect import Effect
from bridge.text import Text

WORD_BITS: Final = 16
_DUMMIES: Final = range(0x0001, 0x0008)
"""Data types that fill a PDO (CiA 301 §7.4.7)."""

Words = dict[str, tuple[int, int]]
"""Object that fills each word, and how many bits it has, by the name of the word."""


class NoLayout(Exception):
    """A device that cannot be driven in this mode; ``said`` is why."""

    def __init__(self, said: Text) -> None:
        super().__init__(said)
        self.said = said


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
    """Objects that it carries beside those that the mode needs."""
    signed: tuple[str, ...] = ()
    """Objects of one byte with a sign."""
    times: tuple[str, ...] = ()
    """Transmission settings, where they are written: keys of the mapping file with their values."""

    def of_node(self, view: AxisDescription) -> PdoLayout:
        """The PDO of an axis, with the objects as the node has them."""
        objects, signed = (tuple(view.reference(ref) for ref in refs) for refs in (self.objects, self.signed))
        return replace(self, objects=objects, signed=signed)

    def lines(self, direction: str) -> list[str]:
        """Lines of an item of ``[[slot]]``."""
        objects = ", ".join(f"[{string(one)}]" for one in self.objects)
        lines = [f"[[slot.{direction}]]", f"number = {self.number}", f"cob_id = {word(self.cob_id, 3)}"]
        lines += [f"words = {strings(self.words)}", f"objects = [{objects}]"]
        if self.signed:
            lines.append(f"signed = {strings(self.signed)}")
        if self.turn_on:
            lines.append("write = true                 # the device has it off, or maps it otherwise")
            lines += self.times
        return lines


def reference(index: int, bits: int = WORD_BITS, sub: int = 0) -> str:
    return f"{index:04X}:{sub:02X}" + (f"/{bits}" if bits < WORD_BITS else "")


class FurtherWords:
    """The names of words that the mode does not name, for all axes of a device: the same object of each has
    the same."""

    def __init__(self) -> None:
        self._names: dict[tuple[str, int, int, int, int], list[str]] = {}
        self._taken: set[str] = set()

    def reserve(self, words: Collection[str]) -> None:
        """Names that the mode may need in another axis."""
        self._taken.update(words)

    def names(self, kind: str, one: MappedEntry, rest: int, count: int, used: Collection[str]) -> list[str]:
        """Names of the words that an object fills which the mode does not name; ``used`` are the axis's."""
        key = (kind, one.index, one.sub, one.bits, rest)
        there = self._names.get(key, [])
        if there and not set(there) & set(used):
            return there
        taken = self._taken | set(used)
        first = next(
            n for n in range(1, 1000) if not {f"{kind}_{n + place}" for place in range(count)} & taken
        )
        made = [f"{kind}_{first + place}" for place in range(count)]
        self._taken.update(made)
        self._names.setdefault(key, made)
        return made


def _times(description: Description, pdo: PdoSummary) -> Iterator[str]:
    """Transmission settings of a PDO that is switched on, as far as they can be set: with each change, and a
    TPDO every 100 ms, as those of the base. A PDO that is off has often a type that waits for SYNC or for a
    request."""
    index = (0x1400 if pdo.receives else 0x1800) + pdo.number - 1
    subs = ((2, "transmission_type = 255"),)
    if not pdo.receives:
        subs = (*subs, (3, "inhibit_ms = 10.0"), (5, "event_ms = 100"))
    for sub, line in subs:
        entry = description.entry(index, sub)
        if entry and entry.access.writable:
            yield line


class WordNames:
    """Gives each word of the chosen PDOs a name, and none twice."""

    def __init__(
        self, description: Description, mode: Mode, words: Words, others: str, further: FurtherWords
    ) -> None:
        self._further = further
        self._used = set(words)
        self._description = description
        self._mode = mode
        self._free = dict(words)
        self._others = others

    def layout(self, pdo: PdoSummary, cob_id: int) -> PdoLayout:
        words: list[str] = []
        objects: list[str] = []
        further: list[Further] = []
        for one in pdo.mapped:
            names = self._known(one)
            if not names:
                is_filler = one.index in _DUMMIES
                rest = 0 if is_filler else self._rest(pdo, one)
                names = self._new(one, rest)
                if not is_filler:
                    entry = self._entry(pdo, one)
                    further.append(Further(tuple(names), entry, title_of(self._description, entry), rest))
            words += names
            objects += [reference(one.index, one.bits, one.sub)] * len(names)
        signed = tuple(
            reference(one.index, sub=one.sub) for one in pdo.mapped if self._is_signed_byte(pdo, one)
        )
        times = () if pdo.enabled else tuple(_times(self._description, pdo))
        return PdoLayout(
            pdo.number, cob_id, tuple(words), tuple(objects), not pdo.enabled, tuple(further), signed, times
        )

    def _is_signed_byte(self, pdo: PdoSummary, one: MappedEntry) -> bool:
        """Whether it has to be told that a byte of a TPDO has a sign."""
        entry = None if pdo.receives else self._description.entry(one.index, one.sub)
        return entry is not None and entry.data_type is StaticDataType.INTEGER8

    def _entry(self, pdo: PdoSummary, one: MappedEntry) -> Entry:
        """Raises ``NoLayout``."""
        entry = self._description.entry(one.index, one.sub)
        if entry is None:
            ref = reference(one.index, one.bits, one.sub)
            raise NoLayout(Text.of("derive.carries_unknown", pdo=pdo.name, object=ref))
        return entry

    def _rest(self, pdo: PdoSummary, one: MappedEntry) -> int:
        """Value that a PDO carries while nobody commands it, as an integer without sign. Raises ``NoLayout``
        where nobody says a right value for it: 0 is not right for a torque limit, and as a mode of operation
        it is none."""
        entry = self._entry(pdo, one)
        if not pdo.receives:
            return 0
        mask = (1 << one.bits) - 1
        if one.index == MODE:
            return self._mode.number & mask
        value = entry.current.at(None) if entry.current else None
        if entry.data_type is StaticDataType.REAL32 and isinstance(value, int | float):
            return int.from_bytes(REALS["real32"].encode(value), "little")
        if isinstance(value, int):
            return value & mask
        if effect_of(one.index, PROFILE_402) is Effect.COMMANDS:
            return 0
        said = Text.of(
            "derive.no_rest",
            pdo=pdo.name,
            object=f"{one.index:04X}h:{one.sub:02X}",
            name=entry.name,
            line=entry.line,
        )
        raise NoLayout(said)

    def _known(self, one: MappedEntry) -> list[str]:
        names = [name for name, want in self._free.items() if want == (one.index, one.bits) and not one.sub]
        for name in names:
            del self._free[name]
        return names

    def _new(self, one: MappedEntry, rest: int) -> list[str]:
        count = max(1, one.bits // WORD_BITS)
        names = self._further.names(self._others, one, rest, count, self._used)
        self._used.update(names)
        return names
