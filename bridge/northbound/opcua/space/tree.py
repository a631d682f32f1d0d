"""The nodes of the points, below the Objects folder and the Server object.

asyncua would keep every attribute and every reference of each of them, a megabyte for a drive. Here only the
layout is kept, and all that clients see follows from it when they look. Of what they have looked at, the
references downwards are kept.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from typing import Final, Protocol, cast

from asyncua.server.address_space import AddressSpace, AttributeValue, NodeData

from bridge.command.messages.request import Role
from bridge.image import Image
from bridge.northbound.opcua.space.data_values import EpochNs, present_value
from bridge.northbound.opcua.space.kinds import Kinds, Name, Node
from bridge.northbound.opcua.space.nodes import FileNode, LiveProperty, MethodNode, ObjectNode, VariableNode
from bridge.northbound.opcua.space.permissions import least_role
from bridge.northbound.opcua.space.point_values import TEXT_OF_STATE, AllWatched, DerivedValue, PointValue
from bridge.northbound.opcua.space.structures import VALUE_AS_TEXT, PropertyNode, property_nodes, value_type
from bridge.northbound.opcua.space.words import state_named
from bridge.text import Text, Words
from bridge.uaserver.address_space import Attributes, Watchers, constant, put_behind
from bridge.uaserver.hierarchy import reference_to
from bridge.uaserver.library import AttributeIds, ObjectIds, data_value, node_id, text, ua, variant

_ORGANIZES: Final = node_id(ObjectIds.Organizes)
_HAS_COMPONENT: Final = node_id(ObjectIds.HasComponent)
_HAS_PROPERTY: Final = node_id(ObjectIds.HasProperty)
_HAS_NOTIFIER: Final = node_id(ObjectIds.HasNotifier)


class _TreeNode:
    """A node in place of asyncua's NodeData, with as much of it as is used. ``reference`` is the type of the
    reference to it from ``above``, which is None below the Objects folder."""

    __slots__ = ("_below", "_kind", "_tree", "above", "node", "reference")

    def __init__(self, tree: Tree, node: Node, above: _TreeNode | None, reference: ua.NodeId) -> None:
        self._tree = tree
        self._kind = tree.kinds.of(node)
        self._below: list[ua.ReferenceDescription] | None = None
        self.node = node
        self.above = above
        self.reference = reference

    @property
    def nodeid(self) -> ua.NodeId:
        return node_id(self.node.id, self._tree.namespace)

    @property
    def references(self) -> list[ua.ReferenceDescription]:
        if self._below is None:
            self._below = [below.refer(below.reference) for below in self._tree.below(self)]
            if isinstance(self.node, FileNode):
                self._below += self._tree.to_file_methods
        return [*self._upwards(), *self._below, *self._tree.beside.below(self.node.id)]

    @property
    def attributes(self) -> Attributes:
        own = _OWN_BY_NODE.get(type(self.node), _OWN)
        if isinstance(self.node, PropertyNode) and self.node.content is VALUE_AS_TEXT:
            own = _OWN_OF_TEXT
        return Attributes(self._kind.attributes, own, self)

    @property
    def is_notifier(self) -> bool:
        return isinstance(self.node, ObjectNode) and self.node.notifier

    def refer(self, reference: ua.NodeId, *, forward: bool = True) -> ua.ReferenceDescription:
        """A reference of this type to it."""
        kind, name = self._kind, self.name
        return ua.ReferenceDescription(
            reference, forward, self.nodeid, name.qualified, name.text, kind.node_class, kind.type_id
        )

    def _upwards(self) -> Iterator[ua.ReferenceDescription]:
        yield self.above.refer(self.reference, forward=False) if self.above else self._tree.to_objects
        yield from self._kind.to_type
        if self.is_notifier:
            # Of drives, too: below its node each stands once for who follows hierarchical references.
            yield self._tree.to_server

    # what it has for itself of its attributes

    @property
    def name(self) -> Name:
        # The names of properties are the standard's, in the standard's namespace.
        node = self.node
        is_standard = isinstance(node, PropertyNode) or (isinstance(node, LiveProperty) and node.standard)
        of_site = isinstance(node, ObjectNode) and not node.folder
        namespace = 0 if is_standard else self._tree.namespace
        return self._tree.kinds.name(node.browse_name, namespace, not is_standard and not of_site)

    def id_attribute(self) -> AttributeValue:
        made = constant(self.nodeid, ua.VariantType.NodeId)
        made.datachange_callbacks = self._tree.never_called
        return made

    def description_attribute(self) -> AttributeValue:
        return self._tree.kinds.description(_description(self.node))

    def value_attribute(self) -> AttributeValue:
        return self._tree.value_of(cast("VariableNode", self.node))

    def text_attribute(self) -> AttributeValue:
        above = cast("_TreeNode", self.above)
        return self._tree.text_of(cast("VariableNode", above.node))

    def live_attribute(self) -> AttributeValue:
        return self._tree.live[self.node.id]


_OWN: Final[Mapping[int, Callable[[_TreeNode], AttributeValue]]] = {
    AttributeIds.NodeId: _TreeNode.id_attribute,
    AttributeIds.BrowseName: lambda node: node.name.browse_name,
    AttributeIds.DisplayName: lambda node: node.name.display_name,
    AttributeIds.Description: _TreeNode.description_attribute,
}
_OWN_BY_NODE: Final[Mapping[type, Mapping[int, Callable[[_TreeNode], AttributeValue]]]] = {
    VariableNode: {**_OWN, AttributeIds.Value: _TreeNode.value_attribute},
    LiveProperty: {**_OWN, AttributeIds.Value: _TreeNode.live_attribute},
}
_FILE_METHODS: Final = (
    ObjectIds.FileType_Open,
    ObjectIds.FileType_Close,
    ObjectIds.FileType_Read,
    ObjectIds.FileType_Write,
    ObjectIds.FileType_GetPosition,
    ObjectIds.FileType_SetPosition,
)
_OWN_OF_TEXT: Final = {**_OWN, AttributeIds.Value: _TreeNode.text_attribute}


class Beside(Protocol):
    """Nodes that are not the tree's, and may stand below some of it."""

    def find(self, name: str, /) -> NodeData | None: ...

    def below(self, owner: str, /) -> Iterable[ua.ReferenceDescription]: ...


