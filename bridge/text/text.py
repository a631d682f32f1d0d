"""A text as a code with facts: what is passed on until somebody reads it."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite
from typing import Any, Final

PLAIN: Final = "plain"
"""Code of a sentence that has none."""


@dataclass(frozen=True, slots=True)
class Text:
    """``code`` names a template in every language (``en.json``, ``de.json``); codes are interface, and are
    never renamed. ``facts`` are what fills it, by name."""

    code: str
    facts: tuple[tuple[str, Fact], ...] = ()

    @classmethod
    def of(cls, code: str, /, **facts: Fact) -> Text:
        """The text with this code, which is written out in the source: a test compares it and the names of
        its facts with the templates."""
        return cls(code, tuple(facts.items()))

    @classmethod
    def word(cls, group: str, word: str) -> Text:
        """A word out of a group of them, such as the name of a state."""
        return cls(f"{group}.{word.replace(' ', '_').replace('-', '_')}")

    @classmethod
    def plain(cls, said: Text | str) -> Text:
        """An English sentence that has no code; a text as it is."""
        return said if isinstance(said, Text) else cls(PLAIN, (("text", said),))


Fact = str | int | float | Text | tuple[Text | str, ...]
"""A string is a name or somebody else's words, which are the same in every language."""


def as_json(said: Text | str) -> dict[str, Any] | None:
    """``{"code": …, "facts": {…}}``, also of the texts among the facts; None of a sentence without a code."""
    return None if isinstance(said, str) or said.code == PLAIN else _object_of(said)


def _object_of(text: Text) -> dict[str, Any]:
    return {"code": text.code, "facts": {name: _json_of(fact) for name, fact in text.facts}}


def _json_of(fact: Fact) -> object:
    if isinstance(fact, Text):
        return _object_of(fact)
    if isinstance(fact, float) and not isfinite(fact):
        return str(fact)
    return [_json_of(one) for one in fact] if isinstance(fact, tuple) else fact
