"""Changes on the wire: whatever is packed here is decoded as what asyncua encodes."""

from __future__ import annotations

from datetime import UTC, datetime

import pytest
from asyncua import ua
from asyncua.common.utils import Buffer
from asyncua.ua.ua_binary import struct_from_binary, struct_to_binary
from hypothesis import given
from hypothesis import strategies as st

from bridge.uaserver.library import notification
from bridge.uaserver.subscriptions.notifications import change, changes
from tests.support.opcua_sessions import decoded_changes

Codes, Type = ua.StatusCodes, ua.VariantType
NOON = datetime(2026, 11, 29, 12, 0, 0, 123456, UTC)


def integers(bits: int, *, signed: bool) -> st.SearchStrategy[int]:
    low = -(2 ** (bits - 1)) if signed else 0
    return st.integers(low, low + 2**bits - 1)


VALUES = {
    Type.Boolean: st.booleans(),
    Type.SByte: integers(8, signed=True),
    Type.Byte: integers(8, signed=False),
    Type.Int16: integers(16, signed=True),
    Type.UInt16: integers(16, signed=False),
    Type.Int32: integers(32, signed=True),
    Type.UInt32: integers(32, signed=False),
    Type.Int64: integers(64, signed=True),
    Type.UInt64: integers(64, signed=False),
    Type.Float: st.floats(width=32, allow_nan=False),
    Type.Double: st.floats(allow_nan=False),
    Type.String: st.text(max_size=5),
    Type.ByteString: st.binary(max_size=5),
    Type.LocalizedText: st.builds(ua.LocalizedText, st.text(max_size=5), st.just("en")),
}


@st.composite
def variants(draw: st.DrawFn) -> ua.Variant:
    kind = draw(st.sampled_from(list(VALUES)))
    held = VALUES[kind]
    value = draw(st.one_of(held, st.lists(held, min_size=1, max_size=3)))
    return ua.Variant(value, kind)


times = st.none() | st.integers(-8_000_000_000, 200_000_000_000).map(lambda s: datetime.fromtimestamp(s, UTC))
codes = st.none() | st.sampled_from([Codes.Good, Codes.UncertainLastUsableValue, Codes.GoodClamped]).map(
    ua.StatusCode
)
values = st.builds(ua.DataValue, variants(), codes, times, times, st.none() | st.integers(1, 9))


def as_asyncua_says(one: ua.MonitoredItemNotification) -> ua.MonitoredItemNotification:
    encoded = Buffer(struct_to_binary(one))
    return struct_from_binary(ua.MonitoredItemNotification, encoded)


@given(st.lists(st.tuples(st.integers(0, 2**32 - 1), values), max_size=4))
def test_changes_are_decoded_as_those_that_asyncua_encodes(told: list[tuple[int, ua.DataValue]]) -> None:
    expected = [as_asyncua_says(notification(*one)) for one in told]
    assert decoded_changes(changes([change(*one) for one in told])) == expected


@pytest.mark.parametrize(
    "wrong", [ua.Variant(70_000, Type.UInt16), ua.Variant("7", Type.Int32), ua.Variant(7, Type.String)]
)
def test_a_value_that_is_not_of_its_type_takes_no_other_with_it(wrong: ua.Variant) -> None:
    right = ua.DataValue(ua.Variant(1.5, Type.Double), ua.StatusCode(), NOON, NOON)
    told = decoded_changes(changes([change(1, right), change(2, ua.DataValue(wrong)), change(3, right)]))
    assert [one.ClientHandle for one in told] == [1, 2, 3]
    assert [one.Value.Value.Value for one in told] == [1.5, None, 1.5]
    assert told[1].Value.StatusCode.value == Codes.BadEncodingError


def test_a_number_takes_no_more_than_its_fields() -> None:
    one = ua.DataValue(ua.Variant(1.5, Type.Double), ua.StatusCode(), NOON, NOON)
    handle, masks, number, two_times = 4, 2, 8, 16
    assert len(change(7, one)) == handle + masks + number + two_times
