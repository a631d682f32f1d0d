"""DataChangeFilter: the changes of a value that a client wants reported (OPC 10000-4 §7.22.2)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, TypeGuard

from asyncua.server.address_space import AddressSpace, NodeData

from bridge.uaserver.hierarchy import related, supertypes
from bridge.uaserver.library import (
    AttributeIds,
    DataChangeFilter,
    ObjectIds,
    ServiceError,
    StatusCodes,
    get,
    node_id,
    ua,
)

_NUMBER: Final = node_id(ObjectIds.Number)
_NO_FILTER: Final = node_id(ObjectIds.Null)
_MOST_PERCENT: Final = 100.0


@dataclass(frozen=True, slots=True)
class ChangeFilter:
    """``deadband`` is in the value's own unit; 0 for none."""

    trigger: ua.DataChangeTrigger = ua.DataChangeTrigger.StatusValue
    deadband: float | None = None

    def reports(self, last: ua.DataValue | None, now: ua.DataValue) -> bool:
        """Whether ``now`` is to be told to a client that was last told ``last``."""
        if last is None:
            return True
        # Nearly always the same object, and asyncua's comparison takes longer than all of the rest.
        if last.StatusCode is not now.StatusCode and last.StatusCode != now.StatusCode:
            return True
        if self.trigger == ua.DataChangeTrigger.Status:
            return False
        before = last.Value.Value if last.Value else None
        after = now.Value.Value if now.Value else None
        if self.deadband is not None and _is_finite(before) and _is_finite(after):
            return abs(after - before) > self.deadband
        if self.deadband is not None and _is_array(before) and _is_array(after):
            return _is_beyond(self.deadband, before, after)
        stamped = self.trigger == ua.DataChangeTrigger.StatusValueTimestamp
        if stamped and self.deadband is None and last.SourceTimestamp != now.SourceTimestamp:
            return True
        # The variants differ in their types, too.
        return (before != after or last.Value != now.Value) and not (_is_nan(before) and _is_nan(after))


EVERY_CHANGE: Final = ChangeFilter()


def _is_beyond(deadband: float, before: list[object], after: list[object]) -> bool:
    """Whether an element has changed by more; one alone is enough (Part 8 §7.2)."""
    if len(before) != len(after):
        return True
    for old, new in zip(before, after, strict=True):
        if _is_finite(old) and _is_finite(new):
            if abs(new - old) > deadband:
                return True
        elif old != new and not (_is_nan(old) and _is_nan(new)):
            return True
    return False


def _is_array(value: object) -> TypeGuard[list[object]]:
    return isinstance(value, list)


def _is_finite(value: object) -> TypeGuard[float]:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _is_nan(value: object) -> bool:
    return isinstance(value, float) and math.isnan(value)


def is_none(asked: object) -> bool:
    """Whether the client has sent no filter at all."""
    return asked is None or (isinstance(asked, ua.ExtensionObject) and get(asked, "TypeId") == _NO_FILTER)


def change_filter(asked: object, space: AddressSpace, node: NodeData, attribute: int) -> ChangeFilter:
    """``asked`` for this attribute of ``node``. Raises ServiceError for a filter that it cannot have."""
    if is_none(asked):
        return EVERY_CHANGE
    if isinstance(asked, ua.EventFilter):
        raise ServiceError(StatusCodes.BadFilterNotAllowed)
    if not isinstance(asked, DataChangeFilter):
        raise ServiceError(StatusCodes.BadMonitoredItemFilterUnsupported)
    if attribute != AttributeIds.Value:
        raise ServiceError(StatusCodes.BadFilterNotAllowed)
    return ChangeFilter(get(asked, "Trigger"), _deadband(asked, space, node))


def _deadband(asked: DataChangeFilter, space: AddressSpace, node: NodeData) -> float | None:
    kind: int = get(asked, "DeadbandType")
    size: float = get(asked, "DeadbandValue")
    if kind == ua.DeadbandType.None_:
        return None
    if kind not in (ua.DeadbandType.Absolute, ua.DeadbandType.Percent):
        raise ServiceError(StatusCodes.BadDeadbandFilterInvalid)
    if not _is_number(space, node):
        raise ServiceError(StatusCodes.BadFilterNotAllowed)
    if not (math.isfinite(size) and size >= 0):
        raise ServiceError(StatusCodes.BadDeadbandFilterInvalid)
    if kind == ua.DeadbandType.Absolute:
        return size
    # Part 8 §7.2: of the EURange, which has to be there.
    span = _span(space, node)
    if span is None or size > _MOST_PERCENT:
        raise ServiceError(StatusCodes.BadDeadbandFilterInvalid)
    return size / 100 * span


def _is_number(space: AddressSpace, node: NodeData) -> bool:
    """Whether the node holds a number or an array of them."""
    kind = space.read_attribute_value(node.nodeid, AttributeIds.DataType).Value
    return kind is not None and isinstance(kind.Value, ua.NodeId) and _NUMBER in supertypes(space, kind.Value)


def _span(space: AddressSpace, node: NodeData) -> float | None:
    """Width of the node's EURange; None where it has none."""
    for found in related(space, node.nodeid, ObjectIds.HasProperty):
        if get(found, "BrowseName") == ua.QualifiedName("EURange", 0):
            limits = space.read_attribute_value(get(found, "NodeId"), AttributeIds.Value).Value
            if limits is not None and isinstance(limits.Value, ua.Range):
                return float(get(limits.Value, "High")) - float(get(limits.Value, "Low"))
    return None
