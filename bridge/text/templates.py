"""Texts in words: the templates of each language, and how facts fill them.

A template has its facts in braces: ``{drive}``, with a format of Python's for a number, ``{late_ms:.0f}``,
with ``!r`` for a string in quotes, and for several texts with what joins them, ``{reasons:; }``. It has no
logic: what reads differently for one and for many has two codes. ``texts/text.js`` of the page renders the
same files.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import cache, lru_cache
from pathlib import Path
from string import Formatter
from typing import Final, NamedTuple

from bridge.text.text import Fact, Text

LANGUAGES: Final = ("en", "de")
_JOINED_BY: Final = ", "


class Part(NamedTuple):
    """Literal words, and the fact that follows them: "" where none does."""

    words: str
    name: str
    format: str
    is_quoted: bool


def parse(template: str) -> tuple[Part, ...]:
    """Raises ValueError for braces that do not fit."""
    return tuple(
        Part(words, name or "", form or "", conversion == "r")
        for words, name, form, conversion in Formatter().parse(template)
    )


@cache
def source(language: str) -> bytes:
    """The file of templates, as it is served to browsers."""
    return (Path(__file__).parent / f"{language}.json").read_bytes()


@cache
def templates(language: str) -> Mapping[str, tuple[Part, ...]]:
    """The parts of each template by its code."""
    return {code: parse(template) for code, template in json.loads(source(language)).items()}


def render(said: Text | str, language: str = "en") -> str:
    """``said`` in words; a string is somebody's words already. Raises KeyError for a code that has no
    template and for facts that a template lacks."""
    if isinstance(said, str):
        return said
    facts = dict(said.facts)
    return "".join(
        part.words + (_shown(facts[part.name], part, language) if part.name else "")
        for part in templates(language)[said.code]
    )


@lru_cache(maxsize=1024)
def in_english(said: Text | str) -> str:
    """As ``render``, and remembered: for what many points have in common and is shown again and again."""
    return render(said)


def _shown(fact: Fact, part: Part, language: str) -> str:
    match fact:
        case Text():
            return render(fact, language)
        case tuple():
            return (part.format or _JOINED_BY).join(render(one, language) for one in fact)
        case str():
            return repr(fact) if part.is_quoted else fact
        case float() if not part.format:
            # As a browser shows it, which knows no difference between 1.0 and 1.
            return f"{fact:.0f}" if fact.is_integer() else repr(fact)
        case _:
            return format(fact, part.format)


# Now, so that nothing that is to be told waits for a disk.
templates("en")
