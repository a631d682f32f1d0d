"""What the words of one drive mean in each of its parameter sets: which value stands where, and by what
scale. A meaning counts only where it has been read from the drive."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final, NamedTuple

from bridge.drive.parameter_set import ParameterSet
from bridge.drive.scaling import LinearScale, is_scale, no_scale, scale_of
from bridge.drive.values import ValueCodec, scales_of
from bridge.image import Quality
from bridge.mapping.model import Family, Meaning, ProcessValue, Slot

Codes = Mapping[str, Sequence[int | None]]
"""By the word's leaf, such as ``actual/value_1``, the code in each parameter set; None: it cannot be read."""

_FIRST: Final = 1


class Lack(NamedTuple):
    """Why a value is not served."""

    quality: Quality
    why: str


class Meanings:
    """Of one drive. Before the boot-up no meaning is known, and what has one waits."""

    def __init__(self, family: Family, slot: Slot, given: Mapping[str, float]) -> None:
        """``given`` are the scaling parameters of the site file: those of set 1, where no name tells another
        (``P112.2``)."""
        self._family = family
        self._slot = slot
        self.sets = range(_FIRST, family.sets + 1)
        self.scales = scales_of(family, given)
        """In set 1, by the value's leaf."""
        self._scales = {number: {} if number > _FIRST else self.scales for number in self.sets}
        for name, full in given.items():
            parameter, in_set = family.parameter_and_set(name)
            if in_set in self.sets:
                self._scales[in_set].update(scales_of(family, {parameter: full}))
        self._no_scale: dict[tuple[str, int], float] = {}
        """What the drive has for parameters that scale, and that is no scale."""
        self._codes: dict[str, tuple[int | None, ...]] = {}
        self._unread = Lack(Quality.WAITING, "has not been read yet")
        self._found: dict[tuple[str, int], tuple[ValueCodec, Lack | None]] = {}
        self._set = ParameterSet(family.status_word.parameter_set_bits)
        self._followers = _followers(family, slot)

    @property
    def codes(self) -> Codes:
        """What has been read."""
        return self._codes

    def on_scale(self, parameter: str, full: float, in_set: int = _FIRST) -> None:
        """The drive's own value of a scaling parameter; it wins over the site file. Of one that is no scale
        no value is made, with neither the site file's nor what was read before."""
        self._found.clear()
        scales = self._scales[in_set]
        self._no_scale.pop((parameter, in_set), None)
        if is_scale(full):
            scales.update(scales_of(self._family, {parameter: full}))
            return
        self._no_scale[parameter, in_set] = full
        for value in self._family.value:
            if value.full == parameter:
                scales.pop(value.leaf, None)

    def on_codes(self, codes: Codes, why_unread: str = "cannot be read") -> bool:
        """What the drive's parameters say that its words carry. True where a setpoint that was written before
        means something else now."""
        before = self._of_commands()
        self._found.clear()
        self._codes = {leaf: tuple(of_sets) for leaf, of_sets in codes.items()}
        self._unread = Lack(Quality.CONFIG_ERROR, why_unread)
        return before not in ({}, self._of_commands())

    def _of_commands(self) -> dict[str, tuple[int | None, ...]]:
        return {leaf: codes for leaf, codes in self._codes.items() if leaf.startswith("command/")}

    def codec(self, codec: ValueCodec, in_set: int) -> tuple[ValueCodec, Lack | None]:
        """The codec as it is in this set, and why it does not serve there."""
        key = codec.model.leaf, in_set
        found = self._found.get(key)
        if found is None:
            found = self._found[key] = self._compiled(codec, in_set)
        return found

    def unknown_followed(self, words: Sequence[int]) -> frozenset[int]:
        """The places of the actual words that no setpoint may follow: in the active parameter set one of the
        two has another meaning, or none that has been read. ``words`` begin with the status word."""
        if not self._followers:
            return frozenset()
        in_set = self._set.of(words[0])
        return frozenset(
            place
            for command, actual in self._followers
            if self.codec(command, in_set)[1] or self.codec(actual, in_set)[1]
            for place in actual.places
        )

    def _compiled(self, codec: ValueCodec, in_set: int) -> tuple[ValueCodec, Lack | None]:
        model = codec.model
        found = codec.scaled(self._scale(model, in_set))
        if model.code:
            places = self._places(model, in_set)
            if isinstance(places, Lack):
                return found.placed(()), places
            found = found.placed(places)
        why = found.why_unknown
        if why and self._depends(model) and in_set > _FIRST:
            why = f"parameter set {in_set} is active, and {model.full} is not known of it"
        number = in_set if self._depends(model) else _FIRST
        if why and model.full and (model.full, number) in self._no_scale:
            why = no_scale(model.full, self._no_scale[model.full, number])
        return found, Lack(Quality.CONFIG_ERROR, why) if why else None

    def _depends(self, model: ProcessValue) -> bool:
        return self._family.depends_on_set(model)

    def _scale(self, model: ProcessValue, in_set: int) -> LinearScale | None:
        number = in_set if self._depends(model) else _FIRST
        return self._scales[number].get(model.leaf)

    def _places(self, model: ProcessValue, in_set: int) -> tuple[int, ...] | Lack:
        """Where this value stands among the words of its group, without the first one for commands."""
        runs = self._family.meanings_of(self._slot, model.group)
        asked = [meaning for run in runs for meaning in run]
        if model.word_names:
            by_word = {meaning.word: meaning for meaning in asked}
            asked = [by_word[word] for word in model.word_names]
            if [self._code(one, in_set) for one in asked] == model.code:
                return tuple(self._place(one) for one in asked)
            runs = []
        for run in runs:
            by_code: dict[int, Meaning] = {}
            for meaning in run:
                code = self._code(meaning, in_set)
                if code is not None:
                    by_code.setdefault(code, meaning)
            if all(code in by_code for code in model.code):
                return tuple(self._place(by_code[code]) for code in model.code)
        unread = [one.parameter for one in asked if self._code(one, in_set) is None]
        which = f"parameter set {in_set}" if len(self.sets) > 1 else ""
        if unread:
            of_set = f" of {which}" if which else ""
            return Lack(self._unread.quality, f"{', '.join(unread)}{of_set} {self._unread.why}")
        found = ", ".join(dict.fromkeys(self._shown(one, in_set) for one in asked))
        in_this = f" in {which}" if which else ""
        otherwise = ", ".join(dict.fromkeys(one.otherwise for one in asked))
        return Lack(Quality.DISABLED, f"{otherwise}{in_this}: {found}")

    def _shown(self, meaning: Meaning, in_set: int) -> str:
        code = self._code(meaning, in_set)
        name, _ = self._family.parameter_and_set(meaning.parameter)
        states = next((one.states for one in self._family.parameter if one.name == name), None)
        state = states.get(code) if states and code is not None else None
        return f"{meaning.parameter} is {code}{f' ({state})' if state else ''}"

    def _code(self, meaning: Meaning, in_set: int) -> int | None:
        of_sets = self._codes.get(meaning.leaf, ())
        return of_sets[in_set - _FIRST] if in_set <= len(of_sets) else None

    def _place(self, meaning: Meaning) -> int:
        process = self._family.process
        if meaning.group == "command":
            return process.rpdo.index(meaning.word) - 1
        return process.tpdo.index(meaning.word)

    def unknown(self) -> list[str]:
        """The words that carry something which the family does not know, in words."""
        known = {(value.group, code) for value in self._family.value for code in value.code}
        told: list[str] = []
        for group in ("command", "actual"):
            for meaning in (one for run in self._family.meanings_of(self._slot, group) for one in run):
                for in_set in self.sets:
                    code = self._code(meaning, in_set)
                    if code and (group, code) not in known:
                        told.append(
                            f"{meaning.parameter} is {code} in set {in_set}, which the mapping does not know"
                        )
        return told


