"""Meanings of one drive's words in each of its parameter sets: the place and the scale of each value. A
meaning counts only where it has been read from the drive."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

from bridge.drive.conditions import Conditions, Key, Lack, otherwise_in, unread_in
from bridge.drive.parameter_set import ParameterSet
from bridge.drive.scaling import LinearScale, is_scale, no_scale, scale_of
from bridge.drive.values import ValueCodec, scales_of
from bridge.image import Quality
from bridge.mapping.model import Family, Meaning, Parameter, ProcessValue, Slot
from bridge.text import Said, Text

Codes = Mapping[str, Sequence[int | None]]
"""Codes in each parameter set, by the word's leaf such as ``actual/value_1``; None: one cannot be read."""

_FIRST: Final = 1


_UNREADABLE: Final = Text.of("meaning.cannot_be_read")


class Meanings:
    """Meanings of one drive's words. Before the boot-up none is known, and values that need one wait."""

    def __init__(self, family: Family, slot: Slot, given: Mapping[str, float]) -> None:
        """Meanings with the scaling parameters that are ``given`` in the site file: those of set 1, where no
        name tells another (``P112.2``)."""
        self._family = family
        self._slot = slot
        self.sets = range(_FIRST, family.sets + 1)
        self.conditions = Conditions(family)
        self._known: dict[int, dict[str, float]] = {number: {} for number in self.sets}
        """Scaling parameters, as far as they are known, in each set."""
        self._given = {family.parameter_and_set(name): full for name, full in given.items()}
        for (parameter, in_set), full in self._given.items():
            if in_set in self.sets:
                self._known[in_set][parameter] = full
        self._scales = {number: scales_of(family, known) for number, known in self._known.items()}
        self.scales = self._scales[_FIRST]
        """Scales in set 1, by the value's leaf."""
        self._no_scale: dict[Key, float] = {}
        """Values that the drive has for scaling parameters, and that are no scale."""
        self._codes: dict[str, tuple[int | None, ...]] = {}
        self._unread = Lack(Quality.WAITING, Text.of("meaning.not_read_yet"))
        self._found: dict[tuple[str, int], tuple[ValueCodec, Lack | None]] = {}
        self._overdue: frozenset[Key] = frozenset()
        self.told_by_drive: set[Key] = set()
        """Keys of what the drive has given a value for since it was booted: it has these objects."""
        self._set = ParameterSet(family.status_word.parameter_set_bits)
        self._followers = _followers(family, slot)
        self._values = {value.leaf: ValueCodec(value, _words(family, value)) for value in family.value}

    @property
    def codes(self) -> Codes:
        """Codes that have been read."""
        return self._codes

    def on_scale(self, parameter: str, full: float, in_set: int = _FIRST) -> None:
        """Take over the drive's own value of a scaling parameter; it wins over the site file. Where it is no
        scale, no value is made: neither with the site file's nor with the one read before."""
        self._no_scale.pop((parameter, in_set), None)
        if not is_scale(full):
            self._no_scale[parameter, in_set] = full
        self._scale_by(parameter, full if is_scale(full) else None, in_set)

    def _on_refused_scale(self, parameter: str, in_set: int) -> None:
        """Take over that the drive does not tell a scaling parameter: the site file's counts, and not the one
        that it has told before."""
        self._no_scale.pop((parameter, in_set), None)
        self._scale_by(parameter, self._given.get((parameter, in_set)), in_set)

    def _scale_by(self, parameter: str, full: float | None, in_set: int) -> None:
        self._found.clear()
        scales, known = self._scales[in_set], self._known[in_set]
        if full is None:
            known.pop(parameter, None)
        else:
            known[parameter] = full
        for value in self._family.value:
            if parameter in value.scaled_by:
                scale = _scale(value, known)
                if scale is None:
                    scales.pop(value.leaf, None)
                else:
                    scales[value.leaf] = scale

    def has_told(self, name: str, setting: float | None, in_set: int = _FIRST) -> bool:
        """Whether the drive has told this setting already, of a parameter that decides what values mean."""
        key = self.conditions.key(name, in_set)
        # As texts: what is no number is no other one each time.
        is_same = repr(self.conditions.told(key)) == repr(self._setting(name, setting))
        return is_same and self.conditions.has_been_asked(key)

    def on_parameter(self, name: str, setting: float | None, in_set: int = _FIRST) -> None:
        """Take over the setting of such a parameter, None where the drive refuses to tell it."""
        self._found.clear()
        value = self._setting(name, setting)
        self.conditions.tell(self.conditions.key(name, in_set), value)
        scales = any(name in one.scaled_by for one in self._family.value)
        if not scales or not self._family.parameter_named(name).read:
            return
        if value is None:
            self._on_refused_scale(name, in_set)
        else:
            self.on_scale(name, value, in_set)

    def _setting(self, name: str, told: float | None) -> float | None:
        """Setting that counts where the drive tells this one."""
        return self._family.parameter_named(name).absent if told is None else round(float(told), 9)

    def on_codes(self, codes: Codes, why_unread: Text = _UNREADABLE) -> bool:
        """Take over the codes of what words carry. Returns True where a setpoint that was written before
        means something else now."""
        before = self._of_commands()
        self._found.clear()
        self._codes = {leaf: tuple(of_sets) for leaf, of_sets in codes.items()}
        self._unread = Lack(Quality.CONFIG_ERROR, why_unread)
        return before not in ({}, self._of_commands())

    def take_defaults(self) -> None:
        """Take defaults where there is no drive to ask."""
        self.on_codes(default_codes(self._family))
        self.conditions.take_defaults()

    def on_overdue(self, overdue: frozenset[Key]) -> bool:
        """Take over the keys of what has not been read again in time. Returns True where that is news."""
        is_news = overdue != self._overdue
        self._overdue = overdue
        return is_news

    def doubt(self, model: ProcessValue, in_set: int) -> Said:
        """Reason why this value may no longer mean what it meant; empty where it does."""
        if not self._overdue:
            return ""
        late = [key[0] for key in self._deciding(model, in_set) if key in self._overdue]
        return Text.of("meaning.overdue", parameter=late[0]) if late else ""

    def _deciding(self, model: ProcessValue, in_set: int) -> list[Key]:
        """Keys of the settings that decide the meaning of a value in this set."""
        conditions = self.conditions
        runs = self._family.meanings_of(self._slot, model.group) if model.code else []
        keys: list[Key] = [(one.leaf, in_set) for run in runs for one in run]
        named = (*model.scaled_by, *model.when, *self._family.steady_of(model))
        keys += [conditions.key(name, in_set) for name in named]
        needed = self._values.get(model.needs or "")
        return keys + (self._deciding(needed.model, in_set) if needed else [])

    def _of_commands(self) -> dict[str, tuple[int | None, ...]]:
        return {leaf: codes for leaf, codes in self._codes.items() if leaf.startswith("command/")}

    def codec(self, codec: ValueCodec, in_set: int) -> tuple[ValueCodec, Lack | None]:
        """Codec of this set, and its lack there, None where it serves."""
        key = codec.model.leaf, in_set
        found = self._found.get(key)
        if found is None:
            found = self._found[key] = self._compiled(codec, in_set)
        return found

    def unknown_followed(self, words: Sequence[int]) -> frozenset[int]:
        """Places of the actual words that no setpoint may follow: in the active parameter set one of the two
        has another meaning, or none that has been read. ``words`` begin with the status word."""
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
        number = in_set if self._family.depends_on_set(model) else _FIRST
        found = codec.scaled(self._scales[number].get(model.leaf))
        if model.code:
            places = self._places(model, in_set)
            if isinstance(places, Lack):
                return found.placed(()), places
            found = found.placed(places)
        lack = self.conditions.lack(model, in_set, self._unread)
        needed = None if lack or model.needs is None else self._values.get(model.needs)
        if needed is not None:
            lack = self.codec(needed, in_set)[1]
        return found, lack or self._lack_of_scale(found, number)

    def _lack_of_scale(self, codec: ValueCodec, number: int) -> Lack | None:
        """Lack of a known scale; ``number`` is the set in which the scaling parameters are looked up."""
        why = codec.why_unknown
        if why and number > _FIRST:
            name = str(codec.model.full)
            why = Text.of("meaning.scale_not_of_set", in_set=number, parameter=name)
        for name in codec.model.scaled_by if why else ():
            if (name, number) in self._no_scale:
                why = no_scale(name, self._no_scale[name, number])
        return Lack(Quality.CONFIG_ERROR, why) if why else None

    def _places(self, model: ProcessValue, in_set: int) -> tuple[int, ...] | Lack:
        """Places of this value's words in its group, without the first one for commands; or its lack."""
        runs = self._family.meanings_of(self._slot, model.group)
        asked = [meaning for run in runs for meaning in run]
        twice = self._named_twice(model, asked, in_set) if model.group == "command" else None
        if twice is not None:
            return Lack(Quality.DISABLED, twice)
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
        which = in_set if len(self.sets) > 1 else None
        if unread:
            return Lack(self._unread.quality, unread_in(tuple(unread), which, self._unread.why))
        found = tuple(dict.fromkeys(self._shown(one, in_set) for one in asked))
        otherwise = tuple(dict.fromkeys(one.said_otherwise for one in asked))
        return Lack(Quality.DISABLED, otherwise_in(otherwise, which, found))

    def _named_twice(self, model: ProcessValue, asked: Sequence[Meaning], in_set: int) -> Text | None:
        """Text about words that parameters of their own make the same setpoint: the drive adds them, and one
        of them alone says nothing."""
        for code in model.code:
            named = {one.parameter: one for one in asked if self._code(one, in_set) == code}
            if len(named) > 1:
                shown = tuple(self._shown(one, in_set) for one in named.values())
                return Text.of("meaning.twice", settings=shown)
        return None

    def _shown(self, meaning: Meaning, in_set: int) -> Text:
        code = self._code(meaning, in_set)
        name, _ = self._family.parameter_and_set(meaning.parameter)
        parameter = next((one for one in self._family.parameter if one.name == name), None)
        state = parameter.said_state(code) if parameter and code is not None else ""
        shown = code or 0
        if state:
            return Text.of("meaning.code_state", parameter=meaning.parameter, code=shown, state=state)
        return Text.of("meaning.code", parameter=meaning.parameter, code=shown)

    def _code(self, meaning: Meaning, in_set: int) -> int | None:
        of_sets = self._codes.get(meaning.leaf, ())
        return of_sets[in_set - _FIRST] if in_set <= len(of_sets) else None

    def _place(self, meaning: Meaning) -> int:
        process = self._family.process
        if meaning.group == "command":
            return process.rpdo.index(meaning.word) - 1
        return process.tpdo.index(meaning.word)

    def unknown(self) -> list[Text]:
        """Texts about words that carry something which the family does not know."""
        known = {(value.group, code) for value in self._family.value for code in value.code}
        told: list[Text] = []
        for group in ("command", "actual"):
            for meaning in (one for run in self._family.meanings_of(self._slot, group) for one in run):
                for in_set in self.sets:
                    code = self._code(meaning, in_set)
                    if code and (group, code) not in known:
                        name = meaning.parameter
                        told.append(Text.of("meaning.unknown_code", parameter=name, code=code, in_set=in_set))
        return told


