"""Types and their subtypes in the address space, which no longer changes once clients are let in."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from asyncua.server.address_space import AddressSpace

from bridge.uaserver.library import AttributeIds, ObjectIds, StatusCodes, get, make, node_id, ua

_BASE_EVENT: Final = node_id(ObjectIds.BaseEventType)
_NULL: Final = node_id(ObjectIds.Null)
_LONGEST_PATH: Final = 10
_PARTS: Final = (ObjectIds.HasProperty, ObjectIds.HasComponent)

_Path = tuple[tuple[int, str | None], ...]
"""BrowseNames, each with its namespace."""


def related(
    space: AddressSpace, start: ua.NodeId, reference: int, *, forward: bool = True
) -> Iterator[ua.ReferenceDescription]:
    """The references of exactly this type that leave ``start``, or lead to it."""
    node = space.get(start)
    wanted = node_id(reference)
    for found in node.references if node else ():
        if get(found, "IsForward") == forward and get(found, "ReferenceTypeId") == wanted:
            yield found


def reference_to(
    space: AddressSpace, target: ua.NodeId, reference: ua.NodeId, *, forward: bool
) -> ua.ReferenceDescription:
    """A reference of this type to a node of ``space``, as asyncua describes it."""
    fields = {
        name: get(space.read_attribute_value(target, attribute).Value, "Value")
        for name, attribute in (
            ("NodeClass", AttributeIds.NodeClass),
            ("BrowseName", AttributeIds.BrowseName),
            ("DisplayName", AttributeIds.DisplayName),
        )
    }
    of_type = next(related(space, target, ObjectIds.HasTypeDefinition), None)
    if of_type:
        fields["TypeDefinition"] = get(of_type, "NodeId")
    return make(
        ua.ReferenceDescription, ReferenceTypeId=reference, IsForward=forward, NodeId=target, **fields
    )


def subtypes(space: AddressSpace, root: ua.NodeId) -> set[ua.NodeId]:
    """``root`` and every type below it."""
    found = {root}
    waiting = [root]
    while waiting:
        for reference in related(space, waiting.pop(), ObjectIds.HasSubtype):
            below: ua.NodeId = get(reference, "NodeId")
            if below not in found:
                found.add(below)
                waiting.append(below)
    return found


def supertypes(space: AddressSpace, start: ua.NodeId) -> list[ua.NodeId]:
    """``start`` and every type above it, upwards."""
    found = [start]
    while above := next(related(space, found[-1], ObjectIds.HasSubtype, forward=False), None):
        where: ua.NodeId = get(above, "NodeId")
        if where in found:
            break
        found.append(where)
    return found


class EventTypes:
    """The event types of the address space and the fields that they declare, looked up once."""

    def __init__(self, space: AddressSpace) -> None:
        self._space = space
        self._above: dict[ua.NodeId, list[ua.NodeId]] = {}
        self._declared: dict[ua.NodeId, set[_Path]] = {}
        self._all: set[_Path] = set()

    def look(self) -> None:
        """Look at the types; no others may be added later."""
        for kind in subtypes(self._space, _BASE_EVENT):
            self._above[kind] = supertypes(self._space, kind)
            self._declared[kind] = set(self._paths(kind, ()))
            self._all |= self._declared[kind]

    def _paths(self, owner: ua.NodeId, above: _Path) -> Iterator[_Path]:
        for kind in _PARTS if len(above) < _LONGEST_PATH else ():
            for found in related(self._space, owner, kind):
                name: ua.QualifiedName = get(found, "BrowseName")
                path = (*above, (name.NamespaceIndex, name.Name))
                yield path
                yield from self._paths(get(found, "NodeId"), path)

    def __contains__(self, kind: object) -> bool:
        # A literal of a client may be anything, a list included.
        return isinstance(kind, ua.NodeId) and kind in self._above

    def is_of(self, kind: object, wanted: ua.NodeId) -> bool:
        """Whether the event type ``kind`` is ``wanted`` or below it."""
        return isinstance(kind, ua.NodeId) and wanted in self._above.get(kind, ())

    def fault(self, operand: object) -> int:
        """Status code of an operand that names a field; Good where nothing is wrong."""
        type_id: ua.NodeId = get(operand, "TypeDefinitionId")
        names: list[ua.QualifiedName] = get(operand, "BrowsePath") or []
        attribute: int = get(operand, "AttributeId")
        if type_id == _NULL:
            type_id = _BASE_EVENT
        if type_id not in self:
            return StatusCodes.BadTypeDefinitionInvalid
        if not names:
            # Part 9 §5.5.2: the NodeId of a condition is asked for in this way.
            is_node_id = attribute == AttributeIds.NodeId
            return StatusCodes.Good if is_node_id else StatusCodes.BadNodeIdUnknown
        if len(names) > _LONGEST_PATH or not all(name.Name for name in names):
            return StatusCodes.BadBrowseNameInvalid
        path = tuple((name.NamespaceIndex, name.Name) for name in names)
        # With BaseEventType the path counts, whatever the type.
        owners = self._above[type_id]
        declared = type_id == _BASE_EVENT and path in self._all
        if not declared and not any(path in self._declared.get(owner, ()) for owner in owners):
            return StatusCodes.BadNodeIdUnknown
        if attribute not in (AttributeIds.Value, AttributeIds.NodeId):
            return StatusCodes.BadAttributeIdInvalid
        return StatusCodes.BadIndexRangeNoData if get(operand, "IndexRange") else StatusCodes.Good