def _followers(family: Family, slot: Slot) -> list[tuple[ValueCodec, ValueCodec]]:
    """The commands that follow actual values, with these, where the drive says what their words mean."""
    values = {value.leaf: value for value in family.values_of(slot)}
    return [
        (ValueCodec(value, family.process.rpdo[1:]), ValueCodec(actual, family.process.tpdo))
        for value in values.values()
        if value.follows and (actual := values.get(f"actual/{value.follows}")) and (value.code or actual.code)
    ]


def default_codes(family: Family) -> Codes:
    """What is taken where there is no drive to ask."""
    return {meaning.leaf: (meaning.default,) * family.sets for meaning in family.meaning}


def codecs(
    family: Family, slot: Slot, group: str, words: Sequence[str], given: Mapping[str, float]
) -> list[ValueCodec]:
    """The commands or the actual values of a drive, scaled by the parameters that are ``given``. Those whose
    place only the drive knows have none."""
    return [
        ValueCodec(value, words, scale_of(value, given.get(value.full or "")))
        for value in family.values_of(slot)
        if value.group == group
    ]


def default_codecs(
    family: Family, slot: Slot, group: str, words: Sequence[str], given: Mapping[str, float]
) -> list[ValueCodec]:
    """Those that have a place without a drive to ask: by the defaults of the mapping file. ``words`` begin
    with the control or the status word."""
    meanings = Meanings(family, slot, given)
    meanings.on_codes(default_codes(family))
    first = 1 if group == "command" else 0
    found: list[ValueCodec] = []
    for codec in codecs(family, slot, group, words, given):
        if not codec.model.code:
            found.append(codec)
            continue
        placed, _ = meanings.codec(codec, _FIRST)
        if placed.places:
            found.append(placed.placed(tuple(place + first for place in placed.places)))
    return found
