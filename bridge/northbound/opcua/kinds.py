"""Attributes and references that all nodes of a kind share: made once, by asyncua, instead of for each of
them."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import cache
from typing import Final

from asyncua.server.address_space import AddressSpace, AttributeValue, NodeManagementService

from bridge.northbound.opcua.nodes import (
    FileNode,
    LiveProperty,
    MethodNode,
    ObjectNode,
    VariableKind,
    VariableNode,
)
from bridge.northbound.opcua.structures import (
    PropertyNode,
    point_attributes,
    property_attributes,
    value_type,
)
from bridge.uaserver.address_space import is_empty
from bridge.uaserver.hierarchy import related
from bridge.uaserver.library import (
    AttributeIds,
    ObjectIds,
    change,
    data_value,
    get,
    make,
    node_id,
    text,
    ua,
    variant,
)

Node = ObjectNode | MethodNode | VariableNode | PropertyNode | FileNode | LiveProperty

SUBSCRIBE_TO_EVENTS: Final = 1
READ_EVENT_HISTORY: Final = 4
_ANY: Final = node_id("any", 1)
_TYPE_DEFINITION: Final = {
    VariableKind.PLAIN: ObjectIds.BaseDataVariableType,
    VariableKind.ANALOG: ObjectIds.AnalogUnitType,
    VariableKind.MULTI_STATE: ObjectIds.MultiStateDiscreteType,
    VariableKind.TWO_STATE: ObjectIds.TwoStateDiscreteType,
}


@dataclass(frozen=True, slots=True)
class NodeKind:
    """One kind of node. ``to_type`` are references to the type ``type_id``, which a method does
    not have, and to other nodes of the standard's."""

    attributes: Mapping[AttributeIds, AttributeValue]
    node_class: ua.NodeClass
    type_id: ua.NodeId
    to_type: tuple[ua.ReferenceDescription, ...]


@dataclass(frozen=True, slots=True)
class Name:
    """Attributes that follow from a name, made once: drives have nodes of the same names."""

    qualified: ua.QualifiedName
    text: ua.LocalizedText
    browse_name: AttributeValue
    display_name: AttributeValue


class Kinds:
    """Shared parts of the nodes of a tree in ``space``. No client can write any of them. ``keeps_events``:
    past events are."""

    def __init__(self, space: AddressSpace, *, keeps_events: bool = False) -> None:
        self.notifies = SUBSCRIBE_TO_EVENTS | (READ_EVENT_HISTORY if keeps_events else 0)
        """EventNotifier of objects that tell events."""
        self._space = space
        self._known: dict[Hashable, NodeKind] = {}
        self._built_at = datetime.now(UTC)
        self.name = cache(_name)
        self.description = cache(_description)

    def of(self, node: Node) -> NodeKind:
        key = _key(node)
        found = self._known.get(key)
        if found is None:
            found = self._known[key] = self._make(node)
        return found

    def _make(self, node: Node) -> NodeKind:
        match node:
            case ObjectNode():
                node_class = ua.NodeClass.Object
                type_id = ObjectIds.FolderType if node.folder else ObjectIds.BaseObjectType
                wanted = make(ua.ObjectAttributes, EventNotifier=self.notifies if node.notifier else 0)
            case MethodNode():
                node_class, type_id = ua.NodeClass.Method, ObjectIds.Null
                wanted = make(ua.MethodAttributes, Executable=True, UserExecutable=True)
            case VariableNode():
                node_class, type_id = ua.NodeClass.Variable, _TYPE_DEFINITION[node.kind]
                wanted = point_attributes(value_type(node), writable=node.writable, kept=node.kept)
            case PropertyNode():
                node_class, type_id = ua.NodeClass.Variable, ObjectIds.PropertyType
                wanted = property_attributes(node.content)
            case LiveProperty():
                node_class, type_id = ua.NodeClass.Variable, ObjectIds.PropertyType
                wanted = point_attributes(ua.VariantType[node.type.value])
            case FileNode():
                node_class, type_id = ua.NodeClass.Object, ObjectIds.FileType
                wanted = make(ua.ObjectAttributes, EventNotifier=0)
        attributes = node_attributes(node_class, wanted)
        if isinstance(node, PropertyNode):
            held = attributes[AttributeIds.Value].value
            change(held, SourceTimestamp=self._built_at, ServerTimestamp=self._built_at)
        to_type = ()
        if type_id != ObjectIds.Null:
            to_type = (reference_to(self._space, type_id, ObjectIds.HasTypeDefinition, forward=True),)
        if isinstance(node, VariableNode) and node.kept:
            how = reference_to(
                self._space, ObjectIds.HAConfiguration, ObjectIds.HasHistoricalConfiguration, forward=True
            )
            to_type = (*to_type, how)
        return NodeKind(attributes, node_class, node_id(type_id), to_type)


def constant(value: object, kind: ua.VariantType) -> AttributeValue:
    return AttributeValue(data_value(variant(value, kind)))


def _name(name: str, namespace: int) -> Name:
    qualified, words = ua.QualifiedName(name, namespace), text(name)
    return Name(
        qualified,
        words,
        constant(qualified, ua.VariantType.QualifiedName),
        constant(words, ua.VariantType.LocalizedText),
    )


def _description(words: str) -> AttributeValue:
    return constant(text(words), ua.VariantType.LocalizedText)


def reference_to(
    space: AddressSpace, target: int | ua.NodeId, reference: int, *, forward: bool
) -> ua.ReferenceDescription:
    """A reference of this type to a node that asyncua holds, as asyncua describes it; a number is a node of
    the standard's."""
    where = node_id(target) if isinstance(target, int) else target
    fields = {
        name: get(space.read_attribute_value(where, attribute).Value, "Value")
        for name, attribute in (
            ("NodeClass", AttributeIds.NodeClass),
            ("BrowseName", AttributeIds.BrowseName),
            ("DisplayName", AttributeIds.DisplayName),
        )
    }
    of_type = next(related(space, where, ObjectIds.HasTypeDefinition), None)
    if of_type:
        fields["TypeDefinition"] = get(of_type, "NodeId")
    return make(
        ua.ReferenceDescription,
        ReferenceTypeId=node_id(reference),
        IsForward=forward,
        NodeId=where,
        **fields,
    )


def _key(node: Node) -> Hashable:
    match node:
        case ObjectNode():
            return node.folder, node.notifier
        case MethodNode():
            return MethodNode
        case VariableNode():
            return node.kind, value_type(node), node.writable, node.kept
        case PropertyNode():
            return node.content
        case LiveProperty():
            return node.type
        case FileNode():
            return FileNode


def node_attributes(
    node_class: ua.NodeClass, wanted: ua.NodeAttributes
) -> dict[AttributeIds, AttributeValue]:
    """Attributes of a node as asyncua makes them."""
    space = AddressSpace()
    item = make(ua.AddNodesItem, RequestedNewNodeId=_ANY, NodeClass=node_class, NodeAttributes=wanted)
    # Without its checks: there is no parent.
    refused = list(NodeManagementService(space).try_add_nodes([item], check=False))
    if refused:
        raise ValueError(f"OPC UA: no {node_class.name} can have {wanted}")
    made = space[_ANY].attributes
    # The values of points are where they are; of all else that is empty there is nothing.
    return {kind: held for kind, held in made.items() if kind == AttributeIds.Value or not is_empty(held)}
