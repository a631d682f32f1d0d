"""Attributes and references that all nodes of a kind share: made once, by asyncua, instead of for each of
them."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import cache
from typing import Final

from asyncua.server.address_space import AddressSpace, AttributeValue, NodeManagementService

from bridge.northbound.opcua.space.nodes import (
    FileNode,
    LiveProperty,
    MethodNode,
    ObjectNode,
    VariableKind,
    VariableNode,
)
from bridge.northbound.opcua.space.permissions import least_role, permission, role_permissions
from bridge.northbound.opcua.space.structures import (
    PropertyNode,
    point_attributes,
    property_attributes,
    value_type,
)
from bridge.northbound.opcua.space.words import named, spoken
from bridge.text import Words
from bridge.uaserver.address_space import access_level_ex, constant, is_empty
from bridge.uaserver.hierarchy import reference_to
from bridge.uaserver.library import (
    AttributeIds,
    ObjectIds,
    change,
    get,
    make,
    node_id,
    text,
    ua,
)

Node = ObjectNode | MethodNode | VariableNode | PropertyNode | FileNode | LiveProperty

SUBSCRIBE_TO_EVENTS: Final = 1
READ_EVENT_HISTORY: Final = 4
_ANY: Final = node_id("any", 1)
_NO_RESTRICTION: Final = constant(0, ua.VariantType.UInt16)
"""A channel without security will do, where there is one at all (Part 3 §5.2.11)."""
_TYPE_DEFINITION: Final = {
    VariableKind.PLAIN: ObjectIds.BaseDataVariableType,
    VariableKind.ANALOG: ObjectIds.AnalogUnitType,
    VariableKind.MULTI_STATE: ObjectIds.MultiStateDiscreteType,
    VariableKind.MULTI_STATE_VALUE: ObjectIds.MultiStateValueDiscreteType,
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
        attributes |= _permissions(node)
        if isinstance(node, PropertyNode):
            held = attributes[AttributeIds.Value].value
            change(held, SourceTimestamp=self._built_at, ServerTimestamp=self._built_at)
        to_type = ()
        if type_id != ObjectIds.Null:
            kind = node_id(ObjectIds.HasTypeDefinition)
            to_type = (reference_to(self._space, node_id(type_id), kind, forward=True),)
        if isinstance(node, VariableNode) and node.kept:
            kind = node_id(ObjectIds.HasHistoricalConfiguration)
            how = reference_to(self._space, node_id(ObjectIds.HAConfiguration), kind, forward=True)
            to_type = (*to_type, how)
        return NodeKind(attributes, node_class, node_id(type_id), to_type)


def _permissions(node: Node) -> dict[AttributeIds, AttributeValue]:
    """Attributes of what each role may; a session shows a user its own."""
    sends_events = isinstance(node, ObjectNode) and node.notifier
    is_kept = isinstance(node, VariableNode) and node.kept
    table = role_permissions(least_role(node), permission(node), sends_events=sends_events, is_kept=is_kept)
    return {
        AttributeIds.RolePermissions: table,
        AttributeIds.UserRolePermissions: table,
        AttributeIds.AccessRestrictions: _NO_RESTRICTION,
    }


def _name(name: str, namespace: int, is_ours: bool = False) -> Name:
    """``is_ours``: a name of the program's, which it can say in each language."""
    qualified, words = ua.QualifiedName(name, namespace), named(name) if is_ours else text(name)
    return Name(
        qualified,
        words,
        constant(qualified, ua.VariantType.QualifiedName),
        constant(words, ua.VariantType.LocalizedText),
    )


def _description(words: Words) -> AttributeValue:
    return constant(spoken(words), ua.VariantType.LocalizedText)


def _key(node: Node) -> Hashable:
    match node:
        case ObjectNode():
            return node.folder, node.notifier
        case MethodNode():
            return MethodNode, least_role(node)
        case VariableNode():
            return node.kind, value_type(node), node.writable, node.kept, least_role(node)
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
    if isinstance(wanted, ua.VariableAttributes):
        extended = access_level_ex(get(wanted, "AccessLevel"))
        made[AttributeIds.AccessLevelEx] = constant(extended, ua.VariantType.UInt32)
    # The values of points are where they are; of all else that is empty there is nothing.
    return {kind: held for kind, held in made.items() if kind == AttributeIds.Value or not is_empty(held)}
