"""Sections and keys of an EDS, each with its line (CiA 306 §4.2), from text that need not be well formed."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import Final

from bridge.eds.model import Report
from bridge.text import Text

SPELLING: Final = {
    name.lower(): name
    for name in (
        *("ParameterName", "ObjectType", "DataType", "AccessType", "DefaultValue", "PDOMapping"),
        *("SubNumber", "LowLimit", "HighLimit", "ParameterValue", "ObjFlags", "CompactSubObj"),
        *("SupportedObjects", "NrOfEntries", "Denotation"),
        *("VendorName", "VendorNumber", "ProductName", "ProductNumber", "RevisionNumber", "OrderCode"),
        *("CompactPDO", "NodeID", "NodeName", "Baudrate"),
    )
}
"""Keys as CiA 306 writes them."""


@dataclass(frozen=True, slots=True)
class IniValue:
    """A value as written in the file."""

    text: str
    line: int


@dataclass(slots=True)
class Section:
    """``name`` as written; ``keys`` in lower case, in the order of the file."""

    name: str
    line: int
    keys: dict[str, IniValue] = field(default_factory=dict[str, IniValue])

    def get(self, name: str) -> IniValue | None:
        """The value of ``name``, or None if it is missing or empty."""
        found = self.keys.get(name.lower())
        return found if found and found.text else None

    def text(self, name: str) -> str:
        found = self.keys.get(name.lower())
        return found.text if found else ""

    def numbered(self) -> Iterator[tuple[int, IniValue]]:
        """The keys that are plain numbers, with their values."""
        for key, value in self.keys.items():
            if key.isascii() and key.isdigit() and len(key) <= 4:
                yield int(key), value


def read_sections(lines: Iterable[str], report: Report) -> dict[str, Section]:
    """Sections by their name in lower case without blanks."""
    return _IniReader(report).read(lines)


class _IniReader:
    def __init__(self, report: Report) -> None:
        self._report = report
        self._sections: dict[str, Section] = {}
        self._section: Section | None = None
        self._other_spelling: list[tuple[int, str]] = []

    def read(self, lines: Iterable[str]) -> dict[str, Section]:
        for number, line in enumerate(lines, start=1):
            line = stripped(line)
            if line and line[0] not in ";#":
                self._line(line, number)
        if self._other_spelling:
            number, key = self._other_spelling[0]
            count = len(self._other_spelling)
            said = Text.of(
                "eds.spelling_one" if count == 1 else "eds.spelling_many",
                count=count,
                key=key,
                taken=SPELLING[key.lower()],
            )
            self._report.warning(number, said)
        return self._sections

    def _line(self, line: str, number: int) -> None:
        if line.startswith("["):
            self._header(line, number)
            return
        key, equals, value = line.partition("=")
        key = key.strip()
        if not equals or not key:
            self._report.error(number, Text.of("eds.neither", line=shown(line)))
        elif self._section is None:
            self._report.error(number, Text.of("eds.before_sections", key=shown(key)))
        else:
            self._assign(self._section, key, value.strip(), number)

    def _header(self, line: str, number: int) -> None:
        name, bracket, rest = line[1:].partition("]")
        if not bracket:
            self._report.warning(number, Text.of("eds.no_bracket", line=shown(line)))
        elif rest.strip() and rest.strip()[0] not in ";#":
            self._report.warning(number, Text.of("eds.behind_section", rest=shown(rest.strip())))
        name = re.sub(r"\s+", "", name)
        key = name.lower()
        first = self._sections.get(key)
        if first:
            said = Text.of("eds.section_joined", section=shown(name), first_line=first.line)
            self._report.warning(number, said)
        else:
            self._sections[key] = Section(name, number)
        self._section = self._sections[key]

    def _assign(self, section: Section, key: str, value: str, number: int) -> None:
        name = key.lower()
        if name in SPELLING and key != SPELLING[name]:
            self._other_spelling.append((number, key))
        first = section.keys.get(name)
        if first and first.text:
            self._again(section, key, value, number, first)
            return
        section.keys[name] = IniValue(value, number)

    def _again(self, section: Section, key: str, value: str, number: int, first: IniValue) -> None:
        """Report a key that has its value already: that counts, as for Windows, for which these tools were
        made."""
        name, first_line = shown(section.name), first.line
        if value in (first.text, ""):
            said = Text.of("eds.key_again", key=shown(key), section=name, first_line=first_line)
            self._report.warning(number, said)
            return
        said = Text.of(
            "eds.key_again_otherwise",
            key=shown(key),
            section=name,
            first_line=first_line,
            counts=shown(first.text),
            other=shown(value),
        )
        self._report.error(number, said)


def stripped(line: str) -> str:
    """``line`` without what means nothing at its ends; 1Ah ended the files of old editors."""
    return line.strip(" \t\0\x1a\ufeff")


def shown(text: str) -> str:
    """``text`` for a message: short, and without characters that disturb a terminal."""
    clean = "".join(char if char.isprintable() else "�" for char in text[:60])
    return clean + ("…" if len(text) > 60 else "")
