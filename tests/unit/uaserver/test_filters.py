"""Filters of events and of changes, on the standard's own types; no server."""

from __future__ import annotations

import itertools
from datetime import UTC, datetime

import pytest
from asyncua import ua
from asyncua.server.address_space import AddressSpace, AttributeValue, NodeManagementService
from asyncua.server.standard_address_space import standard_address_space
from hypothesis import given, settings
from hypothesis import strategies as st

from bridge.uaserver.eventfilter import EventFilterFault, Occurrence, event_filter
from bridge.uaserver.filters import change_filter
from bridge.uaserver.hierarchy import EventTypes
from bridge.uaserver.library import DataChangeFilter, ServiceError

Codes, Ids, Kind, Op = ua.StatusCodes, ua.ObjectIds, ua.VariantType, ua.FilterOperator
SERVER = ua.NodeId(Ids.Server)


@pytest.fixture(scope="module")
def space() -> AddressSpace:
    made = AddressSpace()
    standard_address_space.fill_address_space(NodeManagementService(made))
    return made


@pytest.fixture(scope="module")
def types(space: AddressSpace) -> EventTypes:
    found = EventTypes(space)
    found.look()
    return found


def chosen(
    *path: str,
    type_id: int = Ids.BaseEventType,
    attribute: int = ua.AttributeIds.Value,
    index_range: str = "",
) -> ua.SimpleAttributeOperand:
    return ua.SimpleAttributeOperand(
        ua.NodeId(type_id), [ua.QualifiedName(name, 0) for name in path], attribute, index_range
    )


def element(operator: Op, *operands: object) -> ua.ContentFilterElement:
    """What is no operand is meant as a literal."""
    kinds = ua.FilterOperand | ua.ExtensionObject
    made = [one if isinstance(one, kinds) else literal(one) for one in operands]
    return ua.ContentFilterElement(operator, made)


def literal(value: object) -> ua.LiteralOperand:
    return ua.LiteralOperand(value if isinstance(value, ua.Variant) else ua.Variant(value))


def at(index: int) -> ua.ElementOperand:
    return ua.ElementOperand(index)


def asked(
    *elements: ua.ContentFilterElement, select: list[ua.SimpleAttributeOperand] | None = None
) -> ua.EventFilter:
    fields = [chosen("Message")] if select is None else select
    return ua.EventFilter(fields, ua.ContentFilter(list(elements)))


EVENT = Occurrence(
    SERVER,
    {
        "EventType": ua.Variant(ua.NodeId(Ids.AuditWriteUpdateEventType), Kind.NodeId),
        "SourceName": ua.Variant("conveyor/fu1", Kind.String),
        "Message": ua.Variant(ua.LocalizedText("emergency", "en"), Kind.LocalizedText),
        "Severity": ua.Variant(700, Kind.UInt16),
        "Time": ua.Variant(datetime(2026, 1, 1, tzinfo=UTC), Kind.DateTime),
    },
)
SEVERITY, SOURCE, MESSAGE = chosen("Severity"), chosen("SourceName"), chosen("Message")
ABSENT = chosen("LocalTime")


# what passes


@pytest.mark.parametrize(
    ("elements", "passes"),
    [
        ([], True),
        ([element(Op.Equals, SEVERITY, 700)], True),
        ([element(Op.Equals, MESSAGE, "emergency")], True),
        ([element(Op.Equals, SOURCE, "conveyor/fu2")], False),
        ([element(Op.GreaterThan, SEVERITY, 700)], False),
        ([element(Op.GreaterThanOrEqual, SEVERITY, 700)], True),
        ([element(Op.LessThan, SEVERITY, 700)], False),
        ([element(Op.LessThanOrEqual, SEVERITY, 700)], True),
        ([element(Op.Between, SEVERITY, 500, 800)], True),
        ([element(Op.Between, SEVERITY, 800, 900)], False),
        ([element(Op.InList, SEVERITY, 1, 700, 3)], True),
        ([element(Op.InList, SEVERITY, 1, 3)], False),
        ([element(Op.IsNull, ABSENT)], True),
        ([element(Op.IsNull, SEVERITY)], False),
        ([element(Op.Not, at(1)), element(Op.Equals, SEVERITY, 1)], True),
        # With nothing, or with another kind of thing, nothing compares: neither it nor its opposite passes.
        ([element(Op.GreaterThan, ABSENT, 1)], False),
        ([element(Op.Not, at(1)), element(Op.GreaterThan, ABSENT, 1)], False),
        ([element(Op.Not, at(1)), element(Op.GreaterThan, SOURCE, 1)], False),
        (
            [element(Op.And, at(1), at(2)), element(Op.Equals, SEVERITY, 700), element(Op.IsNull, ABSENT)],
            True,
        ),
        ([element(Op.And, at(1), at(2)), element(Op.Equals, SEVERITY, 1), element(Op.IsNull, ABSENT)], False),
        (
            [element(Op.Or, at(1), at(2)), element(Op.GreaterThan, ABSENT, 1), element(Op.IsNull, ABSENT)],
            True,
        ),
        # Of a type are those of its subtypes, too. asyncua compares the type alone.
        ([element(Op.OfType, ua.NodeId(Ids.BaseEventType))], True),
        ([element(Op.OfType, ua.NodeId(Ids.AuditEventType))], True),
        ([element(Op.OfType, ua.NodeId(Ids.AuditWriteUpdateEventType))], True),
        ([element(Op.OfType, ua.NodeId(Ids.SystemEventType))], False),
    ],
)
def test_what_the_where_clause_lets_pass(
    types: EventTypes, elements: list[ua.ContentFilterElement], passes: bool
) -> None:
    assert event_filter(asked(*elements), types).passes(EVENT) == passes


