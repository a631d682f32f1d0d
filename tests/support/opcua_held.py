"""The tree as asyncua's own services make and hold it: node by node, each with all that belongs to it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from asyncua import ua
from asyncua.server.address_space import AddressSpace, AttributeValue, NodeData, NodeManagementService
from asyncua.ua.ua_binary import struct_to_binary

from bridge.northbound.opcua.space.nodes import FileNode, MethodNode, ObjectNode, VariableKind, VariableNode
from bridge.northbound.opcua.space.structures import (
    VALUE_AS_TEXT,
    point_attributes,
    property_attributes,
    property_nodes,
    value_type,
)
from bridge.northbound.opcua.space.words import named, spoken
from bridge.text import Text, Words
from bridge.uaserver.address_space import is_empty
from bridge.uaserver.library import make, node_id, text

Ids = ua.ObjectIds
_UNKNOWN = (
    ua.AttributeIds.RolePermissions,
    ua.AttributeIds.UserRolePermissions,
    ua.AttributeIds.AccessRestrictions,
    ua.AttributeIds.AccessLevelEx,
)
"""Attributes that asyncua's services do not make."""
_CHANGED = (Ids.ObjectsFolder, Ids.Server)
_TYPES = {
    VariableKind.PLAIN: Ids.BaseDataVariableType,
    VariableKind.ANALOG: Ids.AnalogUnitType,
    VariableKind.MULTI_STATE: Ids.MultiStateDiscreteType,
    VariableKind.MULTI_STATE_VALUE: Ids.MultiStateValueDiscreteType,
    VariableKind.TWO_STATE: Ids.TwoStateDiscreteType,
}


def copy_of(standard: AddressSpace) -> AddressSpace:
    """Another space on the same nodes, besides those that a tree changes."""
    made = AddressSpace()
    made._nodes = dict(standard._nodes)
    for number in _CHANGED:
        before, node = standard[ua.NodeId(number)], NodeData(ua.NodeId(number))
        node.attributes, node.references = dict(before.attributes), list(before.references)
        made[node.nodeid] = node
    return made


Seen = tuple[list[bytes], dict[int, bytes]]
"""References and attributes as they go to clients."""


