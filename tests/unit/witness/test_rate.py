"""Rates of frames: one sender in its period is never too often, two of them are told."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.witness.rate import SPARE, WINDOW_S, Rate


@pytest.mark.parametrize("period_ms", [1.0, 10.0, 100.0])
def test_one_sender_in_its_period_is_never_too_often(period_ms: float) -> None:
    rate = Rate(period_ms)
    assert not any(rate.is_too_often(number * period_ms / 1000) for number in range(5000))


@pytest.mark.parametrize("period_ms", [10.0, 100.0])
def test_two_senders_are_told_within_the_window(period_ms: float) -> None:
    rate = Rate(period_ms)
    told = [number for number in range(2000) if rate.is_too_often(number * period_ms / 2000)]
    assert told
    assert told[0] * period_ms / 2000 <= WINDOW_S


def test_after_that_it_is_counted_anew() -> None:
    rate = Rate(1000.0)
    most = int(1.5 * WINDOW_S) + SPARE
    seen = [rate.is_too_often(0.0) for _ in range(2 * (most + 1))]
    assert seen == ([False] * most + [True]) * 2


@given(st.lists(st.floats(0, 100), max_size=300))
def test_nobody_knows_how_often_is_too_often_without_a_period(times: list[float]) -> None:
    rate = Rate(0)
    assert not any(rate.is_too_often(at) for at in sorted(times))
