"""Which events a client wants to hear, and which fields of them: EventFilter (OPC 10000-4 §7.22.3)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from asyncua.server.address_space import AddressSpace

from bridge.northbound.opcua.filters import is_none
from bridge.northbound.opcua.hierarchy import related, subtypes, supertypes
from bridge.northbound.opcua.library import (
    AttributeIds,
    DataChangeFilter,
    ObjectIds,
    ServiceError,
    StatusCodes,
    get,
    make,
    node_id,
    status,
    ua,
    variant,
)
from bridge.northbound.opcua.where import Where, field_name, where_clause

BASE_EVENT: Final = node_id(ObjectIds.BaseEventType)
_NULL: Final = node_id(ObjectIds.Null)
_NO_FIELD: Final = variant(None, ua.VariantType.Null)
_MOST_FIELDS: Final = 500
_LONGEST_PATH: Final = 10
_PARTS: Final = (ObjectIds.HasProperty, ObjectIds.HasComponent)

_Path = tuple[tuple[int, str | None], ...]
"""BrowseNames, each with its namespace."""


@dataclass(frozen=True, slots=True)
class Occurrence:
    """An event as it is told at one node. ``fields`` by their names in BaseEventType."""

    emitter: ua.NodeId
    fields: Mapping[str, ua.Variant]


class EventFilterFault(ServiceError):
    """A filter that nothing could pass; ``result`` says which part of it is wrong."""

    def __init__(self, result: ua.EventFilterResult) -> None:
        super().__init__(StatusCodes.BadEventFilterInvalid)
        self.result = result


@dataclass(frozen=True, slots=True)
class EventFilter:
    """``names`` are the fields to tell, None for one that no event has. ``result`` is for the client."""

    names: Sequence[str | None]
    where: Where
    result: ua.EventFilterResult | None

    @property
    def weight(self) -> int:
        """How long it takes to judge and to tell an event, in tens of fields and operands."""
        return 1 + (len(self.names) + self.where.operands) // 10

    def passes(self, event: Occurrence) -> bool:
        return self.where.passes(event.fields)

    def fields(self, event: Occurrence) -> list[ua.Variant]:
        return [event.fields.get(name or "", _NO_FIELD) for name in self.names]


def event_filter(asked: object, types: EventTypes) -> EventFilter:
    """Raises ServiceError for what is no event filter, ``EventFilterFault`` for one that cannot be meant.

    A field that no event has is told as null, and ``result`` says so.
    """
    if is_none(asked):
        raise ServiceError(StatusCodes.BadMonitoredItemFilterInvalid)
    if isinstance(asked, DataChangeFilter):
        raise ServiceError(StatusCodes.BadFilterNotAllowed)
    if not isinstance(asked, ua.EventFilter):
        raise ServiceError(StatusCodes.BadMonitoredItemFilterUnsupported)
    selected: list[ua.SimpleAttributeOperand] = get(asked, "SelectClauses") or []
    if not 0 < len(selected) <= _MOST_FIELDS:
        raise ServiceError(StatusCodes.BadEventFilterInvalid)
    codes = [types.fault(operand) for operand in selected]
    where, elements = where_clause(get(asked, "WhereClause"), types)
    result = _result(codes, elements)
    if where is None or all(codes):
        raise EventFilterFault(result)
    names = [None if code else field_name(operand) for operand, code in zip(selected, codes, strict=True)]
    return EventFilter(names, where, result if any(codes) else None)


def _result(codes: Sequence[int], elements: list[ua.ContentFilterElementResult]) -> ua.EventFilterResult:
    return make(
        ua.EventFilterResult,
        SelectClauseResults=[status(code) for code in codes],
        WhereClauseResult=make(ua.ContentFilterResult, ElementResults=elements),
    )


class EventTypes:
    """The event types of the address space and the fields that they declare, looked up once."""

    def __init__(self, space: AddressSpace) -> None:
        self._space = space
        self._above: dict[ua.NodeId, list[ua.NodeId]] = {}
        self._declared: dict[ua.NodeId, set[_Path]] = {}
        self._all: set[_Path] = set()

    def look(self) -> None:
        """Look at the types; no others may be added later."""
        for kind in subtypes(self._space, BASE_EVENT):
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
        """What is wrong with an operand that names a field; Good for nothing."""
        type_id: ua.NodeId = get(operand, "TypeDefinitionId")
        names: list[ua.QualifiedName] = get(operand, "BrowsePath") or []
        attribute: int = get(operand, "AttributeId")
        if type_id == _NULL:
            type_id = BASE_EVENT
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
        declared = type_id == BASE_EVENT and path in self._all
        if not declared and not any(path in self._declared.get(owner, ()) for owner in owners):
            return StatusCodes.BadNodeIdUnknown
        if attribute not in (AttributeIds.Value, AttributeIds.NodeId):
            return StatusCodes.BadAttributeIdInvalid
        return StatusCodes.BadIndexRangeNoData if get(operand, "IndexRange") else StatusCodes.Good
