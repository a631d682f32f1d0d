"""The templates of each language, taken apart.

A template has its facts in braces: ``{drive}``, with a format of Python's for a number, ``{late_ms:.0f}``,
with ``!r`` for a string in quotes, and for several texts with what joins them, ``{reasons:; }``. It has no
logic: what reads differently for one and for many has two codes. ``texts/text.js`` of the page renders the
same files.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from string import Formatter
from typing import Final, NamedTuple

LANGUAGES: Final = ("en", "de")


class TemplatePart(NamedTuple):
    """Literal words, and the fact that follows them: "" where none does."""

    words: str
    name: str
    format: str
    is_quoted: bool


def parse(template: str) -> tuple[TemplatePart, ...]:
    """Raises ValueError for braces that do not fit."""
    return tuple(
        TemplatePart(words, name or "", form or "", conversion == "r")
        for words, name, form, conversion in Formatter().parse(template)
    )


@cache
def source(language: str) -> bytes:
    """The file of templates, as it is served to browsers."""
    return (Path(__file__).parent / f"{language}.json").read_bytes()


@cache
def templates(language: str) -> Mapping[str, tuple[TemplatePart, ...]]:
    """The parts of each template by its code."""
    return {code: parse(template) for code, template in json.loads(source(language)).items()}


# Now, so that nothing that is to be told waits for a disk.
templates("en")
