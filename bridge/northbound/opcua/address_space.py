"""From the layout to nodes of asyncua's address space.

Every variable reads from the image when it is asked: a node that nobody watches costs nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Final

from asyncua.server.address_space import AddressSpace, AttributeValue, NodeManagementService

from bridge.image import Image
from bridge.northbound.opcua.library import (
    AttributeIds,
    ObjectIds,
    data_value,
    get,
    make,
    node_id,
    text,
    ua,
    variant,
)
from bridge.northbound.opcua.nodes import MethodNode, ObjectNode, VariableKind, VariableNode
from bridge.northbound.opcua.structures import (
    Property,
    arguments,
    point_attributes,
    properties,
    property_attributes,
)
from bridge.northbound.opcua.values import VARIANT_TYPE, EpochNs, reader

_SUBSCRIBE_TO_EVENTS: Final = 1

_TYPE_DEFINITION: Final = {
    VariableKind.PLAIN: ObjectIds.BaseDataVariableType,
    VariableKind.ANALOG: ObjectIds.AnalogUnitType,
    VariableKind.MULTI_STATE: ObjectIds.MultiStateDiscreteType,
    VariableKind.TWO_STATE: ObjectIds.TwoStateDiscreteType,
}

_OWN: Final = frozenset(
    (
        AttributeIds.NodeId,
        AttributeIds.BrowseName,
        AttributeIds.DisplayName,
        AttributeIds.Description,
        AttributeIds.Value,
    )
)
"""What each node has for itself. Of all else one object serves thousands of nodes, which takes half of the
memory away; nobody can write it."""


@dataclass(frozen=True, slots=True)
class Binding:
    """One variable of a point: the attribute that holds who watches it, and how to read it."""

    value: AttributeValue
    read: Callable[[], ua.DataValue]


@dataclass(slots=True)
class Bindings:
    """What the server finds again after the build. ``variables`` is in the order of the image."""

    variables: list[list[Binding]]
    writable: dict[ua.NodeId, VariableNode] = field(default_factory=dict[ua.NodeId, VariableNode])
    methods: dict[ua.NodeId, MethodNode] = field(default_factory=dict[ua.NodeId, MethodNode])
    notifiers: dict[str, ua.NodeId] = field(default_factory=dict[str, ua.NodeId])


@dataclass(frozen=True, slots=True)
class _New:
    """A node that is not there yet; ``namespace`` is that of its BrowseName."""

    id: str
    browse_name: str
    node_class: ua.NodeClass
    attributes: ua.NodeAttributes
    type_id: int = ObjectIds.Null
    description: str = ""
    namespace: int | None = None


class Builder:
    """Adds the tree to an address space. Raises ValueError where asyncua takes a node for wrong."""

    def __init__(self, space: AddressSpace, namespace: int, image: Image, epoch_ns: EpochNs) -> None:
        self._space = space
        self._management = NodeManagementService(space)
        self._namespace = namespace
        self._image = image
        self._epoch_ns = epoch_ns
        self._shared: dict[tuple[AttributeIds, str], AttributeValue] = {}
        self.bindings = Bindings([[] for _ in image.points])

    def id(self, name: str) -> ua.NodeId:
        return node_id(name, self._namespace)

    def build(self, trees: Sequence[ObjectNode]) -> Bindings:
        server = node_id(ObjectIds.Server)
        self._subscribe_to_events(server)
        for tree in trees:
            self._object(tree, node_id(ObjectIds.ObjectsFolder), ObjectIds.Organizes, server)
        return self.bindings

    def object_type(self, name: str, parent: ua.NodeId) -> ua.NodeId:
        """A type without instances of its own, for events."""
        return self._add(
            _New(name, name, ua.NodeClass.ObjectType, ua.ObjectTypeAttributes()), parent, ObjectIds.HasSubtype
        )

    def _object(self, node: ObjectNode, parent: ua.NodeId, reference: int, notifier: ua.NodeId) -> None:
        attributes = make(ua.ObjectAttributes, EventNotifier=_SUBSCRIBE_TO_EVENTS if node.notifier else 0)
        type_id = ObjectIds.FolderType if node.folder else ObjectIds.BaseObjectType
        new = _New(node.id, node.browse_name, ua.NodeClass.Object, attributes, type_id)
        where = self._add(new, parent, reference)
        if node.notifier:
            self.bindings.notifiers[node.id] = where
            self._refer(notifier, ObjectIds.HasNotifier, where)
            notifier = where
        for method in node.methods:
            self._method(method, where)
        below = ObjectIds.Organizes if node.folder else ObjectIds.HasComponent
        for child in node.objects:
            self._object(child, where, below, notifier)
        for variable in node.variables:
            self._variable(variable, where)

    def _method(self, method: MethodNode, parent: ua.NodeId) -> None:
        attributes = make(ua.MethodAttributes, Executable=True, UserExecutable=True)
        new = _New(
            method.id, method.browse_name, ua.NodeClass.Method, attributes, description=method.description
        )
        where = self._add(new, parent, ObjectIds.HasComponent)
        self.bindings.methods[where] = method
        if method.arguments:
            self._property(where, method.id, arguments("InputArguments", method.arguments))
        if method.results:
            self._property(where, method.id, arguments("OutputArguments", method.results))

    def _variable(self, node: VariableNode, parent: ua.NodeId) -> None:
        kind = VARIANT_TYPE[node.point.data_type] if node.bit is None else ua.VariantType.Boolean
        new = _New(
            node.id,
            node.browse_name,
            ua.NodeClass.Variable,
            point_attributes(kind, writable=node.writable),
            _TYPE_DEFINITION[node.kind],
            node.point.description if node.bit is None else f"bit {node.bit} of {node.point.leaf}",
        )
        where = self._add(new, parent, ObjectIds.HasComponent)
        value = self._space[where].attributes[AttributeIds.Value]
        read = reader(self._image, node.index, kind, self._epoch_ns, node.bit)
        value.value = None
        value.value_callback = read
        self.bindings.variables[node.index].append(Binding(value, read))
        if node.writable:
            self.bindings.writable[where] = node
        for entry in properties(node):
            self._property(where, node.id, entry)
        for bit in node.bits:
            self._variable(bit, where)

    def _property(self, parent: ua.NodeId, parent_name: str, entry: Property) -> None:
        name, value, data_type = entry
        new = _New(
            f"{parent_name}/{name}",
            name,
            ua.NodeClass.Variable,
            property_attributes(value, data_type),
            ObjectIds.PropertyType,
            # The names of properties are the standard's, in the standard's namespace.
            namespace=0,
        )
        self._add(new, parent, ObjectIds.HasProperty)

    def _add(self, new: _New, parent: ua.NodeId, reference: int) -> ua.NodeId:
        """The one place where a node is added."""
        namespace = self._namespace if new.namespace is None else new.namespace
        new.attributes.DisplayName = text(new.browse_name)
        new.attributes.Description = text(new.description)
        item = make(
            ua.AddNodesItem,
            RequestedNewNodeId=self.id(new.id),
            BrowseName=ua.QualifiedName(new.browse_name, namespace),
            NodeClass=new.node_class,
            ParentNodeId=parent,
            ReferenceTypeId=node_id(reference),
            NodeAttributes=new.attributes,
            TypeDefinition=node_id(new.type_id),
        )
        (result,) = self._management.add_nodes([item])
        status: ua.StatusCode = get(result, "StatusCode")
        if not status.is_good():
            raise ValueError(f"OPC UA node {new.id!r}: {status.name}")
        where: ua.NodeId = get(result, "AddedNodeId")
        self._share(where)
        return where

    def _share(self, where: ua.NodeId) -> None:
        attributes = self._space[where].attributes
        for attribute in attributes.keys() - _OWN:
            held = attributes[attribute].value
            if held is not None and held.Value is not None:
                key = (attribute, str(held.Value.Value))
                attributes[attribute] = self._shared.setdefault(key, attributes[attribute])

    def _refer(self, source: ua.NodeId, reference: int, target: ua.NodeId) -> None:
        for forward, start, end in ((True, source, target), (False, target, source)):
            item = make(
                ua.AddReferencesItem,
                SourceNodeId=start,
                ReferenceTypeId=node_id(reference),
                IsForward=forward,
                TargetNodeId=end,
                TargetNodeClass=ua.NodeClass.Object,
            )
            self._management.add_references([item])

    def _subscribe_to_events(self, where: ua.NodeId) -> None:
        value = variant(_SUBSCRIBE_TO_EVENTS, ua.VariantType.Byte)
        self._space[where].attributes[AttributeIds.EventNotifier] = AttributeValue(data_value(value))
