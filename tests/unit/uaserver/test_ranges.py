"""Index ranges: the part of a value that a client asks for."""

from __future__ import annotations

import pytest
from asyncua import ua
from hypothesis import given
from hypothesis import strategies as st

from bridge.uaserver import ranges
from bridge.uaserver.library import ServiceError
from bridge.uaserver.reading import window

Codes, Kind, Times = ua.StatusCodes, ua.VariantType, ua.TimestampsToReturn


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
