"""UANodeSet file (OPC 10000-6 Annex F) of a namespace, for tools that are to know a server before it runs."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, Final, cast

from asyncua.server.address_space import AddressSpace, NodeData

from bridge.uaserver.languages import speaking
from bridge.uaserver.library import AttributeIds, ObjectIds, get, node_id, ua

_SET: Final = "http://opcfoundation.org/UA/2011/03/UANodeSet.xsd"
_TYPES: Final = "http://opcfoundation.org/UA/2008/02/Types.xsd"
_TAGS: Final = {
    ua.NodeClass.Object: "UAObject",
    ua.NodeClass.Variable: "UAVariable",
    ua.NodeClass.Method: "UAMethod",
    ua.NodeClass.ObjectType: "UAObjectType",
}
_XML_ENCODING: Final = {
    ua.Argument: ObjectIds.Argument_Encoding_DefaultXml,
    ua.EUInformation: ObjectIds.EUInformation_Encoding_DefaultXml,
    ua.EnumValueType: ObjectIds.EnumValueType_Encoding_DefaultXml,
    ua.Range: ObjectIds.Range_Encoding_DefaultXml,
}
_STRUCTURES: Final = tuple(_XML_ENCODING)
_SHOWN: Final = {
    AttributeIds.DataType: "DataType",
    AttributeIds.ValueRank: "ValueRank",
    AttributeIds.AccessLevel: "AccessLevel",
    AttributeIds.MinimumSamplingInterval: "MinimumSamplingInterval",
    AttributeIds.EventNotifier: "EventNotifier",
    AttributeIds.IsAbstract: "IsAbstract",
}
"""Attributes that are attributes in XML, too."""
_AS_SET: Final = {"ValueRank": "-1", "AccessLevel": "1", "EventNotifier": "0", "IsAbstract": "false"}
"""Values that are not written: they count where nothing is said."""
_DOWNWARDS: Final = tuple(
    node_id(kind)
    for kind in (
        ObjectIds.Organizes,
        ObjectIds.HasComponent,
        ObjectIds.HasProperty,
        ObjectIds.HasAddIn,
        ObjectIds.HasSubtype,
    )
)


class NodesetWriter:
    """Writes the nodes of one namespace of ``space``. ``uris`` are those of the file's namespaces by their
    indexes in ``space``, the first is that of the nodes. Texts are in every one of ``languages``."""

    def __init__(self, space: AddressSpace, uris: Mapping[int, str], languages: Sequence[str]) -> None:
        self._space = space
        self._own, *_ = uris
        self._places = {0: 0, **{index: place for place, index in enumerate(uris, 1)}}
        self._uris = list(uris.values())
        self._languages = languages

    def write(
        self, version: str, starts: Iterable[ua.NodeId], required: Iterable[tuple[str, str, str]]
    ) -> str:
        """The file: all that is below ``starts``, nodes of other namespaces. ``required`` are the models that
        have to be there, each with its version and publication date."""
        root = ET.Element("UANodeSet", {"xmlns": _SET})
        names = ET.SubElement(root, "NamespaceUris")
        for uri in self._uris:
            ET.SubElement(names, "Uri").text = uri
        model = ET.SubElement(
            ET.SubElement(root, "Models"), "Model", {"ModelUri": self._uris[0], "Version": version}
        )
        for uri, of_model, date in required:
            facts = {"ModelUri": uri, "Version": of_model, "PublicationDate": date}
            ET.SubElement(model, "RequiredModel", facts)
        seen: set[ua.NodeId] = set()
        for start in starts:
            for node, parent in self._below(start, seen):
                root.append(self._node(node, parent))
        ET.indent(root)
        return f'<?xml version="1.0" encoding="utf-8"?>\n{ET.tostring(root, encoding="unicode")}\n'

    def _below(self, above: ua.NodeId, seen: set[ua.NodeId]) -> Iterator[tuple[NodeData, ua.NodeId]]:
        """Nodes of the namespace, each once, with the one it is below: that comes first."""
        for reference in self._space[above].references:
            where: ua.NodeId = get(reference, "NodeId")
            is_down = get(reference, "IsForward") and get(reference, "ReferenceTypeId") in _DOWNWARDS
            if is_down and where.NamespaceIndex == self._own and where not in seen:
                seen.add(where)
                yield self._space[where], above
                yield from self._below(where, seen)

    def _node(self, node: NodeData, parent: ua.NodeId) -> ET.Element:
        values = {
            kind: get(self._space.read_attribute_value(node.nodeid, kind).Value, "Value")
            for kind in node.attributes
            if kind != AttributeIds.Value
        }
        name: ua.QualifiedName = values[AttributeIds.BrowseName]
        facts = {
            "NodeId": self._id(node.nodeid),
            "BrowseName": f"{self._places[name.NamespaceIndex]}:{name.Name}",
            "ParentNodeId": self._id(parent),
        }
        for kind, attribute in _SHOWN.items():
            written = self._plain(values.get(kind))
            if written not in ("", _AS_SET.get(attribute)):
                facts[attribute] = written
        made = ET.Element(_TAGS[values[AttributeIds.NodeClass]], facts)
        self._texts(made, "DisplayName", values[AttributeIds.DisplayName])
        if AttributeIds.Description in values:
            self._texts(made, "Description", values[AttributeIds.Description])
        references = ET.SubElement(made, "References")
        for one in node.references:
            self._reference(references, node.nodeid, one)
        self._value(made, node)
        return made

    def _plain(self, value: Any) -> str:
        match value:
            case None:
                return ""
            case bool():
                return str(value).lower()
            case ua.NodeId():
                return self._id(value)
            case _:
                return f"{value:g}"

    def _reference(self, references: ET.Element, where: ua.NodeId, one: ua.ReferenceDescription) -> None:
        """Each reference stands once: at its target, where that knows of it, else at its source."""
        other: ua.NodeId = get(one, "NodeId")
        kind: ua.NodeId = get(one, "ReferenceTypeId")
        forward: bool = get(one, "IsForward")
        if forward and other.NamespaceIndex == self._own and self._leads_back(other, kind, where):
            return
        written = ET.SubElement(references, "Reference", {"ReferenceType": self._id(kind)})
        if not forward:
            written.set("IsForward", "false")
        written.text = self._id(other)

    def _leads_back(self, where: ua.NodeId, kind: ua.NodeId, other: ua.NodeId) -> bool:
        return any(
            not get(one, "IsForward") and (get(one, "ReferenceTypeId"), get(one, "NodeId")) == (kind, other)
            for one in self._space[where].references
        )

    def _value(self, made: ET.Element, node: NodeData) -> None:
        """Value that does not change while the server runs; nothing for another."""
        held = node.attributes.get(AttributeIds.Value)
        if held is None or held.value_callback is not None or held.value is None:
            return
        told = held.value.Value
        if told is None or told.Value is None:
            return
        value = ET.SubElement(made, "Value")
        kind = told.VariantType.name
        content: Any = told.Value
        if not isinstance(content, list):
            self._scalar(value, kind, content)
            return
        many = ET.SubElement(value, f"ListOf{kind}", {"xmlns": _TYPES})
        for one in cast("list[Any]", content):
            self._scalar(many, kind, one)

    def _scalar(self, above: ET.Element, kind: str, value: Any) -> None:
        made = ET.SubElement(above, kind, {} if above.get("xmlns") else {"xmlns": _TYPES})
        match value:
            case ua.LocalizedText():
                self._localized(made, value)
            case _ if isinstance(value, _STRUCTURES):
                where = ET.SubElement(ET.SubElement(made, "TypeId"), "Identifier")
                where.text = f"i={_XML_ENCODING[type(value)]}"
                body = ET.SubElement(made, "Body")
                self._fields(ET.SubElement(body, type(value).__name__), value)
            case _:
                made.text = self._plain(value) if isinstance(value, bool | float) else str(value)

    def _fields(self, made: ET.Element, value: object) -> None:
        names: Iterable[str] = get(value, "__dataclass_fields__")
        for name in names:
            field = get(value, name)
            one = ET.SubElement(made, name)
            match field:
                case ua.LocalizedText():
                    self._localized(one, field)
                case ua.NodeId():
                    ET.SubElement(one, "Identifier").text = self._id(field)
                case list():
                    pass
                case float():
                    one.text = repr(field)
                case _:
                    one.text = "" if field is None else str(field)

    def _localized(self, above: ET.Element, said: ua.LocalizedText) -> None:
        """A value has one text, in the first of the languages."""
        for locale, words in list(self._spoken(said))[:1]:
            ET.SubElement(above, "Locale").text = locale
            ET.SubElement(above, "Text").text = words

    def _texts(self, above: ET.Element, tag: str, said: ua.LocalizedText) -> None:
        for locale, words in self._spoken(said):
            ET.SubElement(above, tag, {"Locale": locale} if locale else {}).text = words

    def _spoken(self, said: ua.LocalizedText) -> Iterator[tuple[str, str]]:
        """Locale and text in each language, once."""
        told: list[tuple[str, str]] = []
        for language in self._languages:
            with speaking([language]):
                one = (said.Locale or "", said.Text or "")
            if one not in told and one[1]:
                told.append(one)
        yield from told

    def _id(self, where: ua.NodeId) -> str:
        is_number = isinstance(where.Identifier, int)
        identifier = f"{'i' if is_number else 's'}={where.Identifier}"
        place = self._places[where.NamespaceIndex]
        return f"ns={place};{identifier}" if place else identifier
