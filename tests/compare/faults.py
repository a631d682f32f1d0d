"""What is wrong with a request, as Part 4 names it: a server may tell any of several faults."""

from __future__ import annotations

import math
import re
from typing import Any, Final

from asyncua import ua
from asyncua.ua.uaprotocol_auto import DataChangeFilter

from tests.compare import space
from tests.compare.asked import UNKNOWN, Ask, Made

Faults = list[set[str]]
"""For each fault the codes that may tell it."""

Ids = ua.AttributeIds

_RANGE: Final = re.compile(r"(\d+)(:(\d+))?(,\d+(:\d+)?)*")
_COMMON: Final = {Ids.NodeId, Ids.NodeClass, Ids.BrowseName, Ids.DisplayName, Ids.Description}
_OPTIONAL: Final = {Ids.WriteMask, Ids.UserWriteMask}
_VALUE: Final = {
    Ids.Value,
    Ids.DataType,
    Ids.ValueRank,
    Ids.AccessLevel,
    Ids.UserAccessLevel,
    Ids.Historizing,
}
_OF_CLASS: Final = {
    "variable": _COMMON | _OPTIONAL | _VALUE | {Ids.ArrayDimensions, Ids.MinimumSamplingInterval},
    "object": _COMMON | _OPTIONAL | {Ids.EventNotifier},
    "method": _COMMON | _OPTIONAL | {Ids.Executable, Ids.UserExecutable},
}
_PAST: Final = [one.variable for one in space.HISTORIES]
_VARIABLES: Final = {
    ua.NodeId(one.id, one.namespace): one for one in (*space.VARIABLES, *space.POINTS, *_PAST)
}
_OBJECTS: Final = {ua.NodeId(one.id, one.namespace): one for one in space.OBJECTS}
_METHODS: Final = {ua.NodeId(one.id, one.namespace) for one in space.METHODS}
_SERVER: Final = ua.NodeId(ua.ObjectIds.Server)
_ALARM: Final = ua.NodeId(space.ALARM, 1)
_CONDITION_TYPE: Final = ua.NodeId(ua.ObjectIds.ConditionType)
_CONDITION_METHODS: Final = {
    ua.NodeId(ua.ObjectIds.AcknowledgeableConditionType_Acknowledge): _ALARM,
    ua.NodeId(ua.ObjectIds.ConditionType_AddComment): _ALARM,
    ua.NodeId(ua.ObjectIds.ConditionType_ConditionRefresh): _CONDITION_TYPE,
    ua.NodeId(ua.ObjectIds.ConditionType_ConditionRefresh2): _CONDITION_TYPE,
}
"""Methods of conditions, with the object that they are called on."""
DATA_ENCODING: Final = {"BadDataEncodingInvalid", "BadDataEncodingUnsupported"}
FILTERS: Final = {
    *("BadFilterNotAllowed", "BadMonitoredItemFilterUnsupported", "BadMonitoredItemFilterInvalid"),
    *("BadDeadbandFilterInvalid", "BadEventFilterInvalid"),
}


def class_of(where: ua.NodeId) -> str:
    """Empty for a node that is not there."""
    if where in _VARIABLES:
        return "variable"
    if where in _OBJECTS or where in (_SERVER, _ALARM, _CONDITION_TYPE):
        return "object"
    return "method" if where in _METHODS else ""


def variable_of(where: ua.NodeId) -> space.Variable | None:
    return _VARIABLES.get(where)


def is_range(written: str | None) -> bool:
    found = _RANGE.fullmatch(written or "0")
    if not found:
        return False
    return all(
        len(ends) == 1 or int(ends[0]) < int(ends[1])
        for ends in (part.split(":") for part in (written or "0").split(","))
    )


def of_target(target: ua.ReadValueId, *, reads: bool = True) -> Faults:
    """Of an attribute that is to be read or watched."""
    found: Faults = []
    kind = class_of(target.NodeId)
    if not kind:
        found.append({"BadNodeIdUnknown", "BadNodeIdInvalid"})
    elif target.AttributeId not in _OF_CLASS[kind]:
        found.append({"BadAttributeIdInvalid"})
    if target.IndexRange:
        codes = {"BadIndexRangeNoData"}
        found.append(codes if is_range(target.IndexRange) else codes | {"BadIndexRangeInvalid"})
    if target.DataEncoding.Name:
        found.append(DATA_ENCODING)
    variable = _VARIABLES.get(target.NodeId)
    if reads and variable and not variable.access & space.READ and target.AttributeId == Ids.Value:
        found.append({"BadNotReadable", "BadUserAccessDenied"})
    return found


def of_item(item: ua.MonitoredItemCreateRequest) -> Faults:
    target, asked = item.ItemToMonitor, item.RequestedParameters
    found = of_target(target)
    if target.AttributeId == Ids.EventNotifier:
        owner = _OBJECTS.get(target.NodeId)
        if owner and not owner.notifies:
            found.append({"BadNotSupported", "BadAttributeIdInvalid", "BadFilterNotAllowed"})
        if not isinstance(asked.Filter, ua.EventFilter):
            found.append(FILTERS)
        elif not asked.Filter.SelectClauses or has_odd_fields(asked.Filter) or has_like(asked.Filter):
            found.append({"BadEventFilterInvalid"})
    elif isinstance(asked.Filter, ua.EventFilter):
        found.append({"BadFilterNotAllowed"})
    elif isinstance(asked.Filter, DataChangeFilter) and (
        target.AttributeId != Ids.Value or is_odd_deadband(target, asked.Filter)
    ):
        found.append({"BadFilterNotAllowed", "BadDeadbandFilterInvalid", "BadMonitoredItemFilterUnsupported"})
    return found


