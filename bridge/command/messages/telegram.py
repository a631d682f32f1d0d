"""A write to a drive's command group, decoded: names and values to process words."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

from bridge.command.messages.request import Code
from bridge.command.status import DriveStatus
from bridge.drive import ControlWords, MaskedBits, Meanings, ParameterSet, ValueCodec, codecs
from bridge.image import Value
from bridge.image.limits import ValueNotTaken
from bridge.mapping.model import Family, Slot
from bridge.text import Said, Text, render

_WORD_MASK = 0xFFFF
_WORD_BITS = 16


class Refusal(Exception):
    """Refusal of a request, which changes nothing; ``code`` and ``said`` are its outcome."""

    def __init__(self, code: Code, said: Said) -> None:
        super().__init__(said)
        self.code = code
        self.said: Said = said

    def __str__(self) -> str:
        return render(self.said)


@dataclass(frozen=True, slots=True)
class Telegram:
    """Words of one write, as 16-bit integers; ``control_word`` is None where none was written."""

    control_word: int | None
    setpoints: tuple[int, ...]


class _Bits:
    """Bits that a write changes in one word."""

    def __init__(self) -> None:
        self._mask = 0
        self._bits = 0

    def put(self, leaf: str, bit: str, value: Value) -> None:
        if not bit.isdecimal() or int(bit) >= _WORD_BITS:
            raise Refusal(Code.OUT_OF_RANGE, Text.of("telegram.no_bit", leaf=leaf, bits=_WORD_BITS))
        if value not in (0, 1):
            said = Text.of("value.of", name=leaf, said=Text.of("takes.bool", value=repr(value)))
            raise Refusal(Code.OUT_OF_RANGE, said)
        self._mask |= 1 << int(bit)
        self._bits |= int(value) << int(bit)

    def over(self, word: int) -> int:
        return word & ~self._mask | self._bits


class _Setpoints:
    """Bits that a write has set so far, and their masks, by the word's place."""

    def __init__(self) -> None:
        self._masks: dict[int, int] = {}
        self._bits: dict[int, int] = {}

    def put(self, leaf: str, written: tuple[MaskedBits, ...]) -> None:
        """Set all of ``written``, or nothing where bits contradict: then it raises ``Refusal``."""
        for one in written:
            mask, bits = self._masks.get(one.place, 0), self._bits.get(one.place, 0)
            if (bits ^ one.bits) & mask & one.mask:
                raise Refusal(Code.OUT_OF_RANGE, Text.of("telegram.contradiction", leaf=leaf))
        for one in written:
            self._masks[one.place] = self._masks.get(one.place, 0) | one.mask
            self._bits[one.place] = self._bits.get(one.place, 0) | one.bits

    @property
    def places(self) -> frozenset[int]:
        """Places of the words that have been written."""
        return frozenset(self._masks)

    def over(self, before: tuple[int, ...]) -> tuple[int, ...]:
        """Words ``before`` with those bits set."""
        after = list(before)
        for place, mask in self._masks.items():
            after[place] = after[place] & ~mask | self._bits[place]
        return tuple(after)


