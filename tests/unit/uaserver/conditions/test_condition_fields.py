"""Fields of a condition: each that Part 9 has, of the right type, whatever the state."""

from __future__ import annotations

from datetime import UTC, datetime

import pytest
from asyncua import ua
from asyncua.server.address_space import AddressSpace

from bridge.uaserver.conditions.condition import Comment, ConditionState, Shelving
from bridge.uaserver.conditions.condition_fields import event_fields, field_value, moment
from bridge.uaserver.hierarchy import EventTypes
from bridge.uaserver.library import get
from tests.support.conditions import ConditionBench

Ids = ua.ObjectIds


def test_each_field_is_one_of_the_types(types: EventTypes) -> None:
    bench = ConditionBench()
    fields = set(bench.conditions.fields(bench.add())) - {""}
    for name in fields:
        operand = ua.SimpleAttributeOperand(
            ua.NodeId(Ids.AlarmConditionType),
            [ua.QualifiedName(one, 0) for one in name.split("/")],
            ua.AttributeIds.Value,
        )
        assert types.fault(operand) == 0, name


def test_each_field_that_is_mandatory_is_there(space: AddressSpace) -> None:
    bench = ConditionBench()
    fields = set(bench.conditions.fields(bench.add()))
    mandatory = ua.NodeId(Ids.ModellingRule_Mandatory)
    for kind in (
        Ids.BaseEventType,
        Ids.ConditionType,
        Ids.AcknowledgeableConditionType,
        Ids.AlarmConditionType,
    ):
        for one in space[ua.NodeId(kind)].references:
            below = space.get(get(one, "NodeId"))
            if not get(one, "IsForward") or get(one, "NodeClass") != ua.NodeClass.Variable or below is None:
                continue
            rules = [get(rule, "NodeId") for rule in below.references]
            if mandatory in rules:
                assert get(one, "BrowseName").Name in fields


@pytest.mark.parametrize("shelving", list(Shelving))
def test_what_is_shelved_says_for_how_long(shelving: Shelving) -> None:
    bench = ConditionBench()
    one = bench.add()
    until = bench.now_ms + 2000 if shelving is not Shelving.UNSHELVED else 0.0
    one.state = ConditionState(shelving=shelving, unshelve_at_ms=until)
    fields = bench.conditions.fields(one)
    assert fields["SuppressedOrShelved"].Value is (shelving is not Shelving.UNSHELVED)
    assert fields["ShelvingState/UnshelveTime"].Value == (2000.0 if until else 0.0)


def test_a_comment_is_told_in_the_language_that_it_was_made_in() -> None:
    bench = ConditionBench()
    one = bench.add()
    assert bench.conditions.fields(one)["Comment"].Value == ua.LocalizedText()
    one.state = ConditionState(comment=Comment("Kabel getauscht", "de", "anna", 1000.0))
    fields = bench.conditions.fields(one)
    assert fields["Comment"].Value == ua.LocalizedText("Kabel getauscht", "de")
    assert fields["ClientUserId"].Value == "anna"
    assert fields["Comment/SourceTimestamp"].Value == datetime(1970, 1, 1, 0, 0, 1, tzinfo=UTC)


def test_a_time_that_never_was_is_no_data() -> None:
    assert moment(0.0).Value is None
    value = field_value({"Time": moment(0.0)}, "Time")
    assert value.StatusCode is not None
    assert value.StatusCode.name == "BadNoData"
    assert field_value(event_fields(b"x", 1000.0), "EventId").Value == ua.Variant(
        b"x", ua.VariantType.ByteString
    )