def test_a_deep_clause_is_worked_out_once(types: EventTypes) -> None:
    """Each element names the next one twice: taken at its word that is 2^99 evaluations."""
    chain = [element(Op.And, at(place + 1), at(place + 1)) for place in range(99)]
    assert event_filter(asked(*chain, element(Op.IsNull, ABSENT)), types).passes(EVENT)


# what is refused


@pytest.mark.parametrize(
    ("elements", "code"),
    [
        ([element(Op.Like, SOURCE, "%fu1")], Codes.BadFilterOperatorUnsupported),
        ([element(Op.Cast, SEVERITY, ua.NodeId(6))], Codes.BadFilterOperatorUnsupported),
        ([element(Op.BitwiseAnd, SEVERITY, 1)], Codes.BadFilterOperatorUnsupported),
        ([element(Op.InView, ua.NodeId(87))], Codes.BadFilterOperatorUnsupported),
        ([element(Op.RelatedTo, SOURCE, SOURCE, SOURCE)], Codes.BadFilterOperatorUnsupported),
        ([element(Op.Equals, SEVERITY)], Codes.BadFilterOperandCountMismatch),
        ([element(Op.IsNull)], Codes.BadFilterOperandCountMismatch),
        ([element(Op.Between, SEVERITY, 1)], Codes.BadFilterOperandCountMismatch),
        ([element(Op.Not, at(0))], Codes.BadFilterOperandInvalid),
        ([element(Op.Not, at(7))], Codes.BadFilterOperandInvalid),
        ([element(Op.Equals, chosen("NoSuchField"), 1)], Codes.BadFilterOperandInvalid),
        ([element(Op.Equals, ua.AttributeOperand(), 1)], Codes.BadFilterOperandInvalid),
        ([element(Op.Equals, ua.ExtensionObject(), 1)], Codes.BadFilterOperandInvalid),
        ([element(Op.OfType, "AuditEventType")], Codes.BadFilterOperandInvalid),
        ([element(Op.OfType, SEVERITY)], Codes.BadFilterOperandInvalid),
        ([element(Op.OfType, ua.NodeId(Ids.FolderType))], Codes.BadFilterOperandInvalid),
    ],
)
def test_a_clause_that_cannot_be_judged_is_refused(
    types: EventTypes, elements: list[ua.ContentFilterElement], code: int
) -> None:
    with pytest.raises(EventFilterFault) as refused:
        event_filter(asked(*elements), types)
    assert refused.value.code == Codes.BadEventFilterInvalid
    (told, *_) = refused.value.result.WhereClauseResult.ElementResults
    assert told.StatusCode.value == code
    assert len(told.OperandStatusCodes) == len(elements[0].FilterOperands)


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


# changes of values


