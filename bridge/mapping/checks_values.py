"""Checks of the values of a mapping file, with its words, slots and parameters."""

from __future__ import annotations

from typing import Final

from bridge.mapping.checks_process import check_parameter
from bridge.mapping.merge import MergedFile
from bridge.mapping.model import Family, ProcessValue
from bridge.tomlfile import Key

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
            message = f"point {value.leaf!r} is there twice"
            file.fault((*key, "name"), message, f"first in line {file.line(first)}")


def check_meanings(family: Family, file: MergedFile) -> None:
    """Check that each meaning is of a word that exists, and that its parameter has an object."""
    for m, meaning in enumerate(family.meaning):
        key: Key = ("meaning", m)
        # The status word's bits may mean something in one mode of operation only.
        words = family.process.rpdo[1:] if meaning.group == "command" else family.process.tpdo
        if meaning.word not in words:
            hint = f"known: {', '.join(words)}"
            file.fault((*key, "word"), f"there is no value word {meaning.word!r}", hint)
        try:
            family.object_of_meaning(meaning, family.sets)
        except ValueError as error:
            file.fault((*key, "parameter"), str(error))


def _check_words(family: Family, value: ProcessValue, key: Key, file: MergedFile) -> None:
    process = family.process
    if (value.word is not None and value.words) or not (value.word_names or value.code):
        file.fault(key, f"{value.name} needs one of word, words and code")
        return
    if value.code:
        _check_code(family, value, key, file)
        if not value.word_names:
            return
    if len(value.words) == 1 or len(set(value.word_names)) != len(value.word_names):
        file.fault((*key, "words"), "must be two words, the low one first")
    is_command = value.group == "command"
    # The control word goes through the watchdog's gate: nothing else writes it.
    known = process.rpdo[1:] if is_command else process.tpdo
    at = (*key, "word" if value.word is not None else "words")
    missing = [word for word in value.word_names if word not in known]
    for word in missing:
        file.fault(at, f"there is no value word {word!r}", f"known: {', '.join(known)}")
    if missing:
        return
    for slot in family.slot:
        pdos = slot.rpdo if is_command else slot.tpdo
        carried = [set(pdo.words or (process.rpdo if is_command else process.tpdo)) for pdo in pdos]
        names = set(value.word_names)
        if names <= set[str]().union(*carried) and not any(names <= words for words in carried):
            file.fault(at, f"the words of {value.name} are in two PDOs of {slot.name}", "they must be in one")


def _check_code(family: Family, value: ProcessValue, key: Key, file: MergedFile) -> None:
    """Check that meanings tell the codes of the words that a value may be made from."""
    told = [meaning.word for meaning in family.meaning if meaning.group == value.group]
    untold = [word for word in value.word_names if word not in told]
    if untold or not told:
        which = ", ".join(untold) or f"{value.group} words"
        file.fault((*key, "code"), f"no [[meaning]] tells what {which} carry")
    if value.word_names and len(value.code) != len(value.word_names):
        file.fault((*key, "code"), f"has {len(value.code)} for {len(value.word_names)} words")


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
        file.fault(
            (*key, given[1]), f"{value.name} has {given[0]} already", "one of scale, states, bits, bit"
        )
        return
    is_long = value.width == 2
    if value.data_type is not None and value.data_type.endswith("32") is not is_long:
        words = "two words" if is_long else "one word"
        right = "int32, uint32 or real32" if is_long else "int16 or uint16"
        file.fault((*key, "data_type"), f"{value.data_type} does not fit {words}", right)
        return
    if value.is_real and given:
        file.fault((*key, given[0]), "has no meaning for a real32", "leave it out: the number is the value")
        return
    if value.bit is not None and is_long:
        file.fault((*key, "bit"), "is a bit of one word", "name it as word")
    if len(value.bits) > 16 * value.width:
        file.fault((*key, "bits"), f"has {len(value.bits)} names for {16 * value.width} bits")
    if given and given[0] != "scale":
        for name in ("low", "high"):
            if getattr(value, name) is not None:
                file.fault((*key, name), f"has no meaning with {given[0]}")
    low, high = value.raw_range
    for number in value.states:
        if not low <= number <= high:
            file.fault((*key, "states"), f"{number} is no {value.raw_type.value}", f"{low}…{high}")
    if value.low is not None and value.high is not None and value.low > value.high:
        file.fault((*key, "low"), f"is above high, {value.high:g}")


