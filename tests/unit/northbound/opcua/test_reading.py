"""Which part of a value a client gets, and which of its times; no server."""

from __future__ import annotations

from datetime import UTC, datetime

import pytest
from asyncua import ua
from hypothesis import given
from hypothesis import strategies as st

from bridge.uaserver import ranges
from bridge.uaserver.library import ServiceError
from bridge.uaserver.reading import checked_times, window

Codes, Kind, Times = ua.StatusCodes, ua.VariantType, ua.TimestampsToReturn
THEN, LATER = datetime(2026, 1, 1, tzinfo=UTC), datetime(2026, 1, 2, tzinfo=UTC)


@pytest.mark.parametrize(
    "wrong",
    [
        "x",
        "-1",
        "1:",
        ":1",
        "3:1",
        "5:5",
        "1: 2",
        "1,",
        ",",
        "1;2",
        "1.0",
        "0x1",
        "١",
        "9" * 11,
        "1:2:3",
        "\ud800",
    ],
)
def test_what_is_no_range_is_none(wrong: str) -> None:
    with pytest.raises(ValueError, match=r"is no index|does not rise"):
        ranges.parse(wrong)
    with pytest.raises(ServiceError) as refused:
        window(ua.ReadValueId(AttributeId=ua.AttributeIds.Value, IndexRange=wrong), Times.Both)
    assert refused.value.code == Codes.BadIndexRangeInvalid


@given(st.lists(st.integers(0, 9), max_size=8), st.integers(0, 10), st.integers(1, 10))
def test_a_range_is_what_lies_within(held: list[int], first: int, more: int) -> None:
    found = ranges.part(ranges.parse(f"{first}:{first + more}"), ua.Variant(held, Kind.Byte))
    expected = held[first : first + more + 1]
    assert (found.Value if found else []) == expected
    one = ranges.part(ranges.parse(str(first)), ua.Variant(held, Kind.Byte))
    assert (one.Value if one else []) == held[first : first + 1]


@pytest.mark.parametrize(
    ("held", "written", "part"),
    [
        (ua.Variant("good morning", Kind.String), "5:11", "morning"),
        (ua.Variant(b"\x01\x02\x03", Kind.ByteString), "1", b"\x02"),
        (ua.Variant(["red", "green"], Kind.String), "0:1,0:1", ["re", "gr"]),
        (ua.Variant(["red", "green"], Kind.String), "0:1,9", None),
        (ua.Variant([1, 2], Kind.Byte), "0:1,0:1", None),
        (ua.Variant([1, 2], Kind.Byte), "2", None),
        (ua.Variant("red", Kind.String), "0,0", None),
        (ua.Variant(7, Kind.Byte), "0", None),
        (ua.Variant(None, Kind.Null), "0", None),
        (None, "0", None),
    ],
)
def test_texts_and_arrays_have_parts_and_nothing_else(
    held: ua.Variant | None, written: str, part: object
) -> None:
    found = ranges.part(ranges.parse(written), held)
    assert (found.Value if found else None) == part


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
