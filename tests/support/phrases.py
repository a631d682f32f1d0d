"""The phrase book of the web page, read as ``texts/said.js`` reads it."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Final

SLOT: Final = re.compile(r"\{(\w+)([#…]?)\}")
_HOLDS: Final = {"": r"(\S+)", "#": r"(-?\d[\w.+-]*|[\dA-F]+h)", "…": r"((?:(?!: ).)+?)"}
_WORDS: Final = re.compile("[a-z]{3}")
_JOINED: Final = re.compile("[:;] ")
_DEEPEST: Final = 8

Pair = tuple[str, str]


def read(path: Path) -> list[Pair]:
    return [(english, other) for english, other in json.loads(path.read_text(encoding="utf-8"))]


def is_looked_up(name: str) -> bool:
    return name == name.upper()


class Phrase:
    def __init__(self, english: str, other: str) -> None:
        self.english, self.other = english, other
        self.names = [slot[1] for slot in SLOT.finditer(english)]
        pattern, begin = "", 0
        for slot in SLOT.finditer(english):
            kind = "…" if is_looked_up(slot[1]) else slot[2]
            pattern += re.escape(english[begin : slot.start()]) + _HOLDS[kind]
            begin = slot.end()
        self.match = re.compile(pattern + re.escape(english[begin:]), re.DOTALL | re.ASCII).fullmatch


class Book:
    """``unknown`` has what the last text had that no phrase is for."""

    def __init__(self, pairs: Sequence[Pair]) -> None:
        self._whole = {english: other for english, other in pairs if "{" not in english}
        self.slotted = [Phrase(*pair) for pair in pairs if "{" in pair[0]]
        self.unknown: list[str] = []

    def said(self, text: str) -> str:
        self.unknown = []
        return self._of_text(text, 0)

    def first(self, part: str) -> Phrase | None:
        """The phrase with slots that is taken for ``part``; None where it has one without, or none."""
        if part in self._whole:
            return None
        return next((phrase for phrase in self.slotted if phrase.match(part)), None)

    def _of_text(self, text: str, depth: int) -> str:
        if depth > _DEEPEST:
            return text
        head, inner = _aside(text)
        if _JOINED.search(inner):
            return f"{self._of_text(head, depth)} ({self._of_text(inner, depth + 1)})"
        return "; ".join(self._of_part(part, depth) for part in text.split("; "))

    def _of_part(self, part: str, depth: int) -> str:
        phrase = self._of_phrase(part, depth)
        if phrase is not None:
            return phrase
        parts = part.split(", ")
        if len(parts) > 1 and all(self._has(one) for one in parts):
            return ", ".join(self._of_item(one, depth) for one in parts)
        for mark in (": ", ". "):
            if mark in part:
                head, _, tail = part.partition(mark)
                return f"{self._of_part(head, depth)}{mark}{self._of_part(tail, depth)}"
        head, inner = _aside(part)
        if inner:
            return f"{self._of_part(head, depth)} ({self._of_text(inner, depth + 1)})"
        self.unknown.append(part)
        return part

    def _has(self, item: str) -> bool:
        heads = item, _aside(item)[0]
        return not _WORDS.search(item) or any(one in self._whole or self.first(one) for one in heads)

    def _of_item(self, item: str, depth: int) -> str:
        phrase = self._of_phrase(item, depth)
        if phrase is not None or not _WORDS.search(item):
            return phrase or item
        head, inner = _aside(item)
        return f"{self._of_phrase(head, depth)} ({self._of_text(inner, depth + 1)})"

    def _of_phrase(self, part: str, depth: int) -> str | None:
        if part in self._whole:
            return self._whole[part]
        phrase = self.first(part)
        if phrase is None:
            return None
        found = phrase.match(part)
        assert found
        held = dict(zip(phrase.names, found.groups(), strict=True))

        def filled(slot: re.Match[str]) -> str:
            name = slot[1]
            return self._of_text(held[name], depth + 1) if is_looked_up(name) else held[name]

        return SLOT.sub(filled, phrase.other)


def _aside(text: str) -> tuple[str, str]:
    """Text before the brackets at the end of ``text``, and the one in them."""
    if text.endswith(")"):
        opened = 0
        for at in range(len(text) - 1, 0, -1):
            opened += (text[at] == ")") - (text[at] == "(")
            if not opened:
                return (text[: at - 1], text[at + 1 : -1]) if text[at - 1] == " " else (text, "")
    return text, ""
