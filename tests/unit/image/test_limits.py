"""Limits as people read them."""

from __future__ import annotations

import re

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from bridge.drive import LinearScale
from bridge.image.limits import shown_range


@pytest.mark.parametrize(
    ("low", "high", "shown"),
    [
        (-100.0, 99.99695, "-100…99.9969"),
        (-199.99390, 199.9939, "-199.993…199.993"),
        (0.0, 320.0, "0…320"),
        (0, 16777215, "0…16777215"),
        (0.1, 400.0, "0.1…400"),
        (1, None, "1 and more"),
        (None, 5.5, "up to 5.5"),
    ],
)
def test_limits_are_rounded_towards_the_inside(low: float | None, high: float | None, shown: str) -> None:
    assert str(shown_range(low, high)) == shown


@given(st.floats(0.1, 400.0), st.sampled_from([0.5, 1.0, 2.0]))
def test_what_a_refusal_says_is_allowed_is_accepted(full: float, limit: float) -> None:
    # BU 2500 §6.5.4: 4000h is P105, and a word ends at 7FFFh
    scale = LinearScale(full, 16384, limit)
    with pytest.raises(ValueError, match="takes") as refused:
        scale.to_word(1000.0)
    least, most = re.findall(r"-?\d+(?:\.\d+)?", str(refused.value))[:2]
    assume(float(most) > 0)
    scale.to_word(float(least))
    scale.to_word(float(most))
