"""Texts in several languages, of which each client is told the one that it asks for (OPC 10000-4 §5.4)."""

# asyncua's LocalizedText has fields of these names: here they are looked up.
# pyright: reportIncompatibleVariableOverride=false, reportIncompatibleMethodOverride=false

from __future__ import annotations

from collections.abc import Collection, Generator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar

from bridge.uaserver.library import ua

_locales: ContextVar[Sequence[str]] = ContextVar("locales", default=())
"""LocaleIds of the client that is being answered, the preferred one first."""


class Spoken(ua.LocalizedText):
    """LocalizedText that is in the client's language wherever it is read or encoded while ``speaking``.

    ``words`` are its texts by LocaleId; the first of them is for who knows none of the others.
    """

    words: Mapping[str, str]

    def __init__(self, words: Mapping[str, str]) -> None:
        object.__setattr__(self, "words", words)
        object.__setattr__(self, "Encoding", 0)

    @property
    def Locale(self) -> str:
        return chosen(_locales.get(), self.words)

    @property
    def Text(self) -> str:
        return self.words[chosen(_locales.get(), self.words)]

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Spoken) and self.words == other.words

    def __hash__(self) -> int:
        return hash(tuple(self.words.items()))

    def __repr__(self) -> str:
        return f"Spoken({self.words!r})"


@contextmanager
def speaking(locales: Sequence[str]) -> Generator[None]:
    """Context in which texts are in the first of ``locales`` that they are in."""
    token = _locales.set(locales)
    try:
        yield
    finally:
        _locales.reset(token)


def chosen(locales: Sequence[str], offered: Collection[str]) -> str:
    """The first of ``locales`` that is offered, else the first that is offered. ``de-CH`` asks for ``de``,
    too, where nothing is for Switzerland (Part 3 §8.4)."""
    for locale in locales:
        for wanted in (locale, locale.partition("-")[0].lower()):
            if wanted in offered:
                return wanted
    return next(iter(offered))
