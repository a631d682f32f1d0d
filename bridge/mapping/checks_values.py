"""Checks of the values of a mapping file, with its words, slots and parameters."""

from __future__ import annotations

from typing import Final

from bridge.mapping.checks_process import check_parameter
from bridge.mapping.merge import MergedFile
from bridge.mapping.model import Family, ProcessValue
from bridge.text import Text
from bridge.tomlfile import Key, Unfit

_TEXTS: Final = ("string", "bytes")
_OF_MODE: Final = (10, 12, 13)
"""Bits of a status word whose meaning depends on the mode of operation (CiA 402, 6041h)."""


def check_values(family: Family, file: MergedFile) -> None:
    """Note in ``file`` all entries that do not go together."""
    process = family.process
    seen: dict[str, Key] = {
        **{f"command/{word}": ("process", "rpdo") for word in reversed(process.rpdo)},
        **{f"actual/{word}": ("process", "tpdo") for word in reversed(process.tpdo[1:])},
    }
    for v, value in enumerate(family.value):
        key: Key = ("value", v)
        _check_words(family, value, key, file)
        _check_kind(value, key, file)
        _check_scale(family, value, key, file)
        _check_follows(family, value, key, file)
        _check_conditions(family, value, key, file)
        first = seen.setdefault(value.leaf, (*key, "name"))
        if first != (*key, "name"):
            said = Text.of("mapping.twice", noun=Text.of("mapping.noun_point"), name=value.leaf)
            file.fault((*key, "name"), said, Text.of("mapping.first_in_line", line=file.line(first)))


def check_meanings(family: Family, file: MergedFile) -> None:
    """Check that each meaning is of a word that exists, and that its parameter has an object."""
    for m, meaning in enumerate(family.meaning):
        key: Key = ("meaning", m)
        # The status word's bits may mean something in one mode of operation only.
        words = family.process.rpdo[1:] if meaning.group == "command" else family.process.tpdo
        if meaning.word not in words:
            said = Text.of("mapping.no_value_word", word=meaning.word)
            file.fault((*key, "word"), said, Text.of("mapping.known", names=tuple(words)))
        try:
            family.object_of_meaning(meaning, family.sets)
        except Unfit as error:
            file.fault((*key, "parameter"), error.said)


def _check_words(family: Family, value: ProcessValue, key: Key, file: MergedFile) -> None:
    process = family.process
    if (value.word is not None and value.words) or not (value.word_names or value.code):
        file.fault(key, Text.of("mapping.words_needed", value=value.name))
        return
    if value.code:
        _check_code(family, value, key, file)
        if not value.word_names:
            return
    if len(value.words) == 1 or len(set(value.word_names)) != len(value.word_names):
        file.fault((*key, "words"), Text.of("mapping.two_words"))
    is_command = value.group == "command"
    # The control word goes through the watchdog's gate: nothing else writes it.
    known = process.rpdo[1:] if is_command else process.tpdo
    at = (*key, "word" if value.word is not None else "words")
    missing = [word for word in value.word_names if word not in known]
    for word in missing:
        hint = Text.of("mapping.known", names=tuple(known))
        file.fault(at, Text.of("mapping.no_value_word", word=word), hint)
    if missing:
        return
    for slot in family.slot:
        pdos = slot.rpdo if is_command else slot.tpdo
        carried = [set(pdo.words or (process.rpdo if is_command else process.tpdo)) for pdo in pdos]
        names = set(value.word_names)
        if names <= set[str]().union(*carried) and not any(names <= words for words in carried):
            said = Text.of("mapping.in_two_pdos", value=value.name, slot=slot.name)
            file.fault(at, said, Text.of("mapping.in_two_pdos_advice"))


def _check_code(family: Family, value: ProcessValue, key: Key, file: MergedFile) -> None:
    """Check that meanings tell the codes of the words that a value may be made from."""
    told = [meaning.word for meaning in family.meaning if meaning.group == value.group]
    untold = [word for word in value.word_names if word not in told]
    if untold:
        file.fault((*key, "code"), Text.of("mapping.no_meaning", words=tuple(untold)))
    elif not told:
        file.fault((*key, "code"), Text.of("mapping.no_meaning_of_group", group=value.group))
    if value.word_names and len(value.code) != len(value.word_names):
        said = Text.of("mapping.codes_unequal", count=len(value.code), words=len(value.word_names))
        file.fault((*key, "code"), said)


def _check_kind(value: ProcessValue, key: Key, file: MergedFile) -> None:
    """Check that a value has one meaning, and a type that goes with it."""
    kinds = {
        "scale": value.scale is not None,
        "states": bool(value.states),
        "bits": bool(value.bits),
        "bit": value.bit is not None,
    }
    given = [name for name, is_given in kinds.items() if is_given]
    if len(given) > 1:
        said = Text.of("mapping.two_kinds", value=value.name, kind=given[0])
        file.fault((*key, given[1]), said, Text.of("mapping.two_kinds_advice"))
        return
    is_long = value.width == 2
    kind = value.data_type
    if kind is not None and kind.endswith("32") is not is_long:
        said = Text.of("mapping.type_of_one_word" if is_long else "mapping.type_of_two_words", type=kind)
        right = Text.of("mapping.types_of_two_words" if is_long else "mapping.types_of_one_word")
        file.fault((*key, "data_type"), said, right)
        return
    if value.is_real and given:
        file.fault((*key, given[0]), Text.of("mapping.real_alone"), Text.of("mapping.real_alone_advice"))
        return
    if value.bit is not None and is_long:
        file.fault(
            (*key, "bit"), Text.of("mapping.bit_of_one_word"), Text.of("mapping.bit_of_one_word_advice")
        )
    if len(value.bits) > 16 * value.width:
        said = Text.of("mapping.more_names_than_bits", count=len(value.bits), bits=16 * value.width)
        file.fault((*key, "bits"), said)
    if given and given[0] != "scale":
        for name in ("low", "high"):
            if getattr(value, name) is not None:
                file.fault((*key, name), Text.of("mapping.no_meaning_with", other=given[0]))
    low, high = value.raw_range
    for number in value.states:
        if not low <= number <= high:
            said = Text.of("mapping.not_of_type", number=number, type=value.raw_type.value)
            file.fault((*key, "states"), said, Text.of("range.between", low=str(low), high=str(high)))
    if value.low is not None and value.high is not None and value.low > value.high:
        file.fault((*key, "low"), Text.of("mapping.above_high", high=value.high))


