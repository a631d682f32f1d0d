"""XDD and XDC (CiA 311) into a ``Description``, through the same field readers as an EDS."""

from __future__ import annotations

from typing import Final

from bridge.eds.fields import Fields
from bridge.eds.ini import IniValue, Section, shown
from bridge.eds.model import Commissioning, Description, DeviceInfo, Object, Report
from bridge.eds.objects import ObjectReader
from bridge.eds.xdd_parameters import DEFAULT_ACCESS, XddParameters
from bridge.eds.xml import Element, parse
from bridge.text import Text

_KEYS: Final = {
    "name": "parametername",
    "objecttype": "objecttype",
    "datatype": "datatype",
    "accesstype": "accesstype",
    "defaultvalue": "defaultvalue",
    "actualvalue": "parametervalue",
    "lowlimit": "lowlimit",
    "highlimit": "highlimit",
    "objflags": "objflags",
    "subnumber": "subnumber",
}
"""Attributes of CANopenObject and CANopenSubObject by the keys of an EDS that mean the same."""


def read_xdd(content: bytes, report: Report) -> Description:
    """Everything that can be read from ``content``; the report has what cannot."""
    return _XddReader(parse(content, report), report).read()


class _XddReader:
    def __init__(self, root: Element, report: Report) -> None:
        self._root = root
        self._report = report
        self._fields = Fields(report)
        self._parameters = XddParameters(root, report)

    def read(self) -> Description:
        objects = self._objects()
        commissioning = self._root.first("deviceCommissioning")
        configured = any(e.parameter_value is not None for o in objects.values() for e in o.entries)
        return Description(
            format="XDC" if commissioning or configured else "XDD",
            device_info=self._device_info(),
            commissioning=self._commissioning(commissioning) if commissioning else Commissioning(),
            objects=tuple(objects[index] for index in sorted(objects)),
        )

    def _objects(self) -> dict[int, Object]:
        roots: dict[int, Section] = {}
        subs: dict[int, dict[int, Section]] = {}
        for element in self._root.all("CANopenObject"):
            index = self._hexadecimal(element, "index", 0xFFFF)
            if index is None:
                continue
            if index in roots:
                self._report.error(element.line, Text.of("eds.object_again", object=f"{index:04X}h"))
                continue
            roots[index] = self._section(element, f"{index:04X}")
            for child in element.all("CANopenSubObject"):
                sub = self._hexadecimal(child, "subindex", 0xFF)
                if sub is None:
                    continue
                if sub in subs.setdefault(index, {}):
                    said = Text.of("eds.object_again", object=f"{index:04X}h:{sub:02X}")
                    self._report.error(child.line, said)
                    continue
                subs[index][sub] = self._section(child, f"{index:04X}sub{sub:X}")
        reader = ObjectReader(self._fields, self._report, roots, subs, {})
        return {index: reader.read(index) for index in roots}

    def _hexadecimal(self, element: Element, name: str, most: int) -> int | None:
        """An index or sub-index: hexadecimal without a prefix."""
        text = element.attributes.get(name, "")
        digits = text.lower().removeprefix("0x")
        if digits and len(digits) <= 4 and set(digits) <= set("0123456789abcdef") and int(digits, 16) <= most:
            if digits != text.lower():
                said = Text.of("eds.key_taken_as", key=name, value=shown(text), taken=digits)
                self._report.warning(element.line, said)
            return int(digits, 16)
        self._report.error(element.line, Text.of("eds.not_hexadecimal", key=name, value=shown(text)))
        return None

    def _section(self, element: Element, name: str) -> Section:
        """The element as a section of an EDS."""
        section = Section(name, element.line)
        for attribute, value in element.attributes.items():
            if attribute in _KEYS:
                section.keys[_KEYS[attribute]] = IniValue(value, element.line)
        if "datatype" in section.keys:
            text = section.keys["datatype"].text
            plain = text.lower().startswith("0x") or not text
            section.keys["datatype"] = IniValue(text if plain else f"0x{text}", element.line)
        mapping = element.attributes.get("pdomapping", "no").lower()
        if mapping not in ("no", ""):
            section.keys["pdomapping"] = IniValue("1", element.line)
        self._parameters.fill(section, element)
        has_subs = any(child.tag == "CANopenSubObject" for child in element.children)
        if section.get("AccessType") is None and not has_subs:
            said = Text.of("eds.no_xdd_access", object=name, access=DEFAULT_ACCESS)
            self._report.warning(element.line, said)
            section.keys["accesstype"] = IniValue(DEFAULT_ACCESS, element.line)
        return section

    def _device_info(self) -> DeviceInfo:
        identity = self._root.first("DeviceIdentity")
        if identity is None:
            self._report.warning(0, Text.of("eds.no_device_identity"))
            return DeviceInfo()
        texts = {child.tag: IniValue(child.text.strip(), child.line) for child in identity.children}
        section = Section("DeviceIdentity", identity.line)
        for tag, key in (("vendorID", "vendornumber"), ("productID", "productnumber")):
            if tag in texts:
                section.keys[key] = self._number(texts[tag])
        versions = [child for child in identity.children if child.tag == "version"]
        revision = next((v for v in versions if v.attributes.get("versiontype") == "FW"), None)
        product = texts.get("productName") or texts.get("productFamily")
        vendor, order = texts.get("vendorName"), texts.get("orderNumber")
        if revision and revision.attributes.get("value", "").lower().startswith("0x"):
            section.keys["revisionnumber"] = IniValue(revision.attributes["value"], revision.line)
        return DeviceInfo(
            vendor=vendor.text if vendor else "",
            vendor_id=self._fields.number(section, "VendorNumber"),
            product=product.text if product else "",
            product_code=self._fields.number(section, "ProductNumber"),
            revision=self._fields.number(section, "RevisionNumber"),
            order_code=order.text if order else "",
            bitrates=tuple(sorted(set(self._bitrates()))),
        )

    @staticmethod
    def _number(found: IniValue) -> IniValue:
        """vendorID and productID are hexadecimal, with or without 0x (CiA 311, DeviceIdentity)."""
        is_marked = found.text.lower().startswith("0x") or not found.text
        return found if is_marked else IniValue(f"0x{found.text}", found.line)

    def _bitrates(self) -> list[int]:
        found: list[int] = []
        for element in self._root.all("supportedBaudRate"):
            words = element.attributes.get("value", "").split()
            if len(words) == 2 and words[0].isascii() and words[0].isdigit() and len(words[0]) < 6:
                found.append(int(words[0]) * (1000 if words[1].lower().startswith("k") else 1))
        return found

    def _commissioning(self, element: Element) -> Commissioning:
        section = Section("deviceCommissioning", element.line)
        for name in ("nodeid", "actualbaudrate"):
            if name in element.attributes:
                first = (element.attributes[name].split() or [""])[0]
                section.keys[name] = IniValue(first, element.line)
        kbit_s = self._fields.number(section, "actualBaudRate", 0, 1000)
        return Commissioning(
            node_id=self._fields.number(section, "nodeID", 1, 127),
            node_name=element.attributes.get("nodename", ""),
            bitrate=1000 * kbit_s if kbit_s else None,
        )
