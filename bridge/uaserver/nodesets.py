"""Nodes of published models (UANodeSet, OPC 10000-6 Annex F), which are made when somebody looks at them.

asyncua would keep every attribute and every reference of each of them, for most of them in vain. Here the
rows that ``tools.nodesets`` has written are kept, and a node follows from its row.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import datetime
from functools import lru_cache
from typing import Any, Final, Protocol, cast

import msgspec
from asyncua.server.address_space import AddressSpace, AttributeValue, NodeData

from bridge.uaserver.address_space import access_level_ex, constant
from bridge.uaserver.hierarchy import reference_to
from bridge.uaserver.library import (
    AttributeIds,
    ObjectIds,
    StatusCodes,
    data_value,
    get,
    make,
    node_id,
    status,
    text,
    ua,
    variant,
)

_KEPT: Final = 64
"""Nodes that are kept once made: clients ask for one attribute after the other."""
_READ: Final = 1
_STRUCTURES: Final = ("Argument", "EnumValueType", "Range")
_HAS_TYPE_DEFINITION: Final = f"0;i={ObjectIds.HasTypeDefinition}"
_HAS_SUBTYPE: Final = f"0;i={ObjectIds.HasSubtype}"
_Type = ua.VariantType
_ATTRIBUTE_TYPES: Final = {
    AttributeIds.NodeId: _Type.NodeId,
    AttributeIds.NodeClass: _Type.Int32,
    AttributeIds.BrowseName: _Type.QualifiedName,
    AttributeIds.DisplayName: _Type.LocalizedText,
    AttributeIds.Description: _Type.LocalizedText,
    AttributeIds.WriteMask: _Type.UInt32,
    AttributeIds.UserWriteMask: _Type.UInt32,
    AttributeIds.IsAbstract: _Type.Boolean,
    AttributeIds.Symmetric: _Type.Boolean,
    AttributeIds.InverseName: _Type.LocalizedText,
    AttributeIds.EventNotifier: _Type.Byte,
    AttributeIds.DataType: _Type.NodeId,
    AttributeIds.ValueRank: _Type.Int32,
    AttributeIds.AccessLevel: _Type.Byte,
    AttributeIds.UserAccessLevel: _Type.Byte,
    AttributeIds.AccessLevelEx: _Type.UInt32,
    AttributeIds.Historizing: _Type.Boolean,
    AttributeIds.Executable: _Type.Boolean,
    AttributeIds.UserExecutable: _Type.Boolean,
    AttributeIds.DataTypeDefinition: _Type.ExtensionObject,
}

Reference = tuple[str, bool, str]
"""Type, whether it is a forward one, and target."""


class Definition(msgspec.Struct):
    """Definition of a data type: of an enumeration its names and numbers, of a structure its fields, each
    with name, data type, value rank, and whether it may be left out."""

    enumeration: list[tuple[str, int]] | None = None
    fields: list[tuple[str, str, int, bool]] = msgspec.field(default_factory=list[tuple[str, str, int, bool]])
    is_union: bool = False
    encoding: str = ""


class Row(msgspec.Struct):
    """One node as ``tools.nodeset_reader`` has written it: NodeIds are ``<namespace>;<identifier>``."""

    id: str
    node_class: int
    browse_name: str
    display_name: str
    references: list[Reference]
    description: str = ""
    abstract: bool = False
    symmetric: bool = False
    inverse_name: str = ""
    data_type: str = ""
    value_rank: int = -1
    access: int = _READ
    value: tuple[str, Any] | None = None
    definition: Definition | None = None


class Models(msgspec.Struct):
    """Models in one file. ``models`` have URI, version and publication date; ``outside`` are references of
    the standard's nodes to theirs."""

    namespaces: list[str]
    models: list[tuple[str, str, str]]
    nodes: list[Row]
    outside: list[tuple[str, str, bool, str]]


def load_models(content: bytes) -> Models:
    """Raises ValueError for what ``tools.nodesets`` has not written."""
    return msgspec.json.decode(content, type=Models)


class Instances(Protocol):
    """Nodes of a server's own, whose types are the models'."""

    def row(self, name: str) -> Row | None:
        """The node with this text as its identifier."""
        ...

    def value(self, name: str) -> AttributeValue | None:
        """The value of this node, None where its row has it."""
        ...


class NoInstances:
    """None at all."""

    def row(self, name: str) -> Row | None:
        return None

    def value(self, name: str) -> AttributeValue | None:
        return None


