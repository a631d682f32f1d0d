"""Looks at what has changed, and the cycles that follow them."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from bridge.base.beat import LOOK_EVERY_S, cycle_by, next_before_look, next_look

NOW = st.floats(0, 1e7)
INTERVALS = st.integers(1, 1000)
ROUNDING_S = 1e-6


@given(NOW)
def test_the_next_look_is_near_and_on_the_beat(now: float) -> None:
    look = next_look(now)
    assert now < look <= now + LOOK_EVERY_S + ROUNDING_S
    assert abs(look / LOOK_EVERY_S - round(look / LOOK_EVERY_S)) < ROUNDING_S


@given(NOW, INTERVALS)
def test_a_cycle_comes_within_its_interval_and_right_behind_a_look(now: float, intervals: int) -> None:
    by = now + intervals * LOOK_EVERY_S
    cycle = cycle_by(by)
    assert by - LOOK_EVERY_S - ROUNDING_S <= cycle <= by + ROUNDING_S
    assert cycle >= now - ROUNDING_S
    behind_s = cycle - (next_look(cycle) - LOOK_EVERY_S)
    assert 0.007 < behind_s < 0.009


@given(NOW, INTERVALS, st.integers(1, 50))
def test_cycles_of_whole_looks_stay_behind_them(now: float, intervals: int, cycles: int) -> None:
    at = cycle_by(now + intervals * LOOK_EVERY_S)
    for _ in range(cycles):
        at += intervals * LOOK_EVERY_S
    assert 0.005 < at - (next_look(at) - LOOK_EVERY_S) < 0.011


@given(NOW)
def test_what_is_sent_before_a_look_is_seen_by_it(now: float) -> None:
    sent = next_before_look(now)
    assert now < sent <= now + LOOK_EVERY_S + ROUNDING_S
    assert 0.005 < next_look(sent) - sent < 0.007