class HeldTree:
    """The nodes of ``trees`` in ``space``. ``ids`` are theirs, ``points`` those with a value that changes.
    ``notifies`` is the EventNotifier of those that tell events."""

    def __init__(
        self, space: AddressSpace, namespace: int, trees: Sequence[ObjectNode], notifies: int = 1
    ) -> None:
        self.space = space
        self.ids: list[ua.NodeId] = []
        self.points: set[ua.NodeId] = set()
        self._namespace = namespace
        self._management = NodeManagementService(space)
        server = ua.NodeId(Ids.Server)
        self._notifies = notifies
        told = ua.DataValue(ua.Variant(notifies, ua.VariantType.Byte))
        space[server].attributes[ua.AttributeIds.EventNotifier] = AttributeValue(told)
        for tree in trees:
            self._object(tree, ua.NodeId(Ids.ObjectsFolder), Ids.Organizes)

    def seen(self, where: ua.NodeId, space: AddressSpace | None = None) -> Seen:
        """Node as clients see it here or in another ``space``, without times and values of points, and
        without what asyncua leaves empty or does not know."""
        space = space or self.space
        node = space[where]
        kinds = [
            kind
            for kind, held in node.attributes.items()
            if kind not in _UNKNOWN
            and (kind != ua.AttributeIds.Value or where not in self.points)
            and not is_empty(held)
        ]
        values = {int(kind): space.read_attribute_value(where, kind) for kind in kinds}
        references = [struct_to_binary(one) for one in node.references]
        return references, {kind: as_told(value) for kind, value in values.items()}

    def _object(self, node: ObjectNode, parent: ua.NodeId, reference: int) -> None:
        attributes = make(ua.ObjectAttributes, EventNotifier=self._notifies if node.notifier else 0)
        type_id = Ids.FolderType if node.folder else Ids.BaseObjectType
        where = self._add(node, ua.NodeClass.Object, attributes, type_id, parent, reference)
        if node.notifier:
            self._refer(ua.NodeId(Ids.Server), Ids.HasNotifier, where)
        for method in node.methods:
            self._method(method, where)
        for child in node.objects:
            self._object(child, where, Ids.Organizes if node.folder else Ids.HasComponent)
        for variable in node.variables:
            self._variable(variable, where)
        for file in node.files:
            self._file(file, where)

    def _file(self, node: FileNode, parent: ua.NodeId) -> None:
        attributes = make(ua.ObjectAttributes, EventNotifier=0)
        where = self._add(node, ua.NodeClass.Object, attributes, Ids.FileType, parent, Ids.HasComponent)
        for live in node.properties:
            attributes = point_attributes(ua.VariantType[live.type.value])
            how = Ids.PropertyType, where, Ids.HasProperty, "", 0 if live.standard else None
            self.points.add(self._add(live, ua.NodeClass.Variable, attributes, *how))
        for method in ("Open", "Close", "Read", "Write", "GetPosition", "SetPosition"):
            target = ua.NodeId(getattr(Ids, f"FileType_{method}"))
            self._refer(where, Ids.HasComponent, target, ua.NodeClass.Method, one_way=True)

    def _method(self, method: MethodNode, parent: ua.NodeId) -> None:
        attributes = make(ua.MethodAttributes, Executable=True, UserExecutable=True)
        where = self._add(
            method, ua.NodeClass.Method, attributes, Ids.Null, parent, Ids.HasComponent, method.description
        )
        self._properties(method, where)

    def _variable(self, node: VariableNode, parent: ua.NodeId) -> None:
        told = node.point.description
        if node.bit is not None:
            told = Text.of("point.bit", number=node.bit, word=node.point.leaf)
        attributes = point_attributes(value_type(node), writable=node.writable, kept=node.kept)
        where = self._add(
            node, ua.NodeClass.Variable, attributes, _TYPES[node.kind], parent, Ids.HasComponent, told
        )
        self.points.add(where)
        if node.kept:
            self._refer(where, Ids.HasHistoricalConfiguration, ua.NodeId(Ids.HAConfiguration), one_way=True)
        self._properties(node, where)
        for bit in node.bits:
            self._variable(bit, where)

    def _properties(self, node: MethodNode | VariableNode, parent: ua.NodeId) -> None:
        for one in property_nodes(node):
            attributes = property_attributes(one.content)
            where = self._add(
                one, ua.NodeClass.Variable, attributes, Ids.PropertyType, parent, Ids.HasProperty, "", 0
            )
            if one.content is VALUE_AS_TEXT:
                self.points.add(where)

    def _add(
        self,
        node: Any,
        node_class: ua.NodeClass,
        attributes: Any,
        type_id: int,
        parent: ua.NodeId,
        reference: int,
        description: Words = "",
        namespace: int | None = None,
    ) -> ua.NodeId:
        of_site = isinstance(node, ObjectNode) and not node.folder
        own = not of_site and namespace is None
        attributes.DisplayName = named(node.browse_name) if own else text(node.browse_name)
        attributes.Description = spoken(description)
        item = make(
            ua.AddNodesItem,
            RequestedNewNodeId=node_id(node.id, self._namespace),
            BrowseName=ua.QualifiedName(
                node.browse_name, self._namespace if namespace is None else namespace
            ),
            NodeClass=node_class,
            ParentNodeId=parent,
            ReferenceTypeId=ua.NodeId(reference),
            NodeAttributes=attributes,
            TypeDefinition=ua.NodeId(type_id),
        )
        (result,) = self._management.add_nodes([item])
        result.StatusCode.check()
        self.ids.append(result.AddedNodeId)
        return result.AddedNodeId

    def _refer(
        self,
        source: ua.NodeId,
        reference: int,
        target: ua.NodeId,
        kind: ua.NodeClass = ua.NodeClass.Object,
        *,
        one_way: bool = False,
    ) -> None:
        ways = ((True, source, target), (False, target, source))
        for forward, start, end in ways[:1] if one_way else ways:
            item = make(
                ua.AddReferencesItem,
                SourceNodeId=start,
                ReferenceTypeId=ua.NodeId(reference),
                IsForward=forward,
                TargetNodeId=end,
                TargetNodeClass=kind,
            )
            self._management.add_references([item])


def as_told(value: ua.DataValue) -> bytes:
    """Without its times."""
    return struct_to_binary(ua.DataValue(value.Value, value.StatusCode))