def _check_follows(family: Family, value: ProcessValue, key: Key, file: MergedFile) -> None:
    if value.follows is None:
        return
    if value.group != "command":
        file.fault((*key, "follows"), "is for commands: an actual value follows nothing")
        return
    if value.code and not value.word_names:
        file.fault((*key, "follows"), "needs words: with a code its place is not known before the boot-up")
        return
    actual = {other.name: other for other in family.value if other.group == "actual"}
    followed = actual.get(value.follows)
    if followed is None:
        message = f"there is no actual value {value.follows!r}"
        file.fault((*key, "follows"), message, f"known: {', '.join(sorted(actual))}")
    elif not followed.word_names or (followed.data_type, followed.scale, len(followed.word_names)) != (
        value.data_type,
        value.scale,
        len(value.word_names),
    ):
        file.fault((*key, "follows"), f"{value.follows} has other words or another scale")


def _check_scale(family: Family, value: ProcessValue, key: Key, file: MergedFile) -> None:
    scale = value.scale
    if scale is None:
        return
    at: Key = (*key, "scale")
    if scale.full is None:
        for name in ("at", "limit"):
            if name in scale.model_fields_set:
                file.fault((*at, name), "has no meaning without full")
        if scale.factor == 0:
            file.fault((*at, "factor"), "must not be 0")
        return
    if scale.at is None:
        file.fault((*at, "at"), "is missing", "the word at 100 %")
    for name in ("factor", "offset"):
        if name in scale.model_fields_set:
            file.fault((*at, name), "has no meaning with full", "value = word × full / at")
    _check_number(scale.full, family, (*at, "full"), file)
    if scale.over is not None:
        _check_number(scale.over, family, (*at, "over"), file)


def _check_number(name: str, family: Family, key: Key, file: MergedFile) -> None:
    """Check that ``name`` is a listed parameter that holds a number."""
    if check_parameter(name, family, key, file) and family.parameter_named(name).data_type in _TEXTS:
        file.fault(key, f"{name} is a text")


def _check_conditions(family: Family, value: ProcessValue, key: Key, file: MergedFile) -> None:
    """Check that the parameters that decide whether there is such a value can be read, and that values which
    share a bit say when they are meant."""
    for name in value.when:
        _check_number(name, family, (*key, "when", name), file)
    for place, name in enumerate(value.steady):
        _check_number(name, family, (*key, "steady", place), file)
    for name in [one.name for one in family.parameter if one.name in value.when and not one.read]:
        file.fault((*key, "when", name), f"{name} cannot be read", "name one that the drive tells")
    leaves = {one.leaf: one for one in family.value}
    seen = {value.leaf}
    needed = value.needs
    while needed is not None:
        if needed not in leaves or needed in seen:
            known_leaves = ", ".join(sorted(set(leaves) - {value.leaf}))
            why = "needs itself" if needed in seen else f"there is no value {needed!r}"
            file.fault((*key, "needs"), why, f"known: {known_leaves}")
            return
        seen.add(needed)
        needed = leaves[needed].needs
    if value.otherwise and not value.when:
        file.fault((*key, "otherwise"), "has no meaning without when")
    _check_shared_bit(family, value, key, file)


def _check_shared_bit(family: Family, value: ProcessValue, key: Key, file: MergedFile) -> None:
    """Check that each of two values that share a bit says when it is meant; so does a value of a status word
    bit that depends on the mode of operation, as soon as one value of that word says so."""
    if value.bit is None or value.is_conditional:
        return
    for other in family.value:
        same = (other.group, other.word) == (value.group, value.word)
        if other is not value and same and other.bit == value.bit:
            hint = "say when it is meant: code, when or needs"
            file.fault((*key, "bit"), f"is {other.name}, too, and nothing says when", hint)
            return
    is_of_mode = any(
        (one.group, one.word) == (value.group, value.word) and one.bit is not None and one.code
        for one in family.value
    )
    if is_of_mode and value.bit in _OF_MODE:
        told = ", ".join(sorted({one.parameter for one in family.meaning if one.word == value.word}))
        file.fault((*key, "bit"), f"has its meaning from {told} as others of this word", "give it a code")