def _check_follows(family: Family, value: ProcessValue, key: Key, file: MergedFile) -> None:
    if value.follows is None:
        return
    if value.group != "command":
        file.fault((*key, "follows"), Text.of("mapping.actual_follows"))
        return
    if value.code and not value.word_names:
        file.fault((*key, "follows"), Text.of("mapping.follows_without_words"))
        return
    actual = {other.name: other for other in family.value if other.group == "actual"}
    followed = actual.get(value.follows)
    if followed is None:
        said = Text.of("mapping.no_actual_value", name=value.follows)
        file.fault((*key, "follows"), said, Text.of("mapping.known", names=tuple(sorted(actual))))
    elif not followed.word_names or (followed.data_type, followed.scale, len(followed.word_names)) != (
        value.data_type,
        value.scale,
        len(value.word_names),
    ):
        file.fault((*key, "follows"), Text.of("mapping.follows_another", value=value.follows))


def _check_scale(family: Family, value: ProcessValue, key: Key, file: MergedFile) -> None:
    scale = value.scale
    if scale is None:
        return
    at: Key = (*key, "scale")
    if scale.full is None:
        for name in ("at", "limit"):
            if name in scale.model_fields_set:
                file.fault((*at, name), Text.of("mapping.no_meaning_without", setting="full"))
        if scale.factor == 0:
            file.fault((*at, "factor"), Text.of("mapping.zero"))
        return
    if scale.at is None:
        file.fault((*at, "at"), Text.of("toml.missing"), Text.of("mapping.at_missing_advice"))
    for name in ("factor", "offset"):
        if name in scale.model_fields_set:
            said = Text.of("mapping.no_meaning_with", other="full")
            file.fault((*at, name), said, Text.of("mapping.scale_by_full"))
    _check_number(scale.full, family, (*at, "full"), file)
    if scale.over is not None:
        _check_number(scale.over, family, (*at, "over"), file)


def _check_number(name: str, family: Family, key: Key, file: MergedFile) -> None:
    """Check that ``name`` is a listed parameter that holds a number."""
    if check_parameter(name, family, key, file) and family.parameter_named(name).data_type in _TEXTS:
        file.fault(key, Text.of("mapping.is_text", parameter=name))


def _check_conditions(family: Family, value: ProcessValue, key: Key, file: MergedFile) -> None:
    """Check that the parameters that decide whether there is such a value can be read, and that values which
    share a bit say when they are meant."""
    for name in value.when:
        _check_number(name, family, (*key, "when", name), file)
    for place, name in enumerate(value.steady):
        _check_number(name, family, (*key, "steady", place), file)
    for name in [one.name for one in family.parameter if one.name in value.when and not one.read]:
        said = Text.of("mapping.unreadable", parameter=name)
        file.fault((*key, "when", name), said, Text.of("mapping.unreadable_advice"))
    leaves = {one.leaf: one for one in family.value}
    seen = {value.leaf}
    needed = value.needs
    while needed is not None:
        if needed not in leaves or needed in seen:
            is_circle = needed in seen
            said = Text.of("mapping.needs_itself") if is_circle else Text.of("mapping.no_value", name=needed)
            others = tuple(sorted(set(leaves) - {value.leaf}))
            file.fault((*key, "needs"), said, Text.of("mapping.known", names=others))
            return
        seen.add(needed)
        needed = leaves[needed].needs
    if value.otherwise and not value.when:
        file.fault((*key, "otherwise"), Text.of("mapping.no_meaning_without", setting="when"))
    _check_shared_bit(family, value, key, file)


def _check_shared_bit(family: Family, value: ProcessValue, key: Key, file: MergedFile) -> None:
    """Check that each of two values that share a bit says when it is meant; so does a value of a status word
    bit that depends on the mode of operation, as soon as one value of that word says so."""
    if value.bit is None or value.is_conditional:
        return
    for other in family.value:
        same = (other.group, other.word) == (value.group, value.word)
        if other is not value and same and other.bit == value.bit:
            said = Text.of("mapping.bit_shared", other=other.name)
            file.fault((*key, "bit"), said, Text.of("mapping.bit_shared_advice"))
            return
    is_of_mode = any(
        (one.group, one.word) == (value.group, value.word) and one.bit is not None and one.code
        for one in family.value
    )
    if is_of_mode and value.bit in _OF_MODE:
        told = tuple(sorted({one.parameter for one in family.meaning if one.word == value.word}))
        said = Text.of("mapping.bit_of_mode", parameters=told)
        file.fault((*key, "bit"), said, Text.of("mapping.bit_of_mode_advice"))
