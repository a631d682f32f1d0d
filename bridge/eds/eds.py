"""EDS and DCF (CiA 306) into a ``Description``."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from typing import Final

from bridge.eds.fields import Fields
from bridge.eds.ini import SPELLING, Section, read_sections, shown, stripped
from bridge.eds.model import Commissioning, Description, DeviceInfo, Object, Report
from bridge.eds.modules import Modules
from bridge.eds.objects import ObjectReader
from bridge.eds.pdos import add_compact_pdos
from bridge.eds.text_file import lines
from bridge.text import Said, Text

_INDEX: Final = re.compile(r"(?:0x)?([0-9a-f]{1,4})")
_SUB: Final = re.compile(r"(?:0x)?([0-9a-f]{1,4})sub(?:0x)?([0-9a-f]{1,2})")
_TABLE: Final = re.compile(r"(?:0x)?([0-9a-f]{1,4})(name|value)")
_OF_OBJECT: Final = re.compile(r"(?:0x)?[0-9a-f]{1,4}(?:sub|name|value|denotation|objectlinks|$)")
"""Names of the sections that an object has."""
_FIRST_OBJECT: Final = 0x1000
"""Lower indices are data types, not objects of the device."""
_LISTS: Final = ("MandatoryObjects", "OptionalObjects", "ManufacturerObjects")
_KBIT_S: Final = (10, 20, 50, 100, 125, 250, 500, 800, 1000)
_COMMISSIONING: Final = ("devicecomissioning", "devicecommissioning")
"""CiA 306 spells it with one m, tools with two."""


def read_eds(text: str, report: Report, names: Sequence[str] = ()) -> Description:
    """Everything that can be read from ``text``, with the modules that are plugged in, in their order; the
    report has what cannot. Raises ``UnknownModule``."""
    all_lines = lines(text)
    sections = read_sections(all_lines, report)
    modules = Modules(sections, report)
    plugged = tuple(modules.find(name) for name in names) or modules.connected()
    extended = modules.plug(plugged, anew=bool(names))
    if modules.known and not plugged:
        report.warning(modules.line, Text.of("eds.none_plugged", count=len(modules.known)))
    reader = _EdsReader(sections, report, modules.brought)
    objects = reader.objects()
    if stripped(all_lines[-1]) and (lost := reader.lost(all_lines)):
        report.breaks_off(len(all_lines), Text.of("eds.ends_within_line", lost=lost))
    commissioning = reader.commissioning()
    return Description(
        format=reader.format(objects),
        device_info=reader.device_info(),
        commissioning=commissioning,
        objects=tuple(objects[index] for index in sorted(objects)),
        modules=modules.known,
        plugged=plugged,
        extended=extended,
    )


def _index(text: str) -> int | None:
    match = _INDEX.fullmatch(text.lower())
    return int(match[1], 16) if match else None


def _is_end(all_lines: Sequence[str]) -> bool:
    """Whether the last line may well be the end of the file: other sections end in the same, or no object
    is described there."""
    before, name, ends = "", "", set[str]()
    for line in map(stripped, all_lines):
        if line.startswith("["):
            ends.add(before)
            name = re.sub(r"\s+", "", line[1:].partition("]")[0]).lower()
        before = line if line and line[0] not in ";#" else before
    is_of_objects = _OF_OBJECT.match(name) is not None or name in (one.lower() for one in _LISTS)
    return before in ends or not is_of_objects


class _EdsReader:
    def __init__(self, sections: dict[str, Section], report: Report, brought: Collection[int]) -> None:
        """``brought`` are the objects that stand in no list, for they come with modules."""
        self._sections = sections
        self._report = report
        self._brought = brought
        self._fields = Fields(report)
        self._roots: dict[int, Section] = {}
        self._subs: dict[int, dict[int, Section]] = {}
        self._tables: dict[tuple[int, str], Section] = {}
        self._sort()

    def _sort(self) -> None:
        for key, section in self._sections.items():
            if match := _INDEX.fullmatch(key):
                self._once(self._roots, int(match[1], 16), section)
            elif match := _SUB.fullmatch(key):
                self._once(self._subs.setdefault(int(match[1], 16), {}), int(match[2], 16), section)
            elif match := _TABLE.fullmatch(key):
                self._tables[int(match[1], 16), match[2]] = section

    def lost(self, all_lines: Sequence[str]) -> Said:
        """Evidence that a file whose last line has no end went on; empty where there is none: editors leave
        that end out."""
        last = stripped(all_lines[-1])
        if last.startswith("[") and "]" not in last:
            return Text.of("eds.lost_bracket", line=shown(last))
        if "=" not in last and not last.startswith(("[", ";", "#")) and self._begins_key(last):
            return Text.of("eds.lost_value", line=shown(last))
        if _is_end(all_lines):
            return ""
        for name in _LISTS:
            section = self._sections.get(name.lower())
            listed = [_index(text.text) for _, text in section.numbered()] if section else []
            index = listed[-1] if listed else None
            if index is not None and index not in self._roots:
                return Text.of("eds.lost_object", object=f"{index:04X}h", section=name)
        return ""

    def _begins_key(self, text: str) -> bool:
        """Whether it is how a key begins, and no remark."""
        begin = text.lower()
        keys = (key for section in self._sections.values() for key in section.keys)
        return begin.isdigit() or any(key.startswith(begin) for key in (*keys, *SPELLING))

    def _once(self, place: dict[int, Section], number: int, section: Section) -> None:
        """[1018sub1] and [1018sub01] are the same entry."""
        first = place.setdefault(number, section)
        if first is not section:
            said = Text.of("eds.section_again", section=shown(section.name), first=shown(first.name))
            self._report.error(section.line, said)

    def format(self, objects: dict[int, Object]) -> str:
        configured = any(e.parameter_value is not None for o in objects.values() for e in o.entries)
        return "DCF" if configured or any(name in self._sections for name in _COMMISSIONING) else "EDS"

    def device_info(self) -> DeviceInfo:
        section = self._sections.get("deviceinfo")
        if section is None:
            self._report.warning(0, Text.of("eds.no_device_info"))
            return DeviceInfo()
        fields = self._fields
        return DeviceInfo(
            vendor=section.text("VendorName"),
            vendor_id=fields.number(section, "VendorNumber"),
            product=section.text("ProductName"),
            product_code=fields.number(section, "ProductNumber"),
            revision=fields.number(section, "RevisionNumber"),
            order_code=section.text("OrderCode"),
            bitrates=tuple(1000 * rate for rate in _KBIT_S if fields.flag(section, f"BaudRate_{rate}")),
        )

    def commissioning(self) -> Commissioning:
        found = [self._sections[name] for name in _COMMISSIONING if name in self._sections]
        if not found:
            return Commissioning()
        kbit_s = self._fields.number(found[0], "Baudrate", 0, 1000)
        return Commissioning(
            node_id=self._fields.number(found[0], "NodeID", 1, 127),
            node_name=found[0].text("NodeName"),
            bitrate=1000 * kbit_s if kbit_s else None,
        )

    def objects(self) -> dict[int, Object]:
        reader = ObjectReader(self._fields, self._report, self._roots, self._subs, self._tables)
        for index in sorted(set(self._subs) - set(self._roots)):
            line = min(section.line for section in self._subs[index].values())
            self._report.warning(line, Text.of("eds.no_section", index=f"{index:04X}"))
            self._roots[index] = Section(f"{index:04X}", line)
        found = {index: reader.read(index) for index in sorted(self._roots) if index >= _FIRST_OBJECT}
        info = self._sections.get("deviceinfo")
        if info:
            add_compact_pdos(info, found, self._fields, self._report)
        self._check_lists(found)
        return found

    def _check_lists(self, found: dict[int, Object]) -> None:
        """Compare the lists of objects with the objects described; the descriptions count."""
        listed: dict[int, int] = {}
        for name in _LISTS:
            section = self._sections.get(name.lower())
            if section is None:
                continue
            values = list(section.numbered())
            for number, text in values:
                index = self._fields.whole(text, f"[{name}] {number}")
                if index is None:
                    continue
                if index in listed:
                    said = Text.of("eds.listed_again", object=f"{index:04X}h", first_line=listed[index])
                    self._report.warning(text.line, said)
                listed.setdefault(index, text.line)
                if index not in found:
                    said = Text.of("eds.listed_not_described", object=f"{index:04X}h")
                    self._report.error(text.line, said)
            count = self._fields.number(section, "SupportedObjects", 0, 0xFFFF)
            if count is not None and count != len(values):
                said = Text.of("eds.list_count", section=name, count=count, listed=len(values))
                self._report.warning(section.line, said)
        for index in found:
            if index in self._roots and index not in listed and index not in self._brought:
                said = Text.of("eds.not_listed", object=f"{index:04X}h")
                self._report.warning(self._roots[index].line, said)
