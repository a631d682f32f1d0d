"""One object of an EDS with its sub-indices (CiA 306 §4.6.3)."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from bridge.eds.fields import Fields
from bridge.eds.ini import IniValue, Section
from bridge.eds.model import Access, Entry, Object, ObjectType, Report, StaticDataType, count_entry
from bridge.text import Text

_MOST_SUBS: Final = 254
_REFUSES_DOWNLOAD: Final = 1
_LONGEST_TYPE: Final = 0x1B
_MOST_COMPACT: Final = 100_000
"""Entries that CompactSubObj may create per file: a few lines can ask for millions."""


class ObjectReader:
    """Builds objects from the sections of a file; ``roots`` and ``subs`` are by index and sub-index."""

    def __init__(
        self,
        fields: Fields,
        report: Report,
        roots: dict[int, Section],
        subs: dict[int, dict[int, Section]],
        tables: dict[tuple[int, str], Section],
    ) -> None:
        self._fields = fields
        self._report = report
        self._roots = roots
        self._subs = subs
        self._tables = tables
        self._compact_left = _MOST_COMPACT

    def read(self, index: int) -> Object:
        root = self._roots[index]
        subs = self._subs.get(index, {})
        name = self._name(root, f"{index:04X}h")
        compact = self._fields.number(root, "CompactSubObj", 0, _MOST_SUBS) or 0
        if compact > self._compact_left:
            self._report.error(root.line, Text.of("eds.too_many_compact", object=f"{index:04X}h"))
            compact = 0
        self._compact_left -= compact
        kind = self._object_type(index, root, bool(subs or compact))
        if not kind.has_subs:
            return Object(index, name, kind, (self._entry(root, index, 0, name, Access.RW),))
        entries = self._compact(index, root, name, compact) if compact else {}
        fallback = self._element_type(root, subs)
        for sub in sorted(subs):
            entries[sub] = self._sub(index, sub, subs[sub], fallback)
        count = self._fields.number(root, "SubNumber", 0, 255)
        if count is not None and not compact and count != len(subs):
            said = Text.of("eds.sub_count", object=f"{index:04X}h", count=count, there=len(subs))
            self._report.warning(root.line, said)
        if not entries:
            self._report.error(root.line, Text.of("eds.no_subs", object=f"{index:04X}h"))
        elif 0 not in entries:
            self._report.warning(root.line, Text.of("eds.no_sub_0", object=f"{index:04X}h"))
            entries[0] = count_entry(index, max(entries), root.line)
        return Object(index, name, kind, tuple(entries[sub] for sub in sorted(entries)))

    def _name(self, section: Section, number: str) -> str:
        name = section.text("ParameterName")
        if not name:
            self._report.warning(section.line, Text.of("eds.no_name", object=number))
        return name or number

    def _object_type(self, index: int, root: Section, has_subs: bool) -> ObjectType:
        """VAR if it is missing (CiA 306 §4.6.3.2), unless there are sub-indices."""
        likely = ObjectType.RECORD if has_subs else ObjectType.VAR
        code = self._fields.number(root, "ObjectType")
        if code is None:
            if has_subs:
                self._report.warning(root.line, Text.of("eds.no_object_type", object=f"{index:04X}h"))
            return likely
        known = code in {int(kind) for kind in ObjectType}
        kind = ObjectType(code) if known else likely
        if not known:
            said = Text.of("eds.object_type", object=f"{index:04X}h", code=code, taken=likely.name)
            self._report.warning(root.line, said)
        elif has_subs and not kind.has_subs:
            said = Text.of("eds.has_subs", object=f"{index:04X}h", kind=kind.name)
            self._report.warning(root.line, said)
            return likely
        return kind

    def _element_type(self, root: Section, subs: dict[int, Section]) -> IniValue | None:
        """The type of an array's elements, for those that do not say."""
        return root.get("DataType") or (subs[1].get("DataType") if 1 in subs else None)

    def _sub(self, index: int, sub: int, section: Section, fallback: IniValue | None) -> Entry:
        name = self._name(section, f"{index:04X}h:{sub:02X}")
        return self._entry(section, index, sub, name, Access.RW if sub else Access.RO, fallback)

    def _entry(
        self,
        section: Section,
        index: int,
        sub: int,
        name: str,
        access: Access,
        fallback: IniValue | None = None,
    ) -> Entry:
        fields = self._fields
        whose = f"{index:04X}h:{sub:02X}" if sub or section.name.lower().find("sub") > 0 else f"{index:04X}h"
        data_type = self._data_type(section, whose, sub, fallback)
        if section.get("DownloadFile"):
            self._report.warning(section.line, Text.of("eds.download_file", object=whose))
        return Entry(
            index,
            sub,
            name,
            data_type,
            fields.access(section.get("AccessType"), access, section.line, whose),
            default=fields.value(section, "DefaultValue", data_type),
            parameter_value=fields.value(section, "ParameterValue", data_type),
            low=fields.value(section, "LowLimit", data_type),
            high=fields.value(section, "HighLimit", data_type),
            pdo_mappable=fields.flag(section, "PDOMapping"),
            refuses_download=bool((fields.number(section, "ObjFlags") or 0) & _REFUSES_DOWNLOAD),
            line=section.line,
        )

    def _data_type(
        self, section: Section, whose: str, sub: int, fallback: IniValue | None
    ) -> StaticDataType | None:
        found = section.get("DataType")
        if found is None:
            if section.get("ObjectType") and self._fields.number(section, "ObjectType") == ObjectType.DOMAIN:
                return StaticDataType.DOMAIN
            if sub == 0 and "sub" in section.name.lower():
                taken = StaticDataType.UNSIGNED8
                said = Text.of("eds.no_data_type_taken", object=whose, taken=taken.name)
                self._report.warning(section.line, said)
                return taken
            if fallback is None:
                self._report.error(section.line, Text.of("eds.no_data_type", object=whose))
                return None
        text = found or fallback
        code = self._fields.whole(text, "DataType") if text else None
        code = self._named_type(code)
        if code is not None and code in {int(one) for one in StaticDataType}:
            data_type = StaticDataType(code)
            if found is None:
                said = Text.of("eds.data_type_of_others", object=whose, taken=data_type.name)
                self._report.warning(section.line, said)
            return data_type
        if code is not None and text:
            said = Text.of("eds.data_type", object=whose, code=f"0x{code:X}")
            self._report.error(text.line, said)
        return None

    def _named_type(self, code: int | None) -> int | None:
        """A type that the file itself defines, as CANFestival does for types with limits: [A0] with
        [A0sub1]."""
        if code is None or code <= _LONGEST_TYPE or code not in self._subs:
            return code
        base = self._subs[code].get(1)
        return self._fields.number(base, "DefaultValue") if base else code

    def _compact(self, index: int, root: Section, name: str, count: int) -> dict[int, Entry]:
        """Sub-indices that are not written out (CiA 306 §4.6.3.3), with their names and values."""
        names, values = self._tables.get((index, "name")), self._tables.get((index, "value"))
        element = self._entry(root, index, 1, name, Access.RW)
        entries = {0: count_entry(index, count, root.line)}
        named = dict(names.numbered()) if names else {}
        given = dict(values.numbered()) if values else {}
        for table, kind in ((named, "Name"), (given, "Value")):
            for sub, text in table.items():
                if not 1 <= sub <= count:
                    section = f"{index:04X}{kind}"
                    said = Text.of("eds.beyond_compact", section=section, sub=sub, count=count)
                    self._report.warning(text.line, said)
        for sub in range(1, count + 1):
            own = (
                self._fields.value_of(given[sub], f"[{index:04X}Value] {sub}", element.data_type)
                if sub in given
                else None
            )
            entries[sub] = replace(
                element,
                sub=sub,
                name=named[sub].text if sub in named else f"{name}{sub}",
                parameter_value=own or element.parameter_value,
            )
        return entries
