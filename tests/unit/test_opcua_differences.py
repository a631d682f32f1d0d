"""The comparison with other people's OPC UA servers: what is a difference, and the page of the known ones."""

from __future__ import annotations

import pytest
from asyncua import ua

from tests.compare.asked import Ask, Made
from tests.compare.cases import SETS
from tests.compare.differences import DIFFERENCES, explanation, unexplained
from tests.compare.facts import Facts, facts_of
from tests.compare.page import CLEAN, PAGE, page
from tests.compare.play import Party, Play, Seen
from tests.compare.servers import NAMES, NODE_OPCUA, OPEN62541, OURS
from tests.compare.space import BEGIN

Codes = ua.StatusCodes


def test_the_page_has_what_the_table_has() -> None:
    assert PAGE.read_text() == page(), "python -m tests.compare.page"


def read(*values: ua.DataValue) -> Facts:
    return facts_of(ua.ReadResponse(Results=list(values)), "Read")


def compared(step: Ask, *found: Facts) -> list[Seen]:
    play = Play([Party(name, 0) for name in NAMES])
    play.compare(step.service, step, found)
    return play.seen


def value(content: object, code: int = Codes.Good) -> ua.DataValue:
    return ua.DataValue(ua.Variant(content), ua.StatusCode(code))


READ = Ask("Read", {"NodesToRead": [ua.ReadValueId(ua.NodeId("boolean", 1), ua.AttributeIds.Value)]})
ENCODED = Ask(
    "Read",
    {
        "NodesToRead": [
            ua.ReadValueId(
                ua.NodeId("boolean", 1), ua.AttributeIds.Value, DataEncoding=ua.QualifiedName("Default XML")
            )
        ]
    },
)


def test_what_is_alike_is_no_difference() -> None:
    nan = read(value(float("nan")))
    assert compared(READ, nan, read(value(float("nan"))), nan) == []


def test_another_value_of_one_server_is_one() -> None:
    (seen,) = compared(READ, read(value(True)), read(value(True)), read(value(False)))
    assert seen.path == "Results[0].Value"
    assert unexplained(seen) == [NODE_OPCUA]


def test_of_an_operation_that_one_refuses_the_code_alone_is_told() -> None:
    refused = read(value(None, Codes.BadNotReadable))
    (seen,) = compared(READ, read(value(True)), refused, read(value(True)))
    assert (seen.path, seen.values[OURS], seen.values[OPEN62541]) == (
        "Results[0].StatusCode",
        "Good",
        "BadNotReadable",
    )
    assert unexplained(seen) == [OPEN62541]


@pytest.mark.parametrize(("step", "left"), [(READ, [NODE_OPCUA]), (ENCODED, [])])
def test_a_row_explains_what_was_asked_so_and_nothing_else(step: Ask, left: list[str]) -> None:
    refused = read(value(None, Codes.BadDataEncodingInvalid))
    (seen,) = compared(step, read(value(True)), read(value(True)), refused)
    assert unexplained(seen) == left


def test_of_the_past_the_samples_are_compared_with_their_times() -> None:
    sample = value(1.5)
    sample.SourceTimestamp = BEGIN
    past = ua.HistoryReadResult(HistoryData=ua.HistoryData([sample]), ContinuationPoint=b"more")
    found = facts_of(ua.HistoryReadResponse(Results=[past]), "HistoryRead")
    assert found["Results[0].values"] == [f"{BEGIN} Double 1.5 Good"]
    assert found["Results[0].goes on"] is True
    nothing = facts_of(ua.HistoryReadResponse(Results=[ua.HistoryReadResult()]), "HistoryRead")
    assert nothing["Results[0].values"] == []


def test_a_set_without_one_server_is_compared_with_the_other() -> None:
    step = Ask("Publish")
    told = [["Message alarm"], ["the refresh of the conditions begins"]]
    values = {OURS: told, NODE_OPCUA: told[:1]}
    assert unexplained(Seen("Publish", "events 1", values, step)) == []
    values = {OURS: told, NODE_OPCUA: []}
    assert unexplained(Seen("Publish", "events 1", values, step)) == [NODE_OPCUA]


def test_the_page_has_a_number_of_cases_for_each_set() -> None:
    assert set(CLEAN) == set(SETS)


def test_of_several_faults_any_may_be_told_but_no_other_code() -> None:
    unknown = ua.ReadValueId(ua.NodeId("nowhere", 1), ua.AttributeIds.Value, IndexRange="x")
    step = Ask("Read", {"NodesToRead": [unknown]})
    first, second = (read(value(None, code)) for code in (Codes.BadNodeIdUnknown, Codes.BadIndexRangeInvalid))
    (seen,) = compared(step, first, second, first)
    assert unexplained(seen) == []
    (seen,) = compared(step, first, read(value(None, Codes.BadOutOfMemory)), first)
    assert unexplained(seen) == [OPEN62541]


def test_what_a_server_gives_has_its_place_in_later_requests() -> None:
    party = Party(OURS, 0)
    party.made["subscription"] = [4711]
    asked = {"SubscriptionIds": [Made("subscription", 0), Made("item", 0)]}
    made = party.request(Ask("DeleteSubscriptions", asked)).Parameters.SubscriptionIds
    assert made[0] == 4711
    assert made[1] != 4711


def test_every_row_says_where_and_why() -> None:
    for row in DIFFERENCES:
        assert row.clause.startswith("Part "), row.asked
        assert row.why.endswith("."), row.asked
        assert set(row.theirs) <= {OPEN62541, NODE_OPCUA}
    none = Seen("Read", "result", dict.fromkeys(NAMES, "Good"), READ)
    assert explanation(none, OURS) is None