class _ModelNode:
    """A node in place of asyncua's NodeData, with as much of it as is used."""

    __slots__ = ("_store", "attributes", "nodeid", "row")

    def __init__(self, store: NodesetStore, row: Row) -> None:
        self._store = store
        self.row = row
        self.nodeid = store.node_id(row.id)
        self.attributes = store.attributes(row)

    @property
    def references(self) -> list[ua.ReferenceDescription]:
        return [self._store.described(one) for one in self.row.references]


class NodesetStore:
    """The nodes of ``models`` behind those of ``space``. ``namespaces`` are the indexes of theirs, in their
    order, and behind them that of ``instances``."""

    def __init__(
        self, models: Models, space: AddressSpace, namespaces: Sequence[int], instances: Instances
    ) -> None:
        self._space = space
        self._indexes = (0, *namespaces)
        self._places = {index: place for place, index in enumerate(self._indexes)}
        self._rows = {row.id: row for row in models.nodes}
        self._instances = instances
        self._own = f"{len(namespaces)};s="
        self._made = lru_cache(_KEPT)(self._make)
        for where, *reference in models.outside:
            kind, forward, target = cast("Reference", tuple(reference))
            space[self.node_id(where)].references.append(self.described((kind, forward, target)))

    def find(self, where: ua.NodeId) -> NodeData | None:
        place = self._places.get(where.NamespaceIndex)
        if not place:
            return None
        letter = "i" if isinstance(where.Identifier, int) else "s"
        return cast("NodeData | None", self._made(f"{place};{letter}={where.Identifier}"))

    def _make(self, name: str) -> _ModelNode | None:
        row = self._row(name)
        return None if row is None else _ModelNode(self, row)

    def _row(self, name: str) -> Row | None:
        if name.startswith(self._own):
            return self._instances.row(name.removeprefix(self._own))
        return self._rows.get(name)

    def node_id(self, name: str) -> ua.NodeId:
        place, _, identifier = name.partition(";")
        value = identifier[2:]
        return node_id(int(value) if identifier.startswith("i=") else value, self._indexes[int(place)])

    def qualified(self, name: str) -> ua.QualifiedName:
        place, _, words = name.partition(";")
        return ua.QualifiedName(words, self._indexes[int(place)])

    def described(self, reference: Reference) -> ua.ReferenceDescription:
        kind, forward, target = reference
        row = self._row(target)
        if row is None:
            return reference_to(self._space, self.node_id(target), self.node_id(kind), forward=forward)
        of_type = next((there for kind, _, there in row.references if kind == _HAS_TYPE_DEFINITION), None)
        return make(
            ua.ReferenceDescription,
            ReferenceTypeId=self.node_id(kind),
            IsForward=forward,
            NodeId=self.node_id(target),
            BrowseName=self.qualified(row.browse_name),
            DisplayName=text(row.display_name),
            NodeClass=ua.NodeClass(row.node_class),
            **({"TypeDefinition": self.node_id(of_type)} if of_type else {}),
        )

    def attributes(self, row: Row) -> Mapping[AttributeIds, AttributeValue]:
        values: dict[AttributeIds, Any] = {
            AttributeIds.NodeId: self.node_id(row.id),
            AttributeIds.NodeClass: ua.NodeClass(row.node_class),
            AttributeIds.BrowseName: self.qualified(row.browse_name),
            AttributeIds.DisplayName: text(row.display_name),
            AttributeIds.WriteMask: 0,
            AttributeIds.UserWriteMask: 0,
            **self._of_class(row),
        }
        if row.description:
            values[AttributeIds.Description] = text(row.description)
        made = {kind: constant(value, _ATTRIBUTE_TYPES[kind]) for kind, value in values.items()}
        value = self._value_of(row)
        if value is not None:
            made[AttributeIds.Value] = value
        return made

    def _value_of(self, row: Row) -> AttributeValue | None:
        """None where there is no attribute Value."""
        if row.id.startswith(self._own) and (own := self._instances.value(row.id.removeprefix(self._own))):
            return own
        value = self._value(row.value) if row.value else None
        if value is not None:
            return AttributeValue(data_value(value))
        if row.node_class != ua.NodeClass.Variable:
            return None
        # What nobody knows, or the place of a value in a type.
        return AttributeValue(data_value(variant(None, _Type.Null), status(StatusCodes.BadNotSupported)))

    def _of_class(self, row: Row) -> dict[AttributeIds, Any]:
        match ua.NodeClass(row.node_class):
            case ua.NodeClass.Object:
                return {AttributeIds.EventNotifier: 0}
            case ua.NodeClass.Method:
                return {AttributeIds.Executable: False, AttributeIds.UserExecutable: False}
            case ua.NodeClass.Variable:
                return {
                    **self._data_type(row),
                    AttributeIds.AccessLevel: row.access,
                    AttributeIds.UserAccessLevel: row.access,
                    AttributeIds.AccessLevelEx: access_level_ex(row.access),
                    AttributeIds.Historizing: False,
                }
            case ua.NodeClass.VariableType:
                return {**self._data_type(row), AttributeIds.IsAbstract: row.abstract}
            case ua.NodeClass.ReferenceType:
                inverse = {AttributeIds.InverseName: text(row.inverse_name)} if row.inverse_name else {}
                return {
                    AttributeIds.IsAbstract: row.abstract,
                    AttributeIds.Symmetric: row.symmetric,
                    **inverse,
                }
            case ua.NodeClass.DataType if row.definition:
                defined = self._definition(row, row.definition)
                return {AttributeIds.IsAbstract: row.abstract, AttributeIds.DataTypeDefinition: defined}
            case _:
                return {AttributeIds.IsAbstract: row.abstract}

    def _data_type(self, row: Row) -> dict[AttributeIds, Any]:
        return {
            AttributeIds.DataType: self.node_id(row.data_type),
            AttributeIds.ValueRank: row.value_rank,
        }

    def _definition(self, row: Row, definition: Definition) -> ua.EnumDefinition | ua.StructureDefinition:
        if definition.enumeration is not None:
            fields = [
                make(ua.EnumField, Name=name, Value=number, DisplayName=text(name))
                for name, number in definition.enumeration
            ]
            return make(ua.EnumDefinition, Fields=fields)
        kind = ua.StructureType.Structure
        if definition.is_union:
            kind = ua.StructureType.Union
        elif any(optional for *_, optional in definition.fields):
            kind = ua.StructureType.StructureWithOptionalFields
        return make(
            ua.StructureDefinition,
            DefaultEncodingId=self.node_id(definition.encoding) if definition.encoding else ua.NodeId(),
            BaseDataType=self.node_id(_above(row) or f"0;i={ObjectIds.Structure}"),
            StructureType=kind,
            Fields=self._fields(row),
        )

    def _fields(self, row: Row) -> list[ua.StructureField]:
        """Fields that it inherits, and its own."""
        above = self._rows.get(_above(row))
        inherited = self._fields(above) if above else []
        own = row.definition.fields if row.definition else []
        return inherited + [
            make(
                ua.StructureField,
                Name=name,
                DataType=self.node_id(data_type),
                ValueRank=rank,
                IsOptional=optional,
            )
            for name, data_type, rank, optional in own
        ]

    def _value(self, written: tuple[str, Any]) -> ua.Variant | None:
        """None for a structure of the models' own."""
        kind, content = written
        many = isinstance(content, list)
        values = [self._scalar(kind, one) for one in cast("list[Any]", content)] if many else []
        value = values if many else self._scalar(kind, content)
        return None if value is None or None in values else variant(value, get(_Type, kind), is_array=many)

    def _scalar(self, kind: str, content: Any) -> Any:
        match kind:
            case "LocalizedText":
                return text(content)
            case "QualifiedName":
                return self.qualified(content)
            case "DateTime":
                return datetime.fromisoformat(content)
            case "ExtensionObject":
                return self._structure(content) if content["type"] in _STRUCTURES else None
            case _:
                return content

    def _structure(self, fields: Mapping[str, str]) -> object:
        match fields["type"]:
            case "Argument":
                return make(
                    ua.Argument,
                    Name=fields["Name"],
                    DataType=self.node_id(fields["DataType"]),
                    ValueRank=int(fields.get("ValueRank") or -1),
                    Description=text(fields.get("Description", "")),
                )
            case "EnumValueType":
                return make(
                    ua.EnumValueType,
                    Value=int(fields["Value"]),
                    DisplayName=text(fields.get("DisplayName", "")),
                    Description=text(fields.get("Description", "")),
                )
            case _:
                return make(ua.Range, Low=float(fields["Low"]), High=float(fields["High"]))


def _above(row: Row) -> str:
    """The type of which it is a subtype, "" where there is none."""
    upwards = (there for kind, forward, there in row.references if kind == _HAS_SUBTYPE and not forward)
    return next(upwards, "")
