"""A text as a code with facts: what is passed on until somebody reads it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import isfinite
from typing import Any, Final, Literal, cast

from bridge.text.templates import TemplatePart, templates

PLAIN: Final = "plain"
"""Code of words that are somebody else's: of a drive's maker, the site file, or an operating system."""
_JOINED_BY: Final = ", "

BOTH: Final = "both"
"""Code of a sentence whose facts are its wordings by language: each template has its own of them."""


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

    def __str__(self) -> str:
        """In English, as in the log and on every interface that knows one language."""
        return render(self)

    @classmethod
    def plain(cls, words: Words) -> Text:
        """Somebody else's words, which have no code; a text as it is."""
        return words if isinstance(words, Text) else cls(PLAIN, (("text", words),))

    @classmethod
    def both(cls, en: str, de: str) -> Text:
        """A sentence of a mapping file in both languages."""
        return cls(BOTH, (("en", en), ("de", de)))


Said = Text | Literal[""]
"""A text, or nothing where there is none."""
Words = Text | str
"""A text, or a name or somebody else's words, which are the same in every language."""
Fact = str | int | float | Text | tuple[Text | str, ...]
"""A string is a name or somebody else's words, which are the same in every language."""


def as_json(said: Words) -> dict[str, Any] | None:
    """``{"code": …, "facts": {…}}``, also of the texts among the facts; None of words without a code."""
    return None if isinstance(said, str) or said.code == PLAIN else _object_of(said)


def _object_of(text: Text) -> dict[str, Any]:
    return {"code": text.code, "facts": {name: _json_of(fact) for name, fact in text.facts}}


def _json_of(fact: Fact) -> object:
    if isinstance(fact, Text):
        return _object_of(fact)
    if isinstance(fact, float) and not isfinite(fact):
        return str(fact)
    return [_json_of(one) for one in fact] if isinstance(fact, tuple) else fact


def from_json(told: dict[str, Any]) -> Text:
    """The text that ``as_json`` has told."""
    facts = ((name, _fact_of(fact)) for name, fact in told["facts"].items())
    return Text(told["code"], tuple(facts))


def _fact_of(told: Any) -> Fact:
    if isinstance(told, dict):
        return from_json(cast("dict[str, Any]", told))
    if isinstance(told, list):
        return tuple(cast("Text | str", _fact_of(one)) for one in cast("list[Any]", told))
    return told


def render(said: Words, language: str = "en") -> str:
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
def in_english(said: Words) -> str:
    """English text by ``render``, remembered: for what many points share and is shown over and over."""
    return render(said)


def _shown(fact: Fact, part: TemplatePart, language: str) -> str:
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