def is_odd_deadband(target: ua.ReadValueId, asked: DataChangeFilter) -> bool:
    variable = _VARIABLES.get(target.NodeId)
    if asked.DeadbandType == 0 or variable is None:
        return False
    no_number = variable.type in ("Boolean", "String") or isinstance(variable.value, list)
    size = asked.DeadbandValue
    too_much = asked.DeadbandType == 2 and (variable.range is None or size > 100)
    return no_number or asked.DeadbandType not in (1, 2) or not size >= 0 or math.isinf(size) or too_much


def has_odd_fields(asked: Any) -> bool:
    return isinstance(asked, ua.EventFilter) and any(
        one.BrowsePath[0].Name == "nothing" for one in asked.SelectClauses
    )


def has_like(asked: ua.EventFilter) -> bool:
    elements = asked.WhereClause.Elements or [] if asked.WhereClause else []
    return any(one.FilterOperator == ua.FilterOperator.Like for one in elements)


def of_browse(asked: ua.BrowseDescription) -> Faults:
    found: Faults = []
    if not class_of(asked.NodeId):
        found.append({"BadNodeIdUnknown", "BadNodeIdInvalid"})
    if asked.BrowseDirection == ua.BrowseDirection.Invalid:
        found.append({"BadBrowseDirectionInvalid"})
    if asked.ReferenceTypeId.Identifier in (ua.ObjectIds.BaseObjectType, UNKNOWN):
        found.append({"BadReferenceTypeIdInvalid"})
    return found


def of_path(asked: ua.BrowsePath) -> Faults:
    elements = asked.RelativePath.Elements or []
    found: Faults = []
    if not class_of(asked.StartingNode):
        found.append({"BadNodeIdUnknown", "BadNodeIdInvalid"})
    if not elements:
        found.append({"BadNothingToDo"})
    if not all(one.TargetName.Name for one in elements):
        found.append({"BadBrowseNameInvalid", "BadNoMatch"})
    return found


def of_write(write: ua.WriteValue) -> Faults:
    found: Faults = []
    kind = class_of(write.NodeId)
    variable = _VARIABLES.get(write.NodeId)
    if not kind:
        found.append({"BadNodeIdUnknown", "BadNodeIdInvalid"})
    elif write.AttributeId not in _OF_CLASS[kind]:
        found.append(
            {"BadAttributeIdInvalid", "BadNotWritable", "BadUserAccessDenied", "BadNodeClassInvalid"}
        )
    elif write.AttributeId != Ids.Value or (variable and not variable.access & space.WRITE):
        found.append({"BadNotWritable", "BadUserAccessDenied", "BadWriteNotSupported"})
    if write.IndexRange:
        found.append({"BadWriteNotSupported", "BadIndexRangeInvalid", "BadIndexRangeNoData"})
    if write.Value.StatusCode and write.Value.StatusCode.value:
        found.append({"BadWriteNotSupported"})
    if variable and is_of_another_type(write.Value.Value, variable):
        found.append({"BadTypeMismatch"})
    return found


def is_of_another_type(written: ua.Variant | None, variable: space.Variable) -> bool:
    if written is None or written.Value is None:
        return True
    return written.VariantType.name != variable.type or written.is_array


def of_call(call: ua.CallMethodRequest) -> Faults:
    found: Faults = []
    if not class_of(call.ObjectId):
        found.append({"BadNodeIdUnknown", "BadNodeIdInvalid"})
    if not _is_of(call):
        found.append({"BadMethodInvalid", "BadNodeIdUnknown", "BadNodeClassInvalid", "BadNodeIdInvalid"})
    found.append({"BadArgumentsMissing", "BadTooManyArguments", "BadInvalidArgument", "BadTypeMismatch"})
    return found


def _is_of(call: ua.CallMethodRequest) -> bool:
    if call.MethodId in _CONDITION_METHODS:
        return _CONDITION_METHODS[call.MethodId] == call.ObjectId
    if call.MethodId not in _METHODS:
        return False
    return str(call.MethodId.Identifier).rpartition("/")[0] == call.ObjectId.Identifier


def of_step(step: Any) -> Faults:
    """Of a request as a whole."""
    if not isinstance(step, Ask):
        return []
    asked = step.asked
    found: Faults = []
    if any(isinstance(one, list) and not one for one in asked.values()):
        found.append({"BadNothingToDo"})
    if asked.get("TimestampsToReturn") == ua.TimestampsToReturn.Invalid:
        found.append({"BadTimestampsToReturnInvalid"})
    if asked.get("SubscriptionId") != Made("subscription", 0) and "SubscriptionId" in asked:
        found.append({"BadSubscriptionIdInvalid"})
    if asked.get("MaxAge", 0.0) < 0 or math.isnan(asked.get("MaxAge", 0.0)):
        found.append({"BadMaxAgeInvalid"})
    if "View" in asked and asked["View"].ViewId != ua.NodeId():
        found.append({"BadViewIdUnknown"})
    return found
