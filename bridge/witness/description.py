"""Reader of device descriptions for the witness: names, types and numbers of their objects.

EDS and DCF (CiA 306 §4), XDD and XDC (CiA 311). Not more than it takes to know which RPDO carries which
outputs and what the node does with them: a file that is odd otherwise is read all the same.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final
from xml.etree import ElementTree

from bridge.witness.plugged_modules import Sections, plug

At = tuple[int, int]
"""Index and sub-index."""
_SECTION: Final = re.compile(r"\[\s*([0-9a-f]{1,4})\s*(?:sub\s*([0-9a-f]{1,2}))?\s*\]", re.IGNORECASE)
_INTEGER: Final = re.compile(r"0x([0-9a-f]+)|([0-9]+)|([0-9][0-9a-f]*)h", re.IGNORECASE)
_NODE_ID: Final = re.compile(r"\$?NODE_?ID", re.IGNORECASE)
_XML_KEYS: Final = {
    "name": "parametername",
    "dataType": "datatype",
    "defaultValue": "defaultvalue",
    "actualValue": "parametervalue",
}
"""Keys of an EDS by the attributes that mean the same."""


class Unreadable(Exception):
    """The file is no device description."""


@dataclass(frozen=True, slots=True)
class DictionaryEntry:
    """One object, or one element of it. ``data_type`` is its code (CiA 301 §7.4.7), ``number`` what it holds
    as far as the file says; ``is_configured`` where that is a ParameterValue."""

    name: str
    data_type: int | None
    number: int | None
    is_configured: bool


@dataclass(frozen=True, slots=True)
class ObjectDictionary:
    """``entries`` by index and sub-index; ``names`` of the objects that have elements, by index;
    ``by_modules`` are the elements that plugged modules bring and that an RPDO may set."""

    entries: Mapping[At, DictionaryEntry]
    names: Mapping[int, str]
    by_modules: frozenset[At] = frozenset()

    def number(self, index: int, sub: int) -> int | None:
        entry = self.entries.get((index, sub))
        return entry.number if entry else None

    def title(self, at: At) -> str:
        """Name of an element, after that of its object unless it begins with it."""
        entry, whole = self.entries[at], self.names.get(at[0], "")
        return entry.name if entry.name.lower().startswith(whole.lower()) else f"{whole} {entry.name}"


def describe(content: bytes, node_id: int, modules: Sequence[str] = ()) -> ObjectDictionary:
    """Description of the node with this id and these modules. Raises ``Unreadable``."""
    text = _decoded(content)
    is_xml = text.lstrip().startswith("<")
    sections = _xml(text) if is_xml else dict(_ini(text))
    by_modules = frozenset[At]() if is_xml else plug(sections, text, modules)
    if not sections:
        raise Unreadable("describes no objects")
    parts = {index for index, sub in sections if sub is not None}
    names = {index: sections.get((index, None), {}).get("parametername", "") for index in parts}
    entries: dict[At, DictionaryEntry] = {}
    for (index, sub), keys in sections.items():
        if sub is not None or index not in parts:
            kind = keys.get("datatype") or sections.get((index, None), {}).get("datatype")
            kind = kind or sections.get((index, 1), {}).get("datatype", "")
            given = keys.get("parametervalue", "")
            number = _number(given or keys.get("defaultvalue", ""), node_id)
            name = keys.get("parametername", "")
            entries[index, sub or 0] = DictionaryEntry(name, _number(kind, node_id), number, bool(given))
    return ObjectDictionary(entries, names, by_modules)


def _decoded(content: bytes) -> str:
    """Text of a file: UTF-8, or UTF-16 with its mark; a line that is no UTF-8 is Windows-1252."""
    if content[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return content.decode("utf-16", "replace")
    lines = content.removeprefix(b"\xef\xbb\xbf").splitlines(keepends=True)
    return "".join(map(_line, lines))


def _line(content: bytes) -> str:
    try:
        return content.decode("utf-8")
    except UnicodeDecodeError:
        return content.decode("cp1252", "replace")


def _ini(text: str) -> Iterator[tuple[tuple[int, int | None], dict[str, str]]]:
    """Sections of objects and elements, with their keys in lower case. Of duplicates the first counts."""
    found: Sections = {}
    keys: dict[str, str] | None = None
    for line in (one.strip() for one in re.split(r"\r\n|\n|\r", text)):
        if line.startswith("["):
            match = _SECTION.match(line)
            keys = None
            if match:
                sub = None if match[2] is None else int(match[2], 16)
                keys = found.setdefault((int(match[1], 16), sub), {})
        elif keys is not None:
            key, _, value = line.partition("=")
            if value.strip():
                keys.setdefault(key.strip().lower(), value.strip())
    yield from found.items()


def _xml(text: str) -> Sections:
    if "<!DOCTYPE" in text:
        raise Unreadable("has a document type")
    try:
        root = ElementTree.fromstring(text.encode())
    except ElementTree.ParseError as error:
        raise Unreadable(str(error)) from error
    found: Sections = {}
    for element in root.iter():
        if element.tag.rpartition("}")[2] == "CANopenObject":
            index = _hexadecimal(element, "index")
            found.setdefault((index, None), _keys(element))
            for child in element:
                if child.tag.rpartition("}")[2] == "CANopenSubObject":
                    found.setdefault((index, _hexadecimal(child, "subIndex")), _keys(child))
    return found


def _hexadecimal(element: ElementTree.Element, name: str) -> int:
    text = element.get(name, "")
    try:
        return int(text, 16)
    except ValueError:
        raise Unreadable(f'{name} = "{text}" is no number') from None


def _keys(element: ElementTree.Element) -> dict[str, str]:
    keys = {key: element.get(name, "") for name, key in _XML_KEYS.items()}
    if keys["datatype"]:
        # Hexadecimal with or without 0x (CiA 311).
        keys["datatype"] = f"0x{keys['datatype'].lower().removeprefix('0x')}"
    return keys


def _number(text: str, node_id: int) -> int | None:
    """Integer, to which the node id may be added; None for anything else."""
    total = 0
    for term in re.sub(r"[\s()]", "", text.partition(";")[0]).split("+"):
        if _NODE_ID.fullmatch(term):
            total += node_id
            continue
        negative, bare = term.startswith("-"), term.removeprefix("-")
        match = _INTEGER.fullmatch(bare)
        if not match:
            return None
        hexadecimal, decimal, assembler = match.groups()
        number = int(decimal) if decimal else int(hexadecimal or assembler, 16)
        total += -number if negative else number
    return total
