"""Types of single entries in a mapping file: objects, patterns, codes, numbers."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Annotated, Final

from pydantic import AfterValidator, BeforeValidator, Field, WithJsonSchema

from bridge.config.field_types import Name as Name
from bridge.config.model import Table as Table
from bridge.image import DataType
from bridge.text import Said, Text
from bridge.tomlfile import Unfit

WORD_BITS: Final = 16
_MOST_BITS: Final = 64
_OBJECT_TEXT: Final = r"[0-9A-Fa-f]{4}:[0-9A-Fa-f]{2}"
_MAPPED_TEXT: Final = rf"{_OBJECT_TEXT}(/[0-9]{{1,2}})?"
_OBJECT: Final = re.compile(r"([0-9A-Fa-f]{4}):([0-9A-Fa-f]{2})")
_PART: Final = re.compile(r"([0-9A-Fa-f]{4}):([0-9A-Fa-f]{2})(?:/([0-9]{1,2}))?")
_PATTERN: Final = re.compile(r"[01X]{1,16}")
_CODE: Final = re.compile(r"[0-9A-F]{4}|[0-9A-F]{2}xx")
_NUMBER: Final = re.compile(r"\d+\.\d")
_DECIMAL: Final = re.compile(r"\d{1,10}")
_STATE: Final = re.compile(r"-?\d{1,10}")


@dataclass(frozen=True, slots=True, order=True)
class ObjectRef:
    """An entry of the object dictionary."""

    index: int
    sub: int

    def __str__(self) -> str:
        return f"{self.index:04X}:{self.sub:02X}"


class MappedObject(Table):
    """Content of one word: one object, or several shorter ones, the first in the lowest bits.

    ``bits`` has the length of each part where it is given; 0 is 16 for one object (times the words that it
    fills) and 8 for each of several.
    """

    parts: tuple[ObjectRef, ...]
    bits: tuple[int, ...]

    @property
    def is_composite(self) -> bool:
        return len(self.parts) > 1

    @property
    def lengths(self) -> tuple[int, ...]:
        """Bits of each part, for an object that fills one word."""
        default = WORD_BITS // 2 if self.is_composite else WORD_BITS
        return tuple(bits or default for bits in self.bits)

    def __str__(self) -> str:
        named = zip(self.parts, self.bits, strict=True)
        return "+".join(f"{part}/{bits}" if bits else f"{part}" for part, bits in named)


def _object(text: object) -> object:
    if isinstance(text, ObjectRef):
        return text
    match = _OBJECT.fullmatch(text) if isinstance(text, str) else None
    if not match:
        raise Unfit(Text.of("mapping.object_form"))
    return ObjectRef(int(match[1], 16), int(match[2], 16))


def _mapped(text: object) -> object:
    if isinstance(text, MappedObject):
        return text
    matches = [_PART.fullmatch(part) for part in text.split("+")] if isinstance(text, str) else []
    found = [match for match in matches if match]
    if not found or len(found) != len(matches):
        raise Unfit(Text.of("mapping.mapped_form"))
    bits = tuple(int(match[3] or 0) for match in found)
    mapped = MappedObject(
        parts=tuple(ObjectRef(int(match[1], 16), int(match[2], 16)) for match in found), bits=bits
    )
    if any(match[3] and not 1 <= int(match[3]) <= _MOST_BITS for match in found):
        raise Unfit(Text.of("mapping.bits_form", most=_MOST_BITS))
    if mapped.is_composite and sum(mapped.lengths) > WORD_BITS:
        raise Unfit(Text.of("mapping.more_than_word", bits=sum(mapped.lengths), most=WORD_BITS))
    return mapped


def _pattern(text: str) -> str:
    text = text.replace(" ", "")
    if not _PATTERN.fullmatch(text):
        raise Unfit(Text.of("mapping.pattern_form"))
    return text


def _code(text: str) -> str:
    if not _CODE.fullmatch(text):
        raise Unfit(Text.of("mapping.code_form"))
    return text


def _number(text: str) -> str:
    if not _NUMBER.fullmatch(text):
        raise Unfit(Text.of("mapping.number_form"))
    return text


def _decimal(text: str) -> str:
    if not _DECIMAL.fullmatch(text):
        raise Unfit(Text.of("mapping.decimal_form"))
    return str(int(text))


def _state(key: object) -> object:
    if isinstance(key, str) and _STATE.fullmatch(key):
        return int(key)
    if isinstance(key, int):
        return key
    raise Unfit(Text.of("mapping.state_form"))


def _text_schema(pattern: str) -> WithJsonSchema:
    return WithJsonSchema({"type": "string", "pattern": f"^{pattern}$"})


Ref = Annotated[ObjectRef, BeforeValidator(_object), _text_schema(_OBJECT_TEXT)]
Mapped = Annotated[
    MappedObject, BeforeValidator(_mapped), _text_schema(rf"{_MAPPED_TEXT}(\+{_MAPPED_TEXT})*")
]
Pattern = Annotated[str, AfterValidator(_pattern)]
Word = Annotated[int, Field(ge=0, le=0xFFFF)]
Bit = Annotated[int, Field(ge=0, le=15)]
Bits = Annotated[list[str], Field(max_length=16, description="names of the bits from bit 0 on")]
Kind = Annotated[DataType, Field(strict=False)]
EmcyCode = Annotated[str, AfterValidator(_code)]
FaultNumber = Annotated[str, AfterValidator(_number)]
Decimal = Annotated[str, AfterValidator(_decimal)]
States = dict[Annotated[int, BeforeValidator(_state), WithJsonSchema({"type": "string"})], str]
"""Texts by number; TOML writes the numbers as keys."""


def pattern_bits(pattern: str) -> tuple[int, int]:
    """Mask and value of a pattern such as ``"0XX1000"``: a word matches where ``word & mask == value``."""
    mask = int("".join("0" if c == "X" else "1" for c in pattern), 2)
    value = int(pattern.replace("X", "0"), 2)
    return mask, value


class Wording(Table):
    """One sentence in two languages."""

    en: str
    de: str

    def __str__(self) -> str:
        """In English, for whoever knows one language."""
        return self.en

    @property
    def said(self) -> Text:
        """The sentence in the reader's language."""
        return Text.both(self.en, self.de)


def said_of(words: str | Wording | None) -> Said:
    """A sentence of a mapping file, in one language or in both; "" where there is none."""
    if isinstance(words, Wording):
        return words.said
    return Text.plain(words) if words else ""
