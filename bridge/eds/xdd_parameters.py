"""Parameters of an XDD's application process (CiA 311 §6.4.5), to which objects refer by uniqueIDRef."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from bridge.eds.ini import IniValue, Section, shown
from bridge.eds.model import ObjectType, Report, StaticDataType
from bridge.eds.xml import Element
from bridge.text import Text

_ACCESS: Final = {
    "const": "const",
    "read": "ro",
    "write": "wo",
    "readwrite": "rw",
    "readwriteinput": "rwr",
    "readwriteoutput": "rww",
    "noaccess": "ro",
}
"""Access by the attribute in lower case. noAccess counts as read-only: it is not written."""
DEFAULT_ACCESS: Final = "ro"
"""For parameters and objects without an access (the schema's default is ``read``)."""

BIT_STRING: Final = "BITSTRING"
TYPES: Final = {
    "BOOL": StaticDataType.BOOLEAN,
    BIT_STRING: StaticDataType.OCTET_STRING,
    "CHAR": StaticDataType.INTEGER8,
    "SINT": StaticDataType.INTEGER8,
    "INT": StaticDataType.INTEGER16,
    "DINT": StaticDataType.INTEGER32,
    "LINT": StaticDataType.INTEGER64,
    "USINT": StaticDataType.UNSIGNED8,
    "BYTE": StaticDataType.UNSIGNED8,
    "UINT": StaticDataType.UNSIGNED16,
    "WORD": StaticDataType.UNSIGNED16,
    "UDINT": StaticDataType.UNSIGNED32,
    "DWORD": StaticDataType.UNSIGNED32,
    "ULINT": StaticDataType.UNSIGNED64,
    "LWORD": StaticDataType.UNSIGNED64,
    "REAL": StaticDataType.REAL32,
    "LREAL": StaticDataType.REAL64,
    "STRING": StaticDataType.VISIBLE_STRING,
    "WSTRING": StaticDataType.UNICODE_STRING,
}
"""Every element that names a simple type (IEC 61131-3). Types of other lengths, such as 24 bits, and domains
have none: tools write BITSTRING for them."""
_VALUES: Final = {"defaultValue": "defaultvalue", "actualValue": "parametervalue"}
_LIMITS: Final = {"minValue": "lowlimit", "maxValue": "highlimit"}
_DEEPEST: Final = 8
"""Depth of types derived from each other."""


class XddParameters:
    """The parameters of one file, by their ``uniqueID``."""

    def __init__(self, root: Element, report: Report) -> None:
        self._report = report
        self._parameters = _by_id(root.all("parameter"))
        self._templates = _by_id(root.all("parameterTemplate"))
        self._types = _by_id(one for tag in ("derived", "enum") for one in root.all(tag))

    def fill(self, section: Section, element: Element) -> None:
        """Fill in what ``element``, an object or sub-object, does not say itself."""
        reference = element.attributes.get("uniqueidref")
        parameter = self._parameters.get(reference or "")
        if parameter is None:
            if reference:
                said = Text.of("eds.no_parameter", parameter=shown(reference))
                self._report.warning(element.line, said)
            return
        self._fill(section, parameter)
        template = self._templates.get(parameter.attributes.get("templateidref", ""))
        if template is not None:
            self._fill(section, template)
        _give(section, "accesstype", DEFAULT_ACCESS, parameter.line)

    def _fill(self, section: Section, parameter: Element) -> None:
        access = parameter.attributes.get("access")
        if access and section.get("AccessType") is None:
            _give(section, "accesstype", self._access(access, parameter.line), parameter.line)
        found = self._type_of(parameter)
        if found is not None and not (found == BIT_STRING and _is_domain(section)):
            _give(section, "datatype", hex(TYPES[found]), parameter.line)
        for child in parameter.children:
            if child.tag in _VALUES:
                _give(section, _VALUES[child.tag], child.attributes.get("value", ""), child.line)
            elif child.tag == "allowedValues":
                _fill_limits(section, child)

    def _access(self, word: str, line: int) -> str:
        known = _ACCESS.get(word.lower())
        if known is None:
            said = Text.of("eds.key_taken_as", key="access", value=shown(word), taken=DEFAULT_ACCESS)
            self._report.warning(line, said)
        return known or DEFAULT_ACCESS

    def _type_of(self, parameter: Element) -> str | None:
        """The element that names the type, found through derived types if need be."""
        element = parameter
        for _ in range(_DEEPEST):
            named = next((child for child in element.children if child.tag in TYPES), None)
            if named is not None:
                return named.tag
            reference = next((child for child in element.children if child.tag == "dataTypeIDRef"), None)
            derived = self._types.get(reference.attributes.get("uniqueidref", "")) if reference else None
            if derived is None:
                return None
            element = derived
        return None


def _give(section: Section, key: str, text: str, line: int) -> None:
    """Set a key that is missing from the section or empty."""
    if text and not section.text(key):
        section.keys[key] = IniValue(text, line)


def _by_id(elements: Iterator[Element]) -> dict[str, Element]:
    found: dict[str, Element] = {}
    for element in elements:
        if "uniqueid" in element.attributes:
            found.setdefault(element.attributes["uniqueid"], element)
    return found


def _is_domain(section: Section) -> bool:
    kind = section.get("ObjectType")
    return kind is not None and kind.text.lower().removeprefix("0x").lstrip("0") == str(
        int(ObjectType.DOMAIN)
    )


def _fill_limits(section: Section, allowed: Element) -> None:
    """Take the limits of a single range; several ranges are no limits."""
    ranges = [child for child in allowed.children if child.tag == "range"]
    if len(ranges) != 1:
        return
    for child in ranges[0].children:
        if child.tag in _LIMITS:
            _give(section, _LIMITS[child.tag], child.attributes.get("value", ""), child.line)