def _followers(family: Family, slot: Slot) -> list[tuple[ValueCodec, ValueCodec]]:
    """Commands that follow actual values, each with its value, where the drive says what their words mean."""
    values = {value.leaf: value for value in family.values_of(slot)}
    return [
        (ValueCodec(value, family.process.rpdo[1:]), ValueCodec(actual, family.process.tpdo))
        for value in values.values()
        if value.follows and (actual := values.get(f"actual/{value.follows}")) and (value.code or actual.code)
    ]


def _words(family: Family, value: ProcessValue) -> Sequence[str]:
    """Names of the words among which places of this value count."""
    return family.process.rpdo[1:] if value.group == "command" else family.process.tpdo


def _scale(value: ProcessValue, known: Mapping[str, float]) -> LinearScale | None:
    """Scale of a value with these values of its parameters."""
    over = None if value.scale is None else value.scale.over
    return scale_of(value, known.get(value.full or ""), known.get(over) if over else 1.0)


def _absent(family: Family) -> dict[str, float]:
    """Settings that count where a drive has no such parameter."""
    return {one.name: one.absent for one in family.parameter if one.absent is not None}


def deciding(family: Family, slot: Slot, codes: Codes) -> list[Parameter]:
    """Parameters that decide the meaning of the values in the words of a drive with these codes, in one of
    its parameter sets."""
    groups = {
        group: [run for run in family.meanings_of(slot, group) if run] for group in ("command", "actual")
    }

    def is_there(value: ProcessValue) -> bool:
        return not value.code or any(
            set(value.code) <= {codes.get(one.leaf, (None,) * family.sets)[in_set] for one in run}
            for run in groups[value.group]
            for in_set in range(family.sets)
        )

    named = {
        name
        for value in family.values_of(slot)
        if is_there(value)
        for name in (*value.scaled_by, *value.when, *family.steady_of(value))
    }
    return [one for one in family.parameter if one.name in named]


def default_codes(family: Family) -> Codes:
    """Codes that are taken where there is no drive to ask."""
    return {meaning.leaf: (meaning.default,) * family.sets for meaning in family.meaning}


def codecs(
    family: Family, slot: Slot, group: str, words: Sequence[str], given: Mapping[str, float]
) -> list[ValueCodec]:
    """Codecs of the commands or the actual values of a drive, scaled by the parameters that are ``given``.
    Those whose place only the drive knows have none."""
    return [
        ValueCodec(value, words, _scale(value, given))
        for value in family.values_of(slot)
        if value.group == group
    ]


def default_codecs(
    family: Family, slot: Slot, group: str, words: Sequence[str], given: Mapping[str, float]
) -> list[ValueCodec]:
    """Codecs that have a place without a drive to ask: by the defaults of the mapping file. ``words`` begin
    with the control or the status word."""
    given = {**_absent(family), **given}
    meanings = Meanings(family, slot, given)
    meanings.take_defaults()
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