class _Nothing:
    def find(self, name: str, /) -> None:
        return None

    def below(self, owner: str, /) -> tuple[()]:
        return ()


class Tree:
    """The nodes of ``trees`` in ``space``. Raises ValueError where two have the same id.

    ``notifiers`` are the objects that send events, by their names, ``watched`` the variables with watchers,
    ``live`` the values of live properties by their ids. ``stands_for`` finds the point that a node beside the
    tree stands for. ``keeps_events``: past events are.
    """

    def __init__(
        self,
        space: AddressSpace,
        namespace: int,
        image: Image,
        epoch_ns: EpochNs,
        trees: Sequence[ObjectNode],
        *,
        stands_for: Callable[[str], VariableNode | None] = lambda _name: None,
        keeps_events: bool = False,
    ) -> None:
        self._image = image
        self._stands_for = stands_for
        self._epoch_ns = epoch_ns
        self._nodes: dict[str, _TreeNode] = {}
        self._latest_property: _TreeNode | None = None
        self.namespace = namespace
        self.kinds = Kinds(space, keeps_events=keeps_events)
        self.to_objects = reference_to(space, node_id(ObjectIds.ObjectsFolder), _ORGANIZES, forward=False)
        self.to_server = reference_to(space, node_id(ObjectIds.Server), _HAS_NOTIFIER, forward=False)
        # Files share the methods of their type.
        self.to_file_methods = [
            reference_to(space, node_id(method), _HAS_COMPONENT, forward=True) for method in _FILE_METHODS
        ]
        self.live: dict[str, AttributeValue] = {}
        self.notifiers: dict[str, ua.NodeId] = {}
        self.watched: AllWatched = {}
        self.beside: Beside = _Nothing()
        self.never_called: Watchers = {}
        """Watchers of attributes that never change: one empty table for all of them."""
        for tree in trees:
            self._add(tree, None, _ORGANIZES)
        self._attach(space, [self._nodes[tree.id] for tree in trees])

    def _add(self, node: Node, above: _TreeNode | None, reference: ua.NodeId) -> None:
        if node.id in self._nodes:
            raise ValueError(f"OPC UA: two nodes have the id {node.id!r}")
        made = self._nodes[node.id] = _TreeNode(self, node, above, reference)
        if made.is_notifier:
            self.notifiers[node.id] = made.nodeid
        if isinstance(node, LiveProperty):
            self.live[node.id] = AttributeValue(data_value(None))
        for kind, part in _parts(node):
            self._add(part, made, kind)

    def _attach(self, space: AddressSpace, tops: Iterable[_TreeNode]) -> None:
        """Refer to the tree from asyncua's nodes, and have it found behind them."""
        space[node_id(ObjectIds.ObjectsFolder)].references += [top.refer(_ORGANIZES) for top in tops]
        notifiers = [self._nodes[name] for name in self.notifiers]
        server = space[node_id(ObjectIds.Server)]
        server.references += [one.refer(_HAS_NOTIFIER) for one in notifiers]
        server.attributes[AttributeIds.EventNotifier] = constant(self.kinds.notifies, ua.VariantType.Byte)
        # Of each change a sample is kept: between two of them nothing has changed.
        stepped = space[node_id(ObjectIds.HAConfiguration_Stepped)]
        stepped.attributes[AttributeIds.Value] = constant(True, ua.VariantType.Boolean)
        put_behind(space, self._find)

    def method(self, where: ua.NodeId) -> MethodNode | None:
        node = self._node(where)
        return node if isinstance(node, MethodNode) else None

    def least_role(self, where: ua.NodeId) -> Role | None:
        """The role that writing or calling this node needs; None where nobody may."""
        node = self._node(where)
        return least_role(node) if node else None

    @property
    def drives(self) -> list[str]:
        """Names of the drives that have files."""
        nodes = (held.node for held in self._nodes.values())
        return list(dict.fromkeys(node.drive for node in nodes if isinstance(node, FileNode)))

    def point(self, where: ua.NodeId) -> int | None:
        """Place in the image of the point that a variable is; None where it is none, or one bit of it."""
        node = self._node(where)
        return node.index if isinstance(node, VariableNode) and node.bit is None else None

    def file(self, where: ua.NodeId) -> FileNode | None:
        node = self._node(where)
        return node if isinstance(node, FileNode) else None

    def writable(self, where: ua.NodeId) -> VariableNode | None:
        """The variable, where it is one that clients may write."""
        node = self._node(where) or self._stands_for(self._name(where))
        return node if isinstance(node, VariableNode) and node.writable else None

    def parameter(self, where: ua.NodeId) -> VariableNode | None:
        """The variable, where it is a parameter."""
        node = self._node(where)
        if not isinstance(node, VariableNode) or node.bit is not None:
            return None
        return node if node.point.path[-2] == "parameter" else None

    def _node(self, where: ua.NodeId) -> Node | None:
        found = self._nodes.get(self._name(where))
        return found.node if found else None

    def _name(self, where: ua.NodeId) -> str:
        """Id in the layout; "" for a NodeId that can have none."""
        name = where.Identifier
        return name if where.NamespaceIndex == self.namespace and isinstance(name, str) else ""

    def _find(self, where: ua.NodeId) -> NodeData | None:
        name = self._name(where)
        found = self._nodes.get(name) or self._property(name)
        return cast("NodeData", found) if found else self.beside.find(name)

    def _property(self, name: str) -> _TreeNode | None:
        # Clients ask for one attribute of a node after the other.
        if self._latest_property and self._latest_property.node.id == name:
            return self._latest_property
        owner = self._nodes.get(name.rpartition("/")[0])
        for one in self._properties(owner) if owner else ():
            if one.node.id == name:
                self._latest_property = one
                return one
        return None

    def below(self, above: _TreeNode) -> Iterator[_TreeNode]:
        yield from self._properties(above)
        for _, part in _parts(above.node):
            yield self._nodes[part.id]

    def _properties(self, owner: _TreeNode) -> Iterator[_TreeNode]:
        if isinstance(owner.node, MethodNode | VariableNode):
            for one in property_nodes(owner.node):
                yield _TreeNode(self, one, owner, _HAS_PROPERTY)

    def value_of(self, node: VariableNode) -> PointValue:
        return PointValue(self._image, self._epoch_ns, node, self.watched)

    def text_of(self, node: VariableNode) -> DerivedValue:
        """The state that a point is in, in words."""
        read = partial(self._state, node, dict(node.point.states))
        return DerivedValue((node,), TEXT_OF_STATE, read, self.watched)

    def _state(self, node: VariableNode, states: Mapping[int, Words]) -> ua.DataValue:
        told = present_value(self._image, node.index, value_type(node), self._epoch_ns)
        if told.Value is None or told.Value.Value is None:
            return told
        state = states.get(told.Value.Value, "")
        words = variant(state_named(state) if state else text(""), ua.VariantType.LocalizedText)
        return data_value(words, told.StatusCode, told.SourceTimestamp, told.ServerTimestamp)


def _description(node: Node) -> Words:
    match node:
        case MethodNode():
            return node.description
        case VariableNode(bit=int(bit)):
            return Text.of("point.bit", number=bit, word=node.point.leaf)
        case VariableNode():
            return node.point.description
        case _:
            return ""


def _parts(node: Node) -> Iterator[tuple[ua.NodeId, Node]]:
    """Children of a node besides its properties, each with the type of the reference to it."""
    match node:
        case ObjectNode():
            for method in node.methods:
                yield _HAS_COMPONENT, method
            for child in node.objects:
                yield _ORGANIZES if node.folder else _HAS_COMPONENT, child
            for variable in node.variables:
                yield _HAS_COMPONENT, variable
            for file in node.files:
                yield _HAS_COMPONENT, file
        case FileNode():
            for live in node.properties:
                yield _HAS_PROPERTY, live
        case VariableNode():
            for bit in node.bits:
                yield _HAS_COMPONENT, bit
        case _:
            pass
