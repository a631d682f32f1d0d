"""Publishing grid, and the cycles right behind its instants."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from bridge.base.publishing_clock import PUBLISH_EVERY_S, cycle_by, next_publish, next_send

NOW = st.floats(0, 1e7)
INTERVALS = st.integers(1, 1000)
ROUNDING_S = 1e-6


@given(NOW)
def test_the_next_publishing_is_near_and_on_the_grid(now: float) -> None:
    instant = next_publish(now)
    assert now < instant <= now + PUBLISH_EVERY_S + ROUNDING_S
    assert abs(instant / PUBLISH_EVERY_S - round(instant / PUBLISH_EVERY_S)) < ROUNDING_S


@given(NOW, INTERVALS)
def test_a_cycle_comes_within_its_interval_and_right_behind_an_instant_of_the_grid(
    now: float, intervals: int
) -> None:
    by = now + intervals * PUBLISH_EVERY_S
    cycle = cycle_by(by)
    assert by - PUBLISH_EVERY_S - ROUNDING_S <= cycle <= by + ROUNDING_S
    assert cycle >= now - ROUNDING_S
    behind_s = cycle - (next_publish(cycle) - PUBLISH_EVERY_S)
    assert 0.007 < behind_s < 0.009


@given(NOW, INTERVALS, st.integers(1, 50))
def test_cycles_of_whole_intervals_stay_behind_the_grid(now: float, intervals: int, cycles: int) -> None:
    at = cycle_by(now + intervals * PUBLISH_EVERY_S)
    for _ in range(cycles):
        at += intervals * PUBLISH_EVERY_S
    assert 0.005 < at - (next_publish(at) - PUBLISH_EVERY_S) < 0.011


@given(NOW)
def test_a_change_sent_in_time_is_published_with_the_next(now: float) -> None:
    sent = next_send(now)
    assert now < sent <= now + PUBLISH_EVERY_S + ROUNDING_S
    assert 0.005 < next_publish(sent) - sent < 0.007
