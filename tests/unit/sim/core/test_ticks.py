"""The common tick, and the first of several deadlines."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from bridge.sim.core.ticks import TICK_S, earliest, next_tick


@given(st.floats(0, 1e6))
def test_the_next_tick_is_a_multiple_and_neither_too_soon_nor_too_late(time: float) -> None:
    tick = next_tick(time)
    assert abs(tick / TICK_S - round(tick / TICK_S)) < 1e-3
    assert TICK_S * 0.49 < tick - time < TICK_S * 1.51


def test_who_has_no_deadline_does_not_count() -> None:
    assert earliest(3.0, None, 2.0) == 2.0
    assert earliest(None) is None
    assert earliest() is None
