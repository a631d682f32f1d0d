"""Event filters: fields that a client wants of which events; no server."""

from __future__ import annotations

from dataclasses import replace

import pytest
from asyncua import ua

from bridge.uaserver.filters.eventfilter import EventFilterFault, Occurrence, event_filter
from bridge.uaserver.filters.where import field_name, own_name
from bridge.uaserver.hierarchy import EventTypes
from bridge.uaserver.library import DataChangeFilter, ServiceError
from tests.support.opcua_filters import (
    EVENT,
    MESSAGE,
    SERVER,
    SEVERITY,
    asked,
    chosen,
    element,
)

Codes, Ids, Kind, Op = ua.StatusCodes, ua.ObjectIds, ua.VariantType, ua.FilterOperator


@pytest.mark.landing(16)
@pytest.mark.parametrize(
    ("operand", "code"),
    [
        (chosen("Severity"), Codes.Good),
        (chosen("Severity", type_id=Ids.Null), Codes.Good),
        (chosen("Severity", type_id=Ids.AuditEventType), Codes.Good),
        (chosen("ActionTimeStamp"), Codes.Good),
        (chosen("EnabledState", "Id", type_id=Ids.ConditionType), Codes.Good),
        (chosen(type_id=Ids.ConditionType, attribute=ua.AttributeIds.NodeId), Codes.Good),
        (chosen("NoSuchField"), Codes.BadNodeIdUnknown),
        (chosen("emitter"), Codes.BadNodeIdUnknown),
        (chosen("ActionTimeStamp", type_id=Ids.SystemEventType), Codes.BadNodeIdUnknown),
        (chosen(), Codes.BadNodeIdUnknown),
        (chosen(""), Codes.BadBrowseNameInvalid),
        (chosen(*["Severity"] * 20), Codes.BadBrowseNameInvalid),
        (chosen("Severity", type_id=Ids.FolderType), Codes.BadTypeDefinitionInvalid),
        (chosen("Severity", type_id=4_000_000), Codes.BadTypeDefinitionInvalid),
        (chosen("Severity", attribute=ua.AttributeIds.DisplayName), Codes.BadAttributeIdInvalid),
        (chosen("Message", index_range="0:1"), Codes.BadIndexRangeNoData),
    ],
)
def test_each_field_is_told_what_is_wrong_with_it(
    types: EventTypes, operand: ua.SimpleAttributeOperand, code: int
) -> None:
    found = event_filter(asked(select=[operand, MESSAGE]), types)
    codes = [one.value for one in found.result.SelectClauseResults] if found.result else [0, 0]
    assert codes == [code, Codes.Good]
    assert found.fields(EVENT)[1].Value.Text == "emergency"
    if code:
        assert found.fields(EVENT)[0].Value is None
        with pytest.raises(EventFilterFault):
            event_filter(asked(select=[operand]), types)


@pytest.mark.parametrize(
    ("wrong", "code"),
    [
        (None, Codes.BadMonitoredItemFilterInvalid),
        (ua.ExtensionObject(), Codes.BadMonitoredItemFilterInvalid),
        (DataChangeFilter(), Codes.BadFilterNotAllowed),
        (ua.AggregateFilter(), Codes.BadMonitoredItemFilterUnsupported),
        (ua.ExtensionObject(TypeId=ua.NodeId("mine", 3), Body=b""), Codes.BadMonitoredItemFilterUnsupported),
        (asked(select=[]), Codes.BadEventFilterInvalid),
        (asked(select=[MESSAGE] * 501), Codes.BadEventFilterInvalid),
        (asked(*[element(Op.IsNull, SEVERITY)] * 101), Codes.BadEventFilterInvalid),
        (asked(element(Op.InList, *[SEVERITY] * 501)), Codes.BadEventFilterInvalid),
    ],
)
def test_what_is_no_event_filter_is_refused(types: EventTypes, wrong: object, code: int) -> None:
    with pytest.raises(ServiceError) as refused:
        event_filter(wrong, types)
    assert refused.value.code == code


def test_a_field_is_found_by_a_path_of_several_names(types: EventTypes) -> None:
    node_id = chosen(type_id=Ids.ConditionType, attribute=ua.AttributeIds.NodeId)
    acked = chosen("AckedState", "Id", type_id=Ids.AcknowledgeableConditionType)
    state = chosen("ShelvingState", "CurrentState", "Id", type_id=Ids.AlarmConditionType)
    found = event_filter(asked(element(Op.Equals, acked, False), select=[node_id, acked, state]), types)
    fields = {
        "": ua.Variant(ua.NodeId("conveyor/fu1/Alarm", 2)),
        "AckedState/Id": ua.Variant(False),
        "ShelvingState/CurrentState/Id": ua.Variant(ua.NodeId(Ids.ShelvedStateMachineType_Unshelved)),
    }
    event = Occurrence(SERVER, fields)
    assert found.passes(event)
    assert found.fields(event) == list(fields.values())
    assert not found.passes(EVENT), "an event without the field"
    assert [one.Value for one in found.fields(EVENT)] == [None] * 3


def test_no_filter_holds_back_what_begins_and_ends_a_refresh(types: EventTypes) -> None:
    found = event_filter(asked(element(Op.Equals, SEVERITY, 1)), types)
    assert not found.passes(EVENT)
    assert found.passes(replace(EVENT, is_of_refresh=True))


def test_a_field_of_another_namespace_has_its_index() -> None:
    operand = ua.SimpleAttributeOperand(
        ua.NodeId(Ids.BaseEventType), [ua.QualifiedName("Code", 2)], ua.AttributeIds.Value
    )
    assert field_name(operand) == own_name("Code", 2) == "2:Code"
