"""A write to a drive's command group, decoded: names and values to process words."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from bridge.command.request import Code
from bridge.drive import LinearScale, ParameterSet, ValueCodec, Written, codecs
from bridge.image import Value
from bridge.mapping.model import Family, Slot

_WORD_MASK = 0xFFFF


class Refusal(Exception):
    """A request is not carried out and changes nothing; ``code`` and ``message`` are its outcome."""

    def __init__(self, code: Code, message: str) -> None:
        super().__init__(message)
        self.code = code
        self.message = message


@dataclass(frozen=True, slots=True)
class Telegram:
    """``control_word`` is None where none was written. Words are 16-bit integers."""

    control_word: int | None
    setpoints: tuple[int, ...]


class _Setpoints:
    """What a write has set so far, by the word's place: which bits, and to what."""

    def __init__(self) -> None:
        self._masks: dict[int, int] = {}
        self._bits: dict[int, int] = {}

    def put(self, leaf: str, written: Written) -> None:
        """Raises ``Refusal`` where the same bits have been written otherwise."""
        mask, bits = self._masks.get(written.place, 0), self._bits.get(written.place, 0)
        if (bits ^ written.bits) & mask & written.mask:
            raise Refusal(Code.OUT_OF_RANGE, f"{leaf} and the word it is made from do not agree")
        self._masks[written.place] = mask | written.mask
        self._bits[written.place] = bits | written.bits

    def over(self, before: tuple[int, ...]) -> tuple[int, ...]:
        """``before`` with what was written."""
        after = list(before)
        for place, mask in self._masks.items():
            after[place] = after[place] & ~mask | self._bits[place]
        return tuple(after)


class TelegramDecoder:
    """Knows the command group of one drive. ``scales``, by the value's leaf, and ``unserved``, which has
    the reason for each point that the node cannot take, are read at each write: they fill at boot-up."""

    def __init__(
        self,
        name: str,
        family: Family,
        slot: Slot,
        scales: Mapping[str, LinearScale],
        unserved: Mapping[str, str],
    ) -> None:
        self._name = name
        self._scales = scales
        self._unserved = unserved
        words = family.process.rpdo[1:]
        carried = family.carried(slot)[0]
        self._setpoints = {word: place for place, word in enumerate(words) if word in carried}
        self._values = {codec.model.name: codec for codec in codecs(family, slot, "command", words, {})}
        self._set = ParameterSet(family.control_word.parameter_set_bits)
        self._set_values = {
            name for name, codec in self._values.items() if family.depends_on_set(codec.model)
        }

    def decode(self, values: Mapping[str, Value], before: tuple[int, ...], held: int) -> Telegram:
        """The words to be sent; setpoints that are not written stay as ``before``. ``held`` is the control
        word that counts where none is written. Raises ``Refusal``."""
        control_word: int | None = None
        setpoints = _Setpoints()
        for leaf, value in values.items():
            if leaf == "control_word":
                control_word = _as_word(leaf, value)
                continue
            for written in self._written(leaf, value):
                setpoints.put(leaf, written)
        self._check_set(values, held if control_word is None else control_word)
        return Telegram(control_word, setpoints.over(before))

    def _check_set(self, values: Mapping[str, Value], control_word: int) -> None:
        """Scaled values are not known in another parameter set; raw words need no scale."""
        if not control_word & self._set.mask:
            return
        for leaf in values:
            if leaf in self._set_values:
                why = self._set.why_unknown(control_word, self._values[leaf].model.full)
                raise Refusal(Code.NOT_CONFIGURED, f"{leaf}: {why}")

    def _written(self, leaf: str, value: Value) -> tuple[Written, ...]:
        place, codec = self._setpoints.get(leaf), self._values.get(leaf)
        if place is None and codec is None:
            known = ", ".join(["control_word", *self._setpoints, *self._values])
            raise Refusal(Code.UNKNOWN_POINT, f"{self._name}/command has no {leaf!r}; it has {known}")
        point = f"command/{leaf}"
        why = self._unserved.get(point)
        if why:
            raise Refusal(Code.NOT_CONFIGURED, f"{leaf}: {why}")
        if place is not None:
            return (Written(place, _WORD_MASK, _as_word(leaf, value)),)
        codec = self._values[leaf] = self._values[leaf].scaled(self._scales.get(point))
        return _from_value(codec, value)


def _from_value(codec: ValueCodec, value: Value) -> tuple[Written, ...]:
    model = codec.model
    if codec.is_unknown:
        raise Refusal(Code.NOT_CONFIGURED, f"{model.name}: {model.full} is not known; see boot_status")
    is_bit = model.bit is not None and isinstance(value, bool)
    try:
        return codec.to_words(int(value) if is_bit else _as_number(model.name, value))
    except ValueError as error:
        raise Refusal(Code.OUT_OF_RANGE, f"{model.name} {error} {model.unit}".rstrip()) from None


def _as_number(leaf: str, value: object) -> float:
    """``value`` as a number; callers on the network may send anything."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise Refusal(Code.OUT_OF_RANGE, f"{leaf} takes a number")
    try:
        return float(value)
    except OverflowError:  # an integer of more than 308 digits
        return math.inf


def _as_word(leaf: str, value: object) -> int:
    """``value`` as a 16-bit word. Negative numbers are refused: -1 would be sent as FFFFh, which acknowledges
    and enables. Signed numbers belong to the scaled values."""
    number = _as_number(leaf, value)
    if not 0 <= number <= _WORD_MASK:
        raise Refusal(Code.OUT_OF_RANGE, f"{leaf} takes 0…65535, not {number:g}")
    if not number.is_integer():
        raise Refusal(Code.OUT_OF_RANGE, f"{leaf} takes a whole number, not {number:g}")
    return int(number)
