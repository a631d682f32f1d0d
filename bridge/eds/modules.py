"""The modules of a modular device (CiA 306): those that its EDS knows, and what becomes of its objects
with some of them plugged in.

A module brings objects of its own, which are there once however often it is plugged in (``[MxFixedxxxx]``),
and elements of objects that modules share (``[MxSubExtxxxx]``): ``Count=2`` is two elements for each,
``Count=0;4`` four bits, so that two such modules share an element of eight. ``ObjExtend`` is the last
sub-index after which the next object goes on.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from bridge.eds.fields import Fields
from bridge.eds.ini import IniValue, Section, shown
from bridge.eds.model import Module, ObjectType, Report, StaticDataType
from bridge.eds.value_text import bits_of_type
from bridge.text import Text

_PART: Final = re.compile(
    r"m([0-9]{1,5})(moduleinfo|fixed([0-9a-f]{4}(?:sub[0-9a-f]{1,2})?)|subext([0-9a-f]{4}))"
)
_COUNT: Final = re.compile(r"([0-9]{1,3})(?:;([0-9]{1,4}))?")
_OF_THE_EXTENSION: Final = frozenset({"count", "objextend", "subnumber", "objecttype", "parametername"})
_HIGHEST: Final = 254
_MOST_ELEMENTS: Final = 10_000
"""Elements that modules may bring to one device."""
_SUPPORTED: Final = "supportedmodules"
_CONNECTED: Final = "connectedmodules"


class UnknownModule(Exception):
    """A module that the file does not have; ``hint`` says which there are."""

    def __init__(self, name: str, hint: Text) -> None:
        self.said = Text.of("eds.no_module", module=shown(name))
        super().__init__(self.said)
        self.hint = hint


@dataclass(frozen=True, slots=True)
class _Extension:
    """Elements that a module brings to an object: whole ones, or bits of shared ones of ``width`` bits."""

    elements: int
    bits: int
    width: int
    last: int
    """The last sub-index before the next object goes on; 0 where none does."""


class Modules:
    """The modules in the ``sections`` of a file."""

    def __init__(self, sections: dict[str, Section], report: Report) -> None:
        self._sections = sections
        self._report = report
        self._fields = Fields(report)
        self._info: dict[int, Section] = {}
        self._fixed: dict[int, list[tuple[str, Section]]] = {}
        self._extensions: dict[int, list[tuple[int, Section]]] = {}
        for key, section in sections.items():
            if match := _PART.fullmatch(key):
                number = int(match[1])
                if match[3]:
                    self._fixed.setdefault(number, []).append((match[3], section))
                elif match[4]:
                    self._extensions.setdefault(number, []).append((int(match[4], 16), section))
                else:
                    self._info[number] = section
        self.known = tuple(self._module(number) for number in sorted(self._info))
        self.line = min((section.line for section in self._info.values()), default=0)
        """First line of the modules in the file."""
        self.brought: set[int] = set()
        """Objects that are there by what is plugged in alone."""

    def _module(self, number: int) -> Module:
        info = self._info[number]
        return Module(number, info.text("ProductName"), info.text("OrderCode"))

    def connected(self) -> tuple[int, ...]:
        """Modules that the file itself says are plugged in, in their order, as a DCF does."""
        section = self._sections.get(_CONNECTED)
        if section is None:
            return ()
        found: list[int] = []
        for place, text in sorted(section.numbered(), key=lambda one: one[0]):
            number = self._fields.whole(text, f"[ConnectedModules] {place}")
            if number not in self._info:
                said = Text.of("eds.module_not_described", module=shown(text.text))
                self._report.error(text.line, said)
            else:
                found.append(number)
        return tuple(found)

    def find(self, name: str) -> int:
        """The number of a module that is named by its order code, its name or its number. Raises
        ``UnknownModule``."""
        wanted = _plain(name)
        names = [(one.order_code, one.product, str(one.number)) for one in self.known]
        for told in zip(*names, strict=True):
            for one, text in zip(self.known, told, strict=True):
                if wanted and _plain(text) == wanted:
                    return one.number
        if not self.known:
            raise UnknownModule(name, Text.of("eds.has_no_modules"))
        raise UnknownModule(name, Text.of("eds.has_modules", modules=tuple(str(one) for one in self.known)))

    def plug(self, numbers: Sequence[int], *, anew: bool) -> frozenset[tuple[int, int]]:
        """Write what these modules bring into the sections of the file, in their order; gives the elements,
        by index and sub-index. Where ``anew`` is false the file has been made for these modules: objects of
        which it has elements already have all of them."""
        for number in dict.fromkeys(numbers):
            for name, section in self._fixed.get(number, ()):
                if name not in self._sections:
                    self._sections[name] = Section(name, section.line, section.keys)
                    self.brought.add(int(name[:4], 16))
        added: set[tuple[int, int]] = set()
        ends: dict[int, _End] = {}
        for number in numbers:
            for index, section in self._extensions.get(number, ()):
                extension = self._extension(section)
                end = ends.setdefault(index, _End(index, self._highest(index)))
                if extension is None or (end.first and not anew):
                    continue
                for at in end.take(extension):
                    if len(added) >= _MOST_ELEMENTS:
                        self._report.error(section.line, Text.of("eds.too_many_elements"))
                        return frozenset(added)
                    self._add(*at, section)
                    added.add(at)
        return frozenset(added)

    def _extension(self, section: Section) -> _Extension | None:
        data_type = self._fields.number(section, "DataType")
        known = StaticDataType(data_type) if data_type in {int(one) for one in StaticDataType} else None
        text = section.get("Count")
        match = _COUNT.fullmatch(text.text.replace(" ", "")) if text else None
        if match is None:
            self._no_count(section, text)
            return None
        elements, bits = int(match[1]), int(match[2] or 0)
        # An element of booleans is one bit, however long a value of it is on its way.
        width = 1 if known is StaticDataType.BOOLEAN else (known and bits_of_type(known)) or 8
        last = self._fields.number(section, "ObjExtend", 0, _HIGHEST) or 0
        return _Extension(elements, 0 if elements else bits, width, last)

    def _no_count(self, section: Section, text: IniValue | None) -> None:
        name = shown(section.name)
        if text:
            said = Text.of("eds.bad_count", section=name, count=shown(text.text))
            self._report.error(text.line, said)
        else:
            self._report.error(section.line, Text.of("eds.no_count", section=name))

    def _highest(self, index: int) -> int:
        """The highest sub-index of the object as the file has it, 0 where it has no elements."""
        form = re.compile(f"(?:0x)?{index:04x}sub(?:0x)?([0-9a-f]{{1,2}})")
        subs = [int(match[1], 16) for key in self._sections if (match := form.fullmatch(key))]
        return max((sub for sub in subs if sub <= _HIGHEST), default=0)

    def _add(self, index: int, sub: int, section: Section) -> None:
        name, line = section.text("ParameterName"), section.line
        root = self._section(f"{index:04x}")
        if root is None:
            root = self._sections[f"{index:04x}"] = Section(
                f"{index:04X}", line, {"parametername": IniValue(name, line)}
            )
            self.brought.add(index)
        root.keys["objecttype"] = IniValue(str(int(ObjectType.ARRAY)), line)
        # Those that are there count.
        root.keys.pop("subnumber", None)
        count = self._section(f"{index:04x}sub0")
        if count is None:
            count = self._sections[f"{index:04x}sub0"] = Section(f"{index:04X}sub0", line)
        for key, value in (
            ("parametername", "Number of elements"),
            ("datatype", "0x5"),
            ("accesstype", "ro"),
        ):
            count.keys.setdefault(key, IniValue(value, line))
        count.keys["defaultvalue"] = IniValue(str(sub), line)
        keys = {key: text for key, text in section.keys.items() if key not in _OF_THE_EXTENSION}
        # Modules of a kind have one name for all of their elements.
        keys["parametername"] = IniValue(f"{name} {sub}".strip(), line)
        self._sections[f"{index:04x}sub{sub:x}"] = Section(f"{index:04X}sub{sub:X}", line, keys)

    def _section(self, name: str) -> Section | None:
        """Section by its name with four digits and no 0x, in whatever of the usual forms the file has it."""
        index, part, sub = name.partition("sub")
        forms = (name, f"0x{name}", f"{index}{part}{sub:0>2}", f"0x{index}{part}{sub:0>2}")
        return next((self._sections[one] for one in forms if one in self._sections), None)


class _End:
    """End of the elements of an object that modules share. ``first`` is the highest sub-index before."""

    def __init__(self, index: int, first: int) -> None:
        self.first = first
        self._index = index
        self._sub = first
        self._free_bits = 0

    def take(self, extension: _Extension) -> list[tuple[int, int]]:
        """The elements that are new with it."""
        wanted = extension.elements
        if extension.elements:
            self._free_bits = 0
        else:
            lacking = extension.bits - self._free_bits
            wanted = max(0, -(-lacking // extension.width))
            self._free_bits += wanted * extension.width - extension.bits
        found: list[tuple[int, int]] = []
        for _ in range(wanted):
            self._sub += 1
            if extension.last and self._sub > extension.last:
                self._index, self._sub = self._index + 1, 1
            if self._sub > _HIGHEST or self._index > 0xFFFF:
                break
            found.append((self._index, self._sub))
        return found


def _plain(text: str) -> str:
    return re.sub(r"\s+", "", text).lower()
