"""UANodeSet files (OPC 10000-6 Annex F) read into one table of plain JSON, which a server loads quickly.

A NodeId is written ``<namespace>;<identifier>``, such as ``3;i=1016``, and a BrowseName ``3;Model``: the
number is the place in ``namespaces``, 0 is the standard's own. The rows are ``Row`` of
``bridge.uaserver.nodesets``.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterable, Mapping
from typing import Any, Final

_SET: Final = "{http://opcfoundation.org/UA/2011/03/UANodeSet.xsd}"
_TYPES: Final = "{http://opcfoundation.org/UA/2008/02/Types.xsd}"
_STANDARD: Final = "http://opcfoundation.org/UA/"

NODE_CLASSES: Final = {
    "UAObject": 1,
    "UAVariable": 2,
    "UAMethod": 4,
    "UAObjectType": 8,
    "UAVariableType": 16,
    "UAReferenceType": 32,
    "UADataType": 64,
}
"""Numbers of OPC 10000-3 §8.29."""
_HAS_TYPE_DEFINITION: Final = "0;i=40"
_HAS_SUBTYPE: Final = "0;i=45"
_ONE_WAY: Final = frozenset({"0;i=37", _HAS_TYPE_DEFINITION, "0;i=41", "0;i=3065", "0;i=17597", "0;i=17603"})
"""HasModellingRule, HasTypeDefinition, GeneratesEvent, AlwaysGeneratesEvent, HasDictionaryEntry,
HasInterface: nobody follows them backwards."""
_UPWARDS: Final = frozenset({"0;i=35", "0;i=45", "0;i=46", "0;i=47"})
"""Organizes, HasSubtype, HasProperty, HasComponent: how a model hangs on the standard's nodes."""
_OLD_DICTIONARIES: Final = frozenset({"0;i=69", "0;i=72"})
"""Types of the encodings' descriptions before version 1.04 (Part 5 Annex D): what they said is in the
attribute DataTypeDefinition."""
_NOT_SERVED: Final = frozenset(
    {
        ("http://opcfoundation.org/UA/DI/", "i=6387"),  # MaxInactiveLockTime
        ("http://opcfoundation.org/UA/DI/", "i=6078"),  # NetworkSet
        ("http://opcfoundation.org/UA/DI/", "i=6094"),  # DeviceTopology
        ("http://opcfoundation.org/UA/FX/Data/", "i=71"),  # FxRoot
        ("http://opcfoundation.org/UA/FX/Data/", "i=5019"),  # ConnectionAdmin
    }
)
"""Objects of services that the server does not have, with all below them."""

Node = dict[str, Any]


class NodesetReader:
    """``versions`` are those of the models by URI; each file is to be given behind those it requires."""

    def __init__(self, versions: Mapping[str, str]) -> None:
        self._uris = [_STANDARD, *versions]
        self._models: list[list[str]] = []
        self._nodes: dict[str, Node] = {}

    def read(self, content: bytes) -> None:
        """Take in a file. Raises ValueError for one that is not of the models."""
        root = ET.fromstring(content)
        uris = [_STANDARD, *(uri.text or "" for uri in root.iterfind(f"{_SET}NamespaceUris/{_SET}Uri"))]
        aliases = {one.get("Alias"): one.text or "" for one in root.iter(f"{_SET}Alias")}
        reader = _FileReader([self._uris.index(uri) for uri in uris], aliases)
        for model in root.iterfind(f"{_SET}Models/{_SET}Model"):
            self._models.append([model.attrib[key] for key in ("ModelUri", "Version", "PublicationDate")])
        for element in root:
            node_class = NODE_CLASSES.get(element.tag.removeprefix(_SET))
            if node_class and element.get("DesignToolOnly") != "true":
                node = reader.node(element, node_class)
                self._nodes[node["id"]] = node

    def compiled(self) -> dict[str, Any]:
        self._leave_out()
        outside = self._complete()
        for node in self._nodes.values():
            if "definition" in node:
                node["definition"]["encoding"] = self._binary_encoding(node)
        return {
            "namespaces": self._uris[1:],
            "models": self._models,
            "nodes": [_sorted(node) for node in self._nodes.values()],
            "outside": sorted(outside),
        }

    def _leave_out(self) -> None:
        unwanted = {f"{self._uris.index(uri)};{name}" for uri, name in _NOT_SERVED if uri in self._uris}
        unwanted |= {one for one, node in self._nodes.items() if _type_of(node) in _OLD_DICTIONARIES}
        waiting = list(unwanted)
        below: dict[str, list[str]] = {}
        for one, node in self._nodes.items():
            if node["parent"]:
                below.setdefault(node["parent"], []).append(one)
        while waiting:
            for one in below.get(waiting.pop(), ()):
                if one not in unwanted:
                    unwanted.add(one)
                    waiting.append(one)
        self._nodes = {one: node for one, node in self._nodes.items() if one not in unwanted}
        for node in self._nodes.values():
            node["references"] = [one for one in node["references"] if one[2] not in unwanted]

    def _complete(self) -> list[list[Any]]:
        """Give each reference its other direction. Returns those of the standard's nodes."""
        outside: list[list[Any]] = []
        for name, node in self._nodes.items():
            for kind, forward, target in list(node["references"]):
                back = [kind, not forward, name]
                other = self._nodes.get(target)
                if other is None:
                    if target.startswith("0;") and not forward and kind in _UPWARDS:
                        outside.append([target, *back])
                elif kind not in _ONE_WAY and back not in other["references"]:
                    other["references"].append(back)
        return outside

    def _binary_encoding(self, node: Node) -> str:
        for kind, forward, target in node["references"]:
            if kind == "0;i=38" and forward and self._nodes[target]["browse_name"] == "0;Default Binary":
                return target
        return ""


