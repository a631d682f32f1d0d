"""Words of nodes in every language: of each client's own (``bridge.uaserver.languages``)."""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import cache
from typing import Final

from bridge.northbound.opcua.space.nodes import pascal_case
from bridge.text import LANGUAGES, Text, Words, render
from bridge.text.templates import templates
from bridge.uaserver.languages import Spoken
from bridge.uaserver.library import text, ua

_NAMES: Final = "name"
"""Group of the names of points, bits, states, groups and methods."""
_NUMBERED: Final = re.compile(r"(.*?)((?:_?\d+)*)")


@cache
def spoken(said: Words) -> ua.LocalizedText:
    """Text in each language that it is said in. Somebody else's words are taken for English."""
    return localized({language: render(said, language) for language in LANGUAGES})


def localized(words: Mapping[str, str]) -> ua.LocalizedText:
    """Texts by LocaleId."""
    return Spoken(words) if len(set(words.values())) > 1 else text(next(iter(words.values())))


@cache
def named(browse_name: str) -> ua.LocalizedText:
    """A BrowseName of the program's own, which is its English DisplayName, too."""
    base, number = _split(browse_name)
    code = _codes().get(base)
    return text(browse_name) if code is None else _with_number(browse_name, code, number)


@cache
def state_named(state: Words) -> ua.LocalizedText:
    """A state as points have it, with the same English text. Those of parameters are their makers'."""
    if isinstance(state, Text):
        return spoken(state)
    base, number = _split(state)
    code = Text.word("name", base).code
    return _with_number(state, code, number) if code in templates(LANGUAGES[0]) else text(state)


def _with_number(english: str, code: str, number: str) -> ua.LocalizedText:
    others = {
        language: f"{render(Text.word('name', code.partition('.')[2]), language)} {number}".rstrip()
        for language in LANGUAGES[1:]
    }
    return localized({LANGUAGES[0]: english, **others})


def _split(name: str) -> tuple[str, str]:
    """``setpoint_1`` and ``Setpoint1`` as the name and its number."""
    found = _NUMBERED.fullmatch(name)
    return (found[1], found[2].replace("_", " ").strip()) if found else (name, "")


@cache
def _codes() -> Mapping[str, str]:
    """Codes of names by the BrowseName that pascal_case makes of them."""
    return {
        pascal_case(code.partition(".")[2]): code
        for code in templates(LANGUAGES[0])
        if code.startswith(f"{_NAMES}.")
    }
