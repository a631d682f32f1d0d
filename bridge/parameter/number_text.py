"""Numbers as people type them, by the grammar of docs/reference/numbers.md. The page's
``static/js/numbers.js`` is the same in JavaScript; tests/support/number_cases.json holds both to it.

The language of the writer decides between what two languages read differently: in English ``1.500`` is
one and a half, and in German it may be fifteen hundred.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Final, Literal

from bridge.text import Text, render

Language = Literal["en", "de"]

_BLANKS: Final = " \t\u00a0\u2009\u202f"
_MOST: Final = 60
"""Characters: no number that a drive holds has more."""
_EXACT: Final = 1e15
"""Up to here a real number shows all its digits without an exponent."""
_SIGNED: Final = re.compile("([-+\u2212]?)(.*)", re.DOTALL)
_HEXADECIMAL: Final = re.compile("0x([0-9a-f]+)|([0-9][0-9a-f]*)h", re.IGNORECASE)
_POWER: Final = re.compile("(.*?)(?:e([-+\u2212]?[0-9]{1,3}))?", re.IGNORECASE | re.DOTALL)
_OTHER: Final[dict[Language, Language]] = {"en": "de", "de": "en"}


def _plain(mark: str, group: str) -> re.Pattern[str]:
    """A number without sign and exponent: groups, blanks as groups, or digits, and decimals."""
    blanks = "[1-9][0-9]{0,2}(?P<blank>[ \u00a0\u2009\u202f])[0-9]{3}(?:(?P=blank)[0-9]{3})*"
    groups = "[1-9][0-9]{0,2}(?:" + group + "[0-9]{3})+"
    whole = "(?P<whole>(?P<groups>" + groups + ")|" + blanks + "|[0-9]*)"
    return re.compile("(?=.*[0-9])" + whole + "(?:" + mark + "(?P<decimals>[0-9]+))?")


_PLAIN: Final[dict[Language, re.Pattern[str]]] = {"en": _plain(r"\.", ","), "de": _plain(",", r"\.")}


class NumberError(ValueError):
    """A text that is no number, or may be two; ``said`` is for whoever typed it.

    ``why`` is ``empty``, ``no_number``, ``other_digits``, ``too_large``, ``ambiguous``, or for the command
    line ``other_notation`` or ``hexadecimal``; ``readings`` are the numbers that the text may mean.
    """

    def __init__(self, text: str, why: str, readings: tuple[int | float, ...] = ()) -> None:
        self.said = _said(text, why, readings)
        super().__init__(render(self.said))
        self.why = why
        self.readings = readings


def _said(text: str, why: str, readings: tuple[int | float, ...]) -> Text:
    meant = tuple(written(one) for one in readings)
    match why:
        case "empty":
            return Text.of("number.missing")
        case "ambiguous":
            return Text.of("number.ambiguous", text=text, readings=meant)
        case "other_notation":
            return Text.of("number.other_notation", text=text, readings=meant)
        case "other_digits":
            return Text.of("number.other_digits", text=text)
        case "hexadecimal":
            return Text.of("number.hexadecimal", text=text)
        case "too_large":
            return Text.of("number.too_large", text=text[:_MOST])
        case _:
            return Text.of("number.none", text=text[:_MOST])


@dataclass(frozen=True, slots=True)
class TypedNumber:
    """A number that was typed. ``is_other`` where it is in the notation of the other language, and
    ``is_hexadecimal`` where it is written as ``0x1F`` or ``1Fh``."""

    value: int | float
    is_other: bool = False
    is_hexadecimal: bool = False


def read_number(text: str, language: Language) -> TypedNumber:
    """The number in ``text``, as it is written in ``language``. Raises ``NumberError``.

    What has neither decimals nor an exponent is an ``int``.
    """
    bare = text.strip(_BLANKS)
    if not bare:
        raise NumberError(text, "empty")
    if any(char.isdecimal() and not char.isascii() for char in bare):
        raise NumberError(text, "other_digits")
    if len(bare) > _MOST:
        raise NumberError(text, "too_large" if bare.isdecimal() else "no_number")
    signed = _SIGNED.fullmatch(bare)
    sign, magnitude = (signed[1], signed[2]) if signed else ("", bare)
    minus = "-" if sign in ("-", "\u2212") else ""
    if found := _HEXADECIMAL.fullmatch(magnitude):
        return TypedNumber(int(minus + (found[1] or found[2]), 16), is_hexadecimal=True)
    own = _read(minus, magnitude, language)
    other = _read(minus, magnitude, _OTHER[language])
    if own is not None and other is not None and own[1] and own[0] != other[0]:
        # A group of three behind the other language's decimal mark.
        raise NumberError(text, "ambiguous", (_value(text, own[0]), _value(text, other[0])))
    if own is not None:
        return TypedNumber(_value(text, own[0]))
    if other is not None:
        return TypedNumber(_value(text, other[0]), is_other=True)
    raise NumberError(text, "no_number")


def command_line_number(text: str, *, is_code: bool = True) -> int | float:
    """The number in ``text`` on a command line, which is written in English whatever the locale is: a script
    means the same on each machine. Raises ``NumberError``. Hexadecimal is taken where ``is_code``."""
    found = read_number(text, "en")
    if found.is_other:
        raise NumberError(text, "other_notation", (found.value,))
    if found.is_hexadecimal and not is_code:
        raise NumberError(text, "hexadecimal")
    return found.value


def written(value: float) -> str:
    """``value`` as ``read_number`` takes it in English: without groups."""
    return str(int(value)) if value == int(value) and abs(value) < _EXACT else repr(value)


def _read(minus: str, magnitude: str, language: Language) -> tuple[str, bool] | None:
    """The number as Python writes it and whether it has groups; None where it is none in ``language``."""
    power = _POWER.fullmatch(magnitude)
    found = _PLAIN[language].fullmatch(power[1]) if power else None
    if power is None or found is None:
        return None
    whole = re.sub("[^0-9]", "", found["whole"]) or "0"
    decimals = f".{found['decimals']}" if found["decimals"] else ""
    exponent = f"e{power[2]}".replace("\u2212", "-") if power[2] else ""
    return f"{minus}{whole}{decimals}{exponent}", found["groups"] is not None


def _value(text: str, read: str) -> int | float:
    if read.lstrip("-").isdecimal():
        return int(read)
    number = float(read)
    if not math.isfinite(number):
        raise NumberError(text, "too_large")
    return number + 0.0  # without the sign of a zero
