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
        return "; ".join(self._of_part(part, depth) for part in text.split("; "))

    def _of_part(self, part: str, depth: int) -> str:
        phrase = self._of_phrase(part, depth)
        if phrase is not None:
            return phrase
        parts = part.split(", ")
        if len(parts) > 1 and all(self._has(one) or not _WORDS.search(one) for one in parts):
            found = (self._of_phrase(one, depth) for one in parts)
            return ", ".join(one if other is None else other for one, other in zip(parts, found, strict=True))
        for mark in (": ", ". "):
            if mark in part:
                head, _, tail = part.partition(mark)
                return f"{self._of_head(head, depth)}{mark}{self._of_part(tail, depth)}"
        self.unknown.append(part)
        return part

    def _of_head(self, head: str, depth: int) -> str:
        found = self._of_phrase(head, depth)
        if found is None:
            self.unknown.append(head)
            return head
        return found

    def _has(self, part: str) -> bool:
        return part in self._whole or self.first(part) is not None

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
