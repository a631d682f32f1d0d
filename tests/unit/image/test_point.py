"""What may be written to a point, and the sentence that says what may."""

from __future__ import annotations

import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.image import DataType, Point
from bridge.image.point import INTEGER_RANGE


def point(data_type: DataType, **more: Any) -> Point:
    return Point(name="conveyor/fu1/command/x", data_type=data_type, **more)


def test_a_name_is_a_path():
    it = point(DataType.BOOL)
    assert it.path == ("conveyor", "fu1", "command", "x")
    assert it.leaf == "x"


@pytest.mark.parametrize(
    ("data_type", "given_", "taken"),
    [
        (DataType.BOOL, True, True),
        (DataType.STRING, "text", "text"),
        (DataType.UINT16, 0xFFFF, 0xFFFF),
        (DataType.UINT16, -1, 0xFFFF),
        (DataType.UINT16, -0x8000, 0x8000),
        (DataType.UINT16, 5.0, 5),
        (DataType.INT16, -0x8000, -0x8000),
        (DataType.UINT8, 255, 255),
        (DataType.UINT32, 0xFFFF_FFFF, 0xFFFF_FFFF),
        (DataType.INT32, -0x8000_0000, -0x8000_0000),
        (DataType.FLOAT, 3, 3.0),
        (DataType.FLOAT, -2.5, -2.5),
    ],
)
def test_is_taken(data_type: DataType, given_: object, taken: object):
    value = point(data_type).check(given_)
    assert value == taken
    assert type(value) is type(taken)


@pytest.mark.parametrize(
    ("data_type", "value", "sentence"),
    [
        (DataType.BOOL, 1, "takes true or false"),
        (DataType.BOOL, "true", "takes true or false"),
        (DataType.STRING, 5, "takes a text"),
        (DataType.UINT16, True, "takes a number"),
        (DataType.UINT16, "5", "takes a number"),
        (DataType.UINT16, None, "takes a number"),
        (DataType.UINT16, 1.5, "takes a whole number"),
        (DataType.UINT16, math.nan, "takes a whole number"),
        (DataType.UINT16, math.inf, "takes a whole number"),
        (DataType.UINT16, 0x1_0000, "takes 0…65535"),
        (DataType.UINT16, -0x8001, "takes 0…65535"),
        (DataType.UINT16, 10**400, "takes 0…65535"),
        (DataType.UINT8, -1, "takes 0…255"),
        (DataType.INT16, 0x8000, "takes -32768…32767"),
        (DataType.FLOAT, False, "takes a number"),
        (DataType.FLOAT, math.nan, "takes a finite number"),
        (DataType.FLOAT, -math.inf, "takes a finite number"),
        (DataType.FLOAT, 10**400, "takes a finite number"),
    ],
)
def test_is_refused_with_a_sentence(data_type: DataType, value: object, sentence: str):
    with pytest.raises(ValueError, match=rf"^conveyor/fu1/command/x {sentence}"):
        point(data_type).check(value)


@pytest.mark.parametrize(
    ("low", "high", "value", "sentence"),
    [
        (-100.0, 100.0, 100.5, "takes -100…100 Hz, not 100.5"),
        (0.0, None, -1, "takes 0…inf Hz, not -1"),
        (None, 10.0, 11, "takes -inf…10 Hz, not 11"),
    ],
)
def test_a_range_is_told_with_its_unit(low: float | None, high: float | None, value: float, sentence: str):
    limited = point(DataType.FLOAT, unit="Hz", low=low, high=high)
    with pytest.raises(ValueError, match=sentence):
        limited.check(value)


@given(
    st.sampled_from(list(DataType)),
    st.one_of(st.none(), st.booleans(), st.integers(), st.floats(), st.text(), st.lists(st.integers())),
)
def test_a_value_is_the_points_own_type_or_refused(data_type: DataType, value: object):
    try:
        taken = point(data_type, low=-1000, high=1000).check(value)
    except ValueError as error:
        assert str(error).startswith("conveyor/fu1/command/x takes ")
        return
    kind = {DataType.BOOL: bool, DataType.STRING: str, DataType.FLOAT: float}.get(data_type, int)
    assert type(taken) is kind
    if data_type in INTEGER_RANGE:
        low, high = INTEGER_RANGE[data_type]
        assert low <= int(taken) <= high
