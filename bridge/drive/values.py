"""The values of a family, compiled: the words of a PDO as numbers, enumerations and bits, and back."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass
from typing import Final

from bridge.canopen.datatypes import INTEGERS, REALS
from bridge.drive.scaling import LinearScale, scale_of
from bridge.image import DataType
from bridge.image.limits import ValueNotTaken, out_of_range
from bridge.mapping.model import Family, ProcessValue
from bridge.text import Said, Text

_WORD_BITS: Final = 16
_WORD_MASK: Final = 0xFFFF
_REAL: Final = REALS["real32"]


@dataclass(frozen=True, slots=True)
class MaskedBits:
    """Bits of one word that a write sets: ``word & ~mask | bits``, at this place."""

    place: int
    mask: int
    bits: int


class ValueCodec:
    """One value of one drive. ``places`` says where its words stand, the low one first, and is empty where
    only the drive knows (``Meanings``); ``scale`` is None for what has none, and where it is not known."""

    def __init__(self, model: ProcessValue, words: Sequence[str], scale: LinearScale | None = None) -> None:
        self.model = model
        self.places = tuple(words.index(word) for word in model.word_names)
        self.scale = scale
        self._number = None if model.is_real else INTEGERS[model.raw_type]
        self._bit = model.bit
        self._states = model.states
        low, high = model.raw_range
        self._low = low if model.low is None else max(low, model.low)
        self._high = high if model.high is None else min(high, model.high)

    def placed(self, places: tuple[int, ...]) -> ValueCodec:
        """The codec with its words there; without any it has no value."""
        if places == self.places:
            return self
        other = copy(self)
        other.places = places
        return other

    def scaled(self, scale: LinearScale | None) -> ValueCodec:
        """The codec with this scale: another one where it is another scale."""
        if scale is self.scale:
            return self
        other = copy(self)
        other.scale = scale
        return other

    @property
    def is_unknown(self) -> bool:
        """It is scaled by a parameter that is not known."""
        return self.scale is None and self.model.scale is not None

    @property
    def why_unknown(self) -> Said:
        if not self.is_unknown:
            return ""
        return Text.of("meaning.scale_unknown", parameters=tuple(self.model.scaled_by))

    @property
    def is_plain(self) -> bool:
        """One signed word times a factor, as most values are."""
        return (
            self.model.width == 1
            and self.model.raw_type is DataType.INT16
            and self._bit is None
            and self.model.scale is not None
            and not self.model.scale.offset
        )

    @property
    def range(self) -> tuple[float | None, float | None]:
        """Range that may be written, in the value's unit; None where not known or not of interest."""
        if self.scale is not None:
            return self.scale.low, self.scale.high
        if self.is_unknown or (self.model.low is None and self.model.high is None):
            return None, None
        return self._low, self._high

    def from_words(self, words: Sequence[int]) -> bool | int | float:
        """Value that these words stand for; with an unknown scale the bare number, and without words zero."""
        if not self.places:
            return False if self._bit is not None else 0.0 if self.model.point_type is DataType.FLOAT else 0
        word = words[self.places[0]]
        if len(self.places) > 1:
            word |= words[self.places[1]] << _WORD_BITS
        if self._bit is not None:
            return bool(word >> self._bit & 1)
        if self.scale is not None:
            return self.scale.from_word(word)
        if self._number is None:
            return _REAL.decode(word.to_bytes(_REAL.size, "little"))
        number = self._number.from_word(word)
        return float(number) if self.model.scale is not None else number

    def to_words(self, value: bool | int | float) -> tuple[MaskedBits, ...]:
        """Bits that writing ``value`` sets. Raises ValueNotTaken where it is out of range. The scale must be
        known."""
        if self._bit is not None:
            if value not in (0, 1):
                raise ValueNotTaken(Text.of("takes.bool", value=f"{value:g}"))
            mask = 1 << self._bit
            return (MaskedBits(self.places[0], mask, mask if value else 0),)
        word = self.scale.to_word(value) if self.scale is not None else self._whole(value)
        return tuple(
            MaskedBits(place, _WORD_MASK, word >> _WORD_BITS * part & _WORD_MASK)
            for part, place in enumerate(self.places)
        )

    def _whole(self, value: float) -> int:
        if not self._low <= value <= self._high:
            raise out_of_range(self._low, self._high, value)
        if self._number is None:
            return int.from_bytes(_REAL.encode(value), "little")
        number = int(value)
        if number != value:
            raise ValueNotTaken(Text.of("takes.whole_number", value=f"{value:g}"))
        if self._states and number not in self._states:
            known = tuple(f"{state} {text}" for state, text in sorted(self._states.items()))
            raise ValueNotTaken(Text.of("takes.choices", choices=known, value=str(number)))
        return number


def scales_of(family: Family, given: Mapping[str, float]) -> dict[str, LinearScale]:
    """The scales that are known with the parameters that are ``given``, by the value's leaf."""
    found = {
        value.leaf: scale_of(
            value,
            given.get(value.full or ""),
            given.get(value.scale.over) if value.scale and value.scale.over else 1.0,
        )
        for value in family.value
    }
    return {leaf: scale for leaf, scale in found.items() if scale is not None}
