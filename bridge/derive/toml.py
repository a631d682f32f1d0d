"""TOML as a person would have written it."""

from __future__ import annotations

import json
import math
import unicodedata
from collections.abc import Sequence
from typing import Final

from bridge.canopen.datatypes import Plain
from bridge.text import LANGUAGES, Text, render

_LETTERS: Final = {
    "ä": "ae", "ö": "oe", "ü": "ue", "ß": "ss", "æ": "ae", "œ": "oe", "ø": "oe", "å": "aa", "đ": "d",
    "ł": "l", "ı": "i",
}  # fmt: skip
"""Spellings of letters that no accent makes of others, or that a language writes as two."""


def one_line(text: str) -> str:
    """``text`` without line breaks and control characters: what stands in comments and titles."""
    return " ".join("".join(one if one.isprintable() else " " for one in text).split())


def string(text: str) -> str:
    return json.dumps(one_line(text), ensure_ascii=False)


def wording(said: Text) -> str:
    """``said`` in each language, as the table of a sentence."""
    return f"{{ {', '.join(f'{language} = {string(render(said, language))}' for language in LANGUAGES)} }}"


def strings(texts: Sequence[str]) -> str:
    return f"[{', '.join(map(string, texts))}]"


def value(plain: Plain) -> str:
    """Raises ValueError for a number that no file can hold."""
    if isinstance(plain, bool):
        return "true" if plain else "false"
    if isinstance(plain, str):
        return json.dumps(plain, ensure_ascii=False).replace("\x7f", "\\u007f")
    if not math.isfinite(plain):
        raise ValueError(f"{plain} is no number for a file")
    return str(plain) if isinstance(plain, int) else repr(plain)


def number(plain: float) -> str:
    """A number that may have decimals. Raises ValueError as ``value`` does."""
    try:
        return value(float(plain))
    except OverflowError:
        raise ValueError(f"{plain} is too large") from None


def word(number: int, digits: int = 4) -> str:
    return f"0x{number:0{digits}X}"


def file_name(text: str) -> str:
    """``text`` as part of a mapping's name: lower case, words joined by hyphens."""
    return "-".join(ascii_words(text))


def ascii_words(text: str) -> list[str]:
    """The words of ``text`` in lower case and in ASCII: ü becomes ue, é becomes e."""
    # One character for a letter with its dots, so that it is found; then the other accents by themselves.
    composed = unicodedata.normalize("NFC", text.lower())
    written = unicodedata.normalize("NFD", "".join(_LETTERS.get(one, one) for one in composed))
    plain = (one for one in written if not unicodedata.combining(one))
    return "".join(one if one.isascii() and one.isalnum() else " " for one in plain).split()
