"""Which events a client wants to hear, and which fields of them: EventFilter (OPC 10000-4 §7.22.3)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
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

    def passes(self, event: Occurrence) -> bool:
        return self.where.passes(event.fields)

    def fields(self, event: Occurrence) -> list[ua.Variant]:
        return [event.fields.get(name or "", _NO_FIELD) for name in self.names]


def event_filter(asked: object, space: AddressSpace) -> EventFilter:
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
    fields = _Fields(space)
    codes = [fields.fault(operand) for operand in selected]
    where, elements = where_clause(get(asked, "WhereClause"), space, fields.fault)
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


class _Fields:
    """Looks fields up in the event types of the address space."""

    def __init__(self, space: AddressSpace) -> None:
        self._space = space
        self._types: set[ua.NodeId] | None = None

    def fault(self, operand: object) -> int:
        """What is wrong with an operand that names a field; Good for nothing."""
        type_id: ua.NodeId = get(operand, "TypeDefinitionId")
        path: list[ua.QualifiedName] = get(operand, "BrowsePath") or []
        attribute: int = get(operand, "AttributeId")
        if type_id == _NULL:
            type_id = BASE_EVENT
        if type_id not in self.types:
            return StatusCodes.BadTypeDefinitionInvalid
        if not path:
            # Part 9 §5.5.2: the NodeId of a condition is asked for in this way.
            is_node_id = attribute == AttributeIds.NodeId
            return StatusCodes.Good if is_node_id else StatusCodes.BadNodeIdUnknown
        if len(path) > _LONGEST_PATH or not all(name.Name for name in path):
            return StatusCodes.BadBrowseNameInvalid
        # With BaseEventType the path counts, whatever the type.
        owners = self.types if type_id == BASE_EVENT else supertypes(self._space, type_id)
        if not any(self._has(owner, path) for owner in owners):
            return StatusCodes.BadNodeIdUnknown
        if attribute not in (AttributeIds.Value, AttributeIds.NodeId):
            return StatusCodes.BadAttributeIdInvalid
        return StatusCodes.BadIndexRangeNoData if get(operand, "IndexRange") else StatusCodes.Good

    @property
    def types(self) -> set[ua.NodeId]:
        if self._types is None:
            self._types = subtypes(self._space, BASE_EVENT)
        return self._types

    def _has(self, owner: ua.NodeId, path: Sequence[ua.QualifiedName]) -> bool:
        there = [owner]
        for name in path:
            there = [
                get(found, "NodeId")
                for where in there
                for kind in _PARTS
                for found in related(self._space, where, kind)
                if get(found, "BrowseName") == name
            ]
        return bool(there)