class TelegramDecoder:
    """Decoder of one drive's command group. ``meanings`` and ``unserved``, which has the reason for each word
    or value that the node cannot take, are read at each write: they fill at boot-up. So is the drive's
    ``status``."""

    def __init__(
        self,
        name: str,
        family: Family,
        slot: Slot,
        meanings: Meanings,
        unserved: Mapping[str, Text],
        status: DriveStatus,
    ) -> None:
        self._name = name
        self._meanings = meanings
        self._unserved = unserved
        self._status = status
        self._words = ControlWords(family.control_word)
        self._names = words = family.process.rpdo[1:]
        carried = family.carried(slot)[0]
        self._setpoints = {word: place for place, word in enumerate(words) if word in carried}
        self._values = {codec.model.name: codec for codec in codecs(family, slot, "command", words, {})}
        self._set = ParameterSet(family.control_word.parameter_set_bits)
        described = {meaning.word for meaning in family.meaning if meaning.group == "command"}
        described |= {
            word
            for codec in self._values.values()
            if family.depends_on_set(codec.model)
            for word in codec.model.word_names
        }
        self._of_set = [place for place, word in enumerate(words) if word in described]
        """The places of words whose meaning or scale depends on the parameter set."""
        self._reported_set = ParameterSet(family.status_word.parameter_set_bits)

    def decode(
        self, values: Mapping[str, Value], before: tuple[int, ...], held: int, is_heard: bool
    ) -> Telegram:
        """The words to be sent; setpoints that are not written stay as ``before``. ``held`` is the control
        word that counts where none is written. A name with a number behind a dot is one bit: of the control
        word, of a setpoint word or of a value, all else of which stays. ``is_heard``: the drive's status is
        of now. Raises ``Refusal``."""
        values, bits = _apart(values)
        control_word = _as_word("control_word", values["control_word"]) if "control_word" in values else None
        if "control_word" in bits:
            control_word = bits.pop("control_word").over(held if control_word is None else control_word)
        word = held if control_word is None else control_word
        in_set, was = self._set.of(word), self._set.of(held)
        values |= {leaf: one.over(self._held(leaf, values, before, in_set)) for leaf, one in bits.items()}
        stops = control_word is not None and not self._words.enables(word)
        setpoints = _Setpoints()
        # The raw words first: where a scaled value contradicts one, it is the scaled one that is wrong.
        for leaf, value in sorted(values.items(), key=lambda item: item[0] in self._values):
            if leaf == "control_word":
                continue
            try:
                written = self._written(leaf, value, in_set)
                if in_set == was and is_heard:
                    written = self._as_reported(leaf, value, word, written)
                setpoints.put(leaf, written)
            except Refusal:
                if not (stops and self._goes_by_the_drive(leaf, value)):
                    raise
        after = setpoints.over(before)
        if in_set != was:
            after = self._in_other_set(before, after, setpoints.places, was, word)
        return Telegram(control_word, after)

    def _held(self, leaf: str, values: Mapping[str, Value], before: tuple[int, ...], in_set: int) -> int:
        """The word or value that bits are changed in."""
        if leaf in values:
            return _as_word(leaf, values[leaf])
        place, codec = self._setpoints.get(leaf), self._values.get(leaf)
        if place is not None:
            return before[place]
        if codec is None or not codec.model.bits:
            said = Text.of("telegram.no_bit", leaf=leaf, bits=0)
            raise Refusal(Code.OUT_OF_RANGE, said)
        return int(self._meanings.codec(codec, in_set)[0].from_words(before))

    def _written(self, leaf: str, value: Value, in_set: int) -> tuple[MaskedBits, ...]:
        place, codec = self._setpoints.get(leaf), self._values.get(leaf)
        if place is not None:
            self._check_carried(leaf, (place,))
            return (MaskedBits(place, _WORD_MASK, _as_word(leaf, value)),)
        if codec is None:
            known = ", ".join(["control_word", *self._setpoints, *self._values])
            said = Text.of("telegram.no_command", drive=self._name, leaf=leaf, known=known)
            raise Refusal(Code.UNKNOWN_POINT, said)
        found, lack = self._meanings.codec(codec, in_set)
        self._check_carried(leaf, found.places)
        if lack:
            raise _not_configured(leaf, lack.why)
        return _from_value(found, value)

    def _goes_by_the_drive(self, leaf: str, value: Value) -> bool:
        """Whether parameters of the drive say what the value means, which somebody may change while it runs.
        A word that does not enable is not refused for what was right until then: it may be a stop."""
        codec = self._values.get(leaf)
        is_number = isinstance(value, int | float)
        return is_number and codec is not None and bool(codec.model.code or codec.model.full)

    def _check_carried(self, leaf: str, places: tuple[int, ...]) -> None:
        for name in (leaf, *(self._names[place] for place in places)):
            why = self._unserved.get(f"command/{name}")
            if why:
                raise _not_configured(leaf, why)

    def _as_reported(
        self, leaf: str, value: Value, word: int, written: tuple[MaskedBits, ...]
    ) -> tuple[MaskedBits, ...]:
        """Bits of a scaled value as the parameter set has it that the control word asks for. A drive in
        another set would take the same words for something else: a word that enables is refused, and with any
        other, which may be a stop, it gets zero. Raises ``Refusal``."""
        in_set, reported = self._set.of(word), self._reported_set.of(self._status.word)
        if reported == in_set:
            return written
        try:
            same = self._written(leaf, value, reported) == written
        except Refusal:
            same = False
        if same:
            return written
        if self._words.enables(word):
            said = Text.of("telegram.other_set", leaf=leaf, in_set=in_set, reported=reported)
            raise Refusal(Code.NOT_READY, said)
        return tuple(replace(one, bits=0) for one in written)

    def _in_other_set(
        self, before: tuple[int, ...], after: tuple[int, ...], written: frozenset[int], was: int, word: int
    ) -> tuple[int, ...]:
        """Setpoints under a control word that changes the parameter set: what is not written keeps its value
        in its unit. Where that is not known, a drive that is to run is not switched, and one that is not gets
        zero. Raises ``Refusal``."""
        in_set = self._set.of(word)
        kept = list(after)
        left = {place for place in self._of_set if before[place] and place not in written}
        taken = set(written)
        for place in left:
            kept[place] = 0
        for codec in self._values.values():
            old, lack = self._meanings.codec(codec, was)
            if lack or not left.intersection(old.places):
                continue
            new, lack = self._meanings.codec(codec, in_set)
            if lack or taken.intersection(new.places):
                continue
            try:
                parts = new.to_words(old.from_words(before))
            except ValueError:
                continue
            for part in parts:
                kept[part.place] = kept[part.place] & ~part.mask | part.bits
            taken.update(new.places)
            left.difference_update(old.places)
        if left and self._words.enables(word):
            names = ", ".join(self._names[place] for place in sorted(left))
            said = Text.of("telegram.set_not_known", names=names, in_set=in_set)
            raise Refusal(Code.NOT_CONFIGURED, said)
        return tuple(kept)


