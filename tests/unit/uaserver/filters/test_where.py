"""WHERE clauses of event filters, on the standard's own types; no server."""

from __future__ import annotations

import itertools
from datetime import UTC, datetime

import pytest
from asyncua import ua
from hypothesis import given, settings
from hypothesis import strategies as st

from bridge.uaserver.filters.eventfilter import EventFilterFault, event_filter
from bridge.uaserver.hierarchy import EventTypes
from tests.support.opcua_filters import (
    ABSENT,
    EVENT,
    MESSAGE,
    SEVERITY,
    SOURCE,
    asked,
    at,
    chosen,
    element,
    literal,
)

Codes, Ids, Kind, Op = ua.StatusCodes, ua.ObjectIds, ua.VariantType, ua.FilterOperator


@pytest.mark.landing(25)
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


@pytest.mark.landing
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