@pytest.mark.parametrize(
    ("wrong", "attribute", "code"),
    [
        (DataChangeFilter(), ua.AttributeIds.DisplayName, Codes.BadFilterNotAllowed),
        (asked(), ua.AttributeIds.Value, Codes.BadFilterNotAllowed),
        (ua.AggregateFilter(), ua.AttributeIds.Value, Codes.BadMonitoredItemFilterUnsupported),
        (
            ua.ExtensionObject(TypeId=ua.NodeId(9, 3)),
            ua.AttributeIds.Value,
            Codes.BadMonitoredItemFilterUnsupported,
        ),
        (DataChangeFilter(DeadbandType=3), ua.AttributeIds.Value, Codes.BadDeadbandFilterInvalid),
        (
            DataChangeFilter(DeadbandType=1, DeadbandValue=-1),
            ua.AttributeIds.Value,
            Codes.BadDeadbandFilterInvalid,
        ),
        (
            DataChangeFilter(DeadbandType=1, DeadbandValue=float("nan")),
            ua.AttributeIds.Value,
            Codes.BadDeadbandFilterInvalid,
        ),
        # Without an EURange there is nothing to take a part of.
        (
            DataChangeFilter(DeadbandType=2, DeadbandValue=5),
            ua.AttributeIds.Value,
            Codes.BadDeadbandFilterInvalid,
        ),
    ],
)
def test_a_filter_that_an_item_cannot_have_is_refused(
    space: AddressSpace, wrong: object, attribute: int, code: int
) -> None:
    node = space[ua.NodeId(Ids.Server_ServiceLevel)]
    with pytest.raises(ServiceError) as refused:
        change_filter(wrong, space, node, attribute)
    assert refused.value.code == code


def test_a_deadband_is_for_numbers(space: AddressSpace) -> None:
    wanted = DataChangeFilter(DeadbandType=1, DeadbandValue=1)
    for name in (Ids.Server_ServiceLevel, Ids.Server_ServerStatus_SecondsTillShutdown):
        assert change_filter(wanted, space, space[ua.NodeId(name)], ua.AttributeIds.Value).deadband == 1
    level = space[ua.NodeId(Ids.Server_ServiceLevel)]
    scalar = level.attributes[ua.AttributeIds.ValueRank]
    level.attributes[ua.AttributeIds.ValueRank] = AttributeValue(ua.DataValue(ua.Variant(1, Kind.Int32)))
    with pytest.raises(ServiceError):
        change_filter(wanted, space, level, ua.AttributeIds.Value)
    level.attributes[ua.AttributeIds.ValueRank] = scalar
    for name in (
        Ids.Server_ServerStatus_CurrentTime,
        Ids.Server_NamespaceArray,
        Ids.Server_ServerStatus_State,
    ):
        with pytest.raises(ServiceError) as refused:
            change_filter(wanted, space, space[ua.NodeId(name)], ua.AttributeIds.Value)
        assert refused.value.code == Codes.BadFilterNotAllowed


# whatever a client writes


LITERALS = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-(2**31), 2**31 - 1),
    st.floats(),
    st.text(max_size=5),
    st.binary(max_size=5),
    st.datetimes(),
    st.lists(st.integers(0, 9), min_size=1, max_size=3),
    st.sampled_from(
        [ua.NodeId(Ids.BaseEventType), ua.NodeId("mine", 2), ua.LocalizedText("x"), ua.QualifiedName("x")]
    ),
)
OPERANDS = st.one_of(
    LITERALS.map(literal),
    st.integers(0, 12).map(at),
    st.sampled_from(
        [SEVERITY, SOURCE, MESSAGE, ABSENT, chosen(), chosen("data_types"), ua.AttributeOperand()]
    ),
    st.just(ua.ExtensionObject()),
)
ELEMENTS = st.builds(ua.ContentFilterElement, st.sampled_from(list(Op)), st.lists(OPERANDS, max_size=4))


KINDS = [
    *(None, True, 1, 1.5, "x", b"x", datetime(2026, 1, 1, tzinfo=UTC), [1, 2]),
    *(ua.NodeId(Ids.BaseEventType), ua.NodeId("mine", 2), ua.LocalizedText("x"), ua.QualifiedName("x")),
]


@pytest.mark.parametrize("comparison", [Op.Equals, Op.GreaterThan, Op.LessThan, Op.GreaterThanOrEqual])
def test_any_two_kinds_can_be_compared(types: EventTypes, comparison: ua.FilterOperator) -> None:
    for left, right in itertools.product(KINDS, KINDS):
        element = ua.ContentFilterElement(comparison, [literal(left), literal(right)])
        assert event_filter(asked(element), types).passes(EVENT) in (True, False)


@given(st.lists(ELEMENTS, max_size=8))
@settings(max_examples=300)
def test_every_clause_is_judged_or_refused(
    types: EventTypes, elements: list[ua.ContentFilterElement]
) -> None:
    try:
        found = event_filter(asked(*elements), types)
    except EventFilterFault as refused:
        assert len(refused.result.WhereClauseResult.ElementResults) == len(elements)
    else:
        assert found.passes(EVENT) in (True, False)
