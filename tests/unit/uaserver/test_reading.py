"""Part of a value that a client gets, and its times; no server."""

from __future__ import annotations

from datetime import UTC, datetime

import pytest
from asyncua import ua

from bridge.uaserver.library import ServiceError
from bridge.uaserver.reading import checked_times, window

Codes, Kind, Times = ua.StatusCodes, ua.VariantType, ua.TimestampsToReturn
THEN, LATER = datetime(2026, 1, 1, tzinfo=UTC), datetime(2026, 1, 2, tzinfo=UTC)


def looked_at(value: ua.DataValue, times: Times, index_range: str = "", attribute: int = 13) -> ua.DataValue:
    found = window(ua.ReadValueId(AttributeId=attribute, IndexRange=index_range), times)
    return found.timed(found.part(value))


@pytest.mark.parametrize(
    ("times", "source", "server"),
    [
        (Times.Source, THEN, None),
        (Times.Server, None, LATER),
        (Times.Both, THEN, LATER),
        (Times.Neither, None, None),
    ],
)
def test_the_times_are_those_that_are_asked_for(
    times: Times, source: datetime | None, server: datetime | None
) -> None:
    value = ua.DataValue(ua.Variant(7, Kind.Byte), SourceTimestamp=THEN, ServerTimestamp=LATER)
    seen = looked_at(value, times)
    assert (seen.SourceTimestamp, seen.ServerTimestamp, seen.Value.Value) == (source, server, 7)
    assert (value.SourceTimestamp, value.ServerTimestamp) == (THEN, LATER), "it is others' value, too"
    # Only values have a source time.
    assert looked_at(value, times, attribute=ua.AttributeIds.NodeClass).SourceTimestamp is None


def test_a_server_time_that_is_asked_for_is_there() -> None:
    assert looked_at(ua.DataValue(ua.Variant(7, Kind.Byte)), Times.Server).ServerTimestamp is not None


def test_a_bad_status_is_not_covered_by_a_range_that_is_empty() -> None:
    dead = ua.DataValue(ua.Variant(None, Kind.Null), ua.StatusCode(Codes.BadNoCommunication))
    assert looked_at(dead, Times.Both, "1").StatusCode.value == Codes.BadNoCommunication
    alive = ua.DataValue(ua.Variant(7, Kind.Byte))
    assert looked_at(alive, Times.Both, "1").StatusCode.value == Codes.BadIndexRangeNoData


def test_times_that_say_nothing_are_refused() -> None:
    with pytest.raises(ServiceError) as refused:
        checked_times(ua.ReadParameters(TimestampsToReturn=Times.Invalid))
    assert refused.value.code == Codes.BadTimestampsToReturnInvalid