def _sorted(node: Node) -> Node:
    return {key: value for key, value in sorted(node.items()) if key != "parent"}


def _type_of(node: Node) -> str:
    return next((target for kind, _, target in node["references"] if kind == _HAS_TYPE_DEFINITION), "")


class _FileReader:
    """``places`` are those of the file's namespaces among the models'."""

    def __init__(self, places: list[int], aliases: Mapping[str | None, str]) -> None:
        self._places = places
        self._aliases = aliases

    def _node_id(self, written: str) -> str:
        written = self._aliases.get(written, written)
        if not written.startswith("ns="):
            return f"0;{written}"
        number, _, identifier = written.removeprefix("ns=").partition(";")
        return f"{self._places[int(number)]};{identifier}"

    def _name(self, written: str) -> str:
        number, colon, name = written.partition(":")
        return f"{self._places[int(number)]};{name}" if colon and number.isdigit() else f"0;{written}"

    def node(self, element: ET.Element, node_class: int) -> Node:
        attributes = element.attrib
        parent = attributes.get("ParentNodeId")
        made: Node = {
            "id": self._node_id(attributes["NodeId"]),
            "node_class": node_class,
            "browse_name": self._name(attributes["BrowseName"]),
            "display_name": _text(element, "DisplayName"),
            "description": _text(element, "Description"),
            "references": self._references(element.iterfind(f"{_SET}References/{_SET}Reference")),
            "parent": self._node_id(parent) if parent else "",
        }
        if attributes.get("IsAbstract") == "true":
            made["abstract"] = True
        if node_class in (2, 16):
            made["data_type"] = self._node_id(attributes.get("DataType", "i=24"))
            made["value_rank"] = int(attributes.get("ValueRank", -1))
            value = element.find(f"{_SET}Value")
            if value is not None and len(value):
                made["value"] = self._value(value[0])
        if node_class == 32:
            made["symmetric"] = attributes.get("Symmetric") == "true"
            made["inverse_name"] = _text(element, "InverseName")
        definition = element.find(f"{_SET}Definition")
        if definition is not None:
            made["definition"] = self._definition(definition)
        return made

    def _references(self, elements: Iterable[ET.Element]) -> list[list[Any]]:
        return [
            [
                self._node_id(one.attrib["ReferenceType"]),
                one.get("IsForward", "true") == "true",
                self._node_id((one.text or "").strip()),
            ]
            for one in elements
        ]

    def _definition(self, element: ET.Element) -> dict[str, Any]:
        fields = list(element.iterfind(f"{_SET}Field"))
        if any("Value" in one.attrib for one in fields):
            return {"enumeration": [[one.attrib["Name"], int(one.attrib["Value"])] for one in fields]}
        return {
            "is_union": element.get("IsUnion") == "true",
            "fields": [
                [
                    one.attrib["Name"],
                    self._node_id(one.get("DataType", "i=24")),
                    int(one.get("ValueRank", -1)),
                    one.get("IsOptional") == "true",
                ]
                for one in fields
            ],
        }

    def _value(self, element: ET.Element) -> list[Any]:
        """``[type, content]``; the content of an array is a list, that of a structure an object."""
        name = element.tag.removeprefix(_TYPES)
        kind = name.removeprefix("ListOf")
        if kind != name:
            return [kind, [self._scalar(kind, one) for one in element]]
        return [kind, self._scalar(kind, element)]

    def _scalar(self, kind: str, element: ET.Element) -> Any:
        if kind == "ExtensionObject":
            body = element.find(f"{_TYPES}Body")
            assert body is not None
            return {"type": body[0].tag.rpartition("}")[2], **self._fields(body[0])}
        if kind == "LocalizedText":
            return (element.findtext(f"{_TYPES}Text") or "").strip()
        if kind == "QualifiedName":
            number = int(element.findtext(f"{_TYPES}NamespaceIndex") or 0)
            return f"{self._places[number]};{element.findtext(f'{_TYPES}Name') or ''}"
        text = (element.text or "").strip()
        if kind == "Boolean":
            return text == "true"
        if kind in ("Float", "Double"):
            return float(text)
        return text if kind in ("String", "DateTime", "ByteString", "Guid") else int(text)

    def _fields(self, element: ET.Element) -> dict[str, Any]:
        """Fields of a structure: texts, and NodeIds as ours."""
        made: dict[str, Any] = {}
        for one in element:
            name = one.tag.rpartition("}")[2]
            identifier = one.find(f"{_TYPES}Identifier")
            inner = one.find(f"{_TYPES}Text")
            if identifier is not None:
                made[name] = self._node_id((identifier.text or "").strip())
            else:
                made[name] = ((one if inner is None else inner).text or "").strip()
        return made


def _text(element: ET.Element, name: str) -> str:
    return (element.findtext(f"{_SET}{name}") or "").strip()
