"""EventFilter: the events that a client wants, and their fields (OPC 10000-4 §7.22.3)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from bridge.uaserver.filters.changefilter import is_none
from bridge.uaserver.filters.where import Fields, Where, field_name, where_clause
from bridge.uaserver.hierarchy import EventTypes
from bridge.uaserver.library import (
    DataChangeFilter,
    ServiceError,
    StatusCodes,
    get,
    make,
    status,
    ua,
    variant,
)

_NO_FIELD: Final = variant(None, ua.VariantType.Null)
MOST_FIELDS: Final = 500


@dataclass(frozen=True, slots=True)
class Occurrence:
    """An event as it is told at one node. ``fields`` by their names, as ``where.field_name`` has them.
    ``is_of_refresh``: it begins or ends a ConditionRefresh, which no filter holds back (Part 9 §4.5)."""

    emitter: ua.NodeId
    fields: Fields
    is_of_refresh: bool = False


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
        """Cost of judging and reporting an event, in tens of fields and operands."""
        return 1 + (len(self.names) + self.where.operands) // 10

    def passes(self, event: Occurrence) -> bool:
        return event.is_of_refresh or self.where.passes(event.fields)

    def fields(self, event: Occurrence) -> list[ua.Variant]:
        told = event.fields
        return [_NO_FIELD if name is None else told.get(name, _NO_FIELD) for name in self.names]


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
    if not 0 < len(selected) <= MOST_FIELDS:
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