def _apart(values: Mapping[str, Value]) -> tuple[dict[str, Value], dict[str, _Bits]]:
    """Whole values, and the bits beside them by what they are bits of."""
    whole: dict[str, Value] = {}
    bits: dict[str, _Bits] = {}
    for leaf, value in values.items():
        name, _, bit = leaf.partition(".")
        if bit:
            bits.setdefault(name, _Bits()).put(leaf, bit, value)
        else:
            whole[leaf] = value
    return whole, bits


def _not_configured(leaf: str, why: Said) -> Refusal:
    said = Text.of("telegram.not_configured", leaf=leaf, why=why)
    return Refusal(Code.NOT_CONFIGURED, said)


def _from_value(codec: ValueCodec, value: Value) -> tuple[MaskedBits, ...]:
    model = codec.model
    is_bit = model.bit is not None and isinstance(value, bool)
    try:
        return codec.to_words(int(value) if is_bit else _as_number(model.name, value))
    except ValueNotTaken as error:
        raise not_taken(model.name, error, model.unit) from None


def not_taken(leaf: str, error: ValueNotTaken, unit: str) -> Refusal:
    """Refusal of a value that ``leaf``, which is in ``unit``, does not take."""
    if unit:
        return Refusal(Code.OUT_OF_RANGE, Text.of("value.of_unit", name=leaf, said=error.said, unit=unit))
    return Refusal(Code.OUT_OF_RANGE, Text.of("value.of", name=leaf, said=error.said))


def _as_number(leaf: str, value: object) -> float:
    """``value`` as a number; callers on the network may send anything."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise Refusal(Code.OUT_OF_RANGE, Text.of("telegram.number", leaf=leaf))
    try:
        return float(value)
    except OverflowError:  # an integer of more than 308 digits
        return math.inf


def _as_word(leaf: str, value: object) -> int:
    """``value`` as a 16-bit word. Negative numbers are refused: -1 would be sent as FFFFh, which acknowledges
    and enables. Signed numbers belong to the scaled values."""
    number = _as_number(leaf, value)
    if not 0 <= number <= _WORD_MASK:
        raise Refusal(Code.OUT_OF_RANGE, Text.of("telegram.word_range", leaf=leaf, number=number))
    if not number.is_integer():
        raise Refusal(Code.OUT_OF_RANGE, Text.of("telegram.whole_number", leaf=leaf, number=number))
    return int(number)
