"""The line of each key of a TOML file, which tomllib does not give.

Reads text that tomllib has accepted, so it only has to find keys, not to validate (TOML v1.0.0).
"""

from __future__ import annotations

import re
import tomllib
from bisect import bisect_left
from typing import Final

Key = tuple[int | str, ...]

_BLANK: Final = re.compile(r"(?:[ \t\r\n]|#[^\n]*)*")
_KEY: Final = re.compile(r'[A-Za-z0-9_-]+|"(?:[^"\\\n]|\\.)*"|\'[^\'\n]*\'')
_DOT: Final = re.compile(r"[ \t]*\.[ \t]*")
_STRING: Final = re.compile(
    r'"""(?:\\.|[^\\])*?"{3,5}|\'\'\'.*?\'{3,5}|"(?:[^"\\\n]|\\.)*"|\'[^\'\n]*\'', re.DOTALL
)
_SCALAR: Final = re.compile(r"[^,\]}\n#]*")


def key_lines(text: str) -> dict[Key, int]:
    """Each key, table and list item of ``text`` with its line, counted from 1."""
    return _Scanner(text).scan()


class _Scanner:
    def __init__(self, text: str) -> None:
        self._text = text
        self._at = 0
        self._line_ends = [place for place, char in enumerate(text) if char == "\n"]
        self._lines: dict[Key, int] = {}
        self._items: dict[Key, int] = {}
        """Number of [[tables]] so far, by the name of the list."""

    def scan(self) -> dict[Key, int]:
        table: Key = ()
        while self._skip_blank():
            if self._text[self._at] == "[":
                table = self._header()
            else:
                self._assignment(table)
        return self._lines

    def _skip_blank(self) -> bool:
        """Go to the next thing that is neither blank nor comment; False at the end."""
        self._take(_BLANK)
        return self._at < len(self._text)

    def _take(self, pattern: re.Pattern[str]) -> str:
        match = pattern.match(self._text, self._at)
        self._at = match.end() if match else self._at
        return match[0] if match else ""

    def _note(self, key: Key, at: int) -> None:
        self._lines.setdefault(key, bisect_left(self._line_ends, at) + 1)

    def _name(self) -> list[str]:
        """A key, dotted or not."""
        names = [self._part()]
        while self._take(_DOT):
            names.append(self._part())
        return names

    def _part(self) -> str:
        text = self._take(_KEY)
        return tomllib.loads(f"key = {text}")["key"] if text[:1] in ('"', "'") else text

    def _header(self) -> Key:
        start = self._at
        is_item = self._text.startswith("[[", start)
        self._at += 2 if is_item else 1
        self._skip_blank()
        *parents, last = self._name()
        self._skip_blank()
        self._at += 2 if is_item else 1
        key = self._inside((), parents)
        if is_item:
            name = (*key, last)
            self._items[name] = self._items.get(name, 0) + 1
            self._note(name, start)
            key = (*name, self._items[name] - 1)
        else:
            key = self._inside(key, [last])
        self._note(key, start)
        return key

    def _inside(self, key: Key, names: list[str]) -> Key:
        """``key`` and ``names`` after it; the name of a list of tables means its last one so far."""
        for name in names:
            key = (*key, name)
            if key in self._items:
                key = (*key, self._items[key] - 1)
        return key

    def _assignment(self, table: Key) -> None:
        start = self._at
        key = table
        for name in self._name():
            key = (*key, name)
            self._note(key, start)
        self._skip_blank()
        self._at += 1  # the equals sign
        self._skip_blank()
        self._value(key)

    def _value(self, key: Key) -> None:
        match self._text[self._at]:
            case "[":
                self._list(key)
            case "{":
                self._inline_table(key)
            case '"' | "'":
                self._take(_STRING)
            case _:
                self._take(_SCALAR)

    def _list(self, key: Key) -> None:
        self._at += 1
        position = 0
        while self._skip_blank() and self._text[self._at] != "]":
            self._note((*key, position), self._at)
            self._value((*key, position))
            position += 1
            self._skip_comma()
        self._at += 1

    def _inline_table(self, key: Key) -> None:
        self._at += 1
        while self._skip_blank() and self._text[self._at] != "}":
            self._assignment(key)
            self._skip_comma()
        self._at += 1

    def _skip_comma(self) -> None:
        if self._skip_blank() and self._text[self._at] == ",":
            self._at += 1
