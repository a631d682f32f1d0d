"""A write to a drive's command group, decoded: names and values to process words."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from bridge.command.request import Code
from bridge.drive import LinearScale
from bridge.image import Value
from bridge.mapping.model import Family, ScaledValue


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


class TelegramDecoder:
    """Knows the command group of one drive. ``scales`` is read at each write: it fills at boot-up."""

    def __init__(self, name: str, family: Family, scales: Mapping[str, LinearScale]) -> None:
        self._name = name
        self._scales = scales
        self._setpoints = {word: place for place, word in enumerate(family.process.rpdo[1:])}
        self._scaled = {value.name: value for value in family.value if value.group == "command"}

    def decode(self, values: Mapping[str, Value], before: tuple[int, ...]) -> Telegram:
        """The words to be sent; setpoints that are not written stay as ``before``. Raises ``Refusal``."""
        control_word: int | None = None
        written: dict[int, int] = {}
        for leaf, value in values.items():
            if leaf == "control_word":
                control_word = _as_word(leaf, value)
                continue
            place, word = self._setpoint(leaf, value)
            if written.setdefault(place, word) != word:
                raise Refusal(Code.OUT_OF_RANGE, f"{leaf} and the word it is made from do not agree")
        setpoints = tuple(written.get(place, word) for place, word in enumerate(before))
        return Telegram(control_word, setpoints)

    def _setpoint(self, leaf: str, value: Value) -> tuple[int, int]:
        """Place among the setpoints, and word."""
        if leaf in self._setpoints:
            return self._setpoints[leaf], _as_word(leaf, value)
        scaled = self._scaled.get(leaf)
        if scaled is None:
            known = ", ".join(["control_word", *self._setpoints, *self._scaled])
            raise Refusal(Code.UNKNOWN_POINT, f"{self._name}/command has no {leaf!r}; it has {known}")
        return self._setpoints[scaled.word], self._to_word(scaled, value)

    def _to_word(self, scaled: ScaledValue, value: Value) -> int:
        scale = self._scales.get(scaled.leaf)
        if scale is None:
            full = scaled.scale.full
            raise Refusal(Code.NOT_CONFIGURED, f"{scaled.name}: {full} is not known; see boot_status")
        try:
            return scale.to_word(_as_number(scaled.name, value))
        except ValueError as error:
            raise Refusal(Code.OUT_OF_RANGE, f"{scaled.name} {error} {scaled.unit}".rstrip()) from None


def _as_number(leaf: str, value: object) -> float:
    """``value`` as a number; callers on the network may send anything."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise Refusal(Code.OUT_OF_RANGE, f"{leaf} takes a number")
    try:
        return float(value)
    except OverflowError:  # an integer of more than 308 digits
        return math.inf


def _as_word(leaf: str, value: object) -> int:
    """``value`` as a 16-bit word; a signed number stands for its two's complement."""
    number = _as_number(leaf, value)
    if not -0x8000 <= number <= 0xFFFF:
        raise Refusal(Code.OUT_OF_RANGE, f"{leaf} takes 0…65535, not {number:g}")
    if not number.is_integer():
        raise Refusal(Code.OUT_OF_RANGE, f"{leaf} takes a whole number, not {number:g}")
    return int(number) & 0xFFFF
