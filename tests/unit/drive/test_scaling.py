"""Words and values with a unit: 16384 (4000h) is 100 %, range ±200 % (BU 2500 §6.5.4)."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.drive import LinearScale, scale_of
from bridge.mapping.model import ProcessValue

HZ = LinearScale(50.0, 16384, 2.0)
"""P105 = 50 Hz."""
AMPERE = LinearScale(7.5, 16384, 2.0)
"""P112."""


@pytest.mark.parametrize(
    ("word", "hz"),
    [(0x4000, 50.0), (0xC000, -50.0), (0x2000, 25.0), (0x1000, 12.5), (0, 0.0), (0x8000, -100.0)],
)
def test_a_frequency_is_p105_times_the_word_through_16384(word: int, hz: float):
    assert HZ.from_word(word) == hz
    assert HZ.to_word(hz) == word


def test_a_current_is_p112_times_the_word_through_16384():
    assert AMPERE.from_word(0x4000) == 7.5
    assert AMPERE.from_word(0xE000) == -3.75


def test_the_range_ends_where_the_word_does():
    assert HZ.high == pytest.approx(99.99695)
    assert HZ.low == -100.0
    assert HZ.to_word(HZ.high) == 0x7FFF
    with pytest.raises(ValueError, match=r"takes -100…99\.9969, not 100"):
        HZ.to_word(100.0)


def test_a_lower_limit_of_the_family_counts():
    limited = LinearScale(50.0, 16384, 1.0)
    assert (limited.low, limited.high) == (-50.0, 50.0)
    with pytest.raises(ValueError, match="takes -50…50, not 50"):
        limited.to_word(50.01)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_what_is_no_number_is_refused(value: float):
    with pytest.raises(ValueError, match="takes"):
        HZ.to_word(value)


@given(st.integers(0, 0xFFFF), st.floats(0.1, 10_000), st.sampled_from([1000, 16384, 0x7FFF]))
def test_a_word_comes_back(word: int, full: float, at: int):
    scale = LinearScale(full, at, 100.0)
    assert scale.to_word(scale.from_word(word)) == word


@given(st.floats(-99.9, 99.9))
def test_a_value_is_rounded_to_the_nearest_word(value: float):
    half_a_step = 50.0 / 16384 / 2
    assert abs(HZ.from_word(HZ.to_word(value)) - value) <= half_a_step * 1.0001


@pytest.mark.parametrize(
    ("factor", "number", "value"),
    [
        (0.001, 2800758, 2800.758),
        (0.006, 12345, 74.07),
        (-0.1, 3, -0.3),
        (1e-9, 7, 7e-9),
        (2.5, 3, 7.5),
        (1.0, 5, 5.0),
        (0.7071067811865476, 3, 3 * 0.7071067811865476),
    ],
)
def test_a_decimal_factor_gives_the_nearest_number(factor: float, number: int, value: float) -> None:
    table = {"name": "way", "group": "actual", "words": ["low", "high"], "scale": {"factor": factor}}
    model = ProcessValue.model_validate(table)
    scale = scale_of(model)
    assert scale is not None
    assert scale.from_word(number) == value
    assert scale.to_word(value) == number
