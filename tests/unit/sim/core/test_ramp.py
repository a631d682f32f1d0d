"""The ramp of simulated drives."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.sim.core.ramp import step


def test_up_and_down_have_their_own_times() -> None:
    assert step(0.0, 50.0, 2.0, 4.0, 50.0, 1.0) == 25.0
    assert step(50.0, 0.0, 2.0, 4.0, 50.0, 1.0) == 37.5
    assert step(10.0, 12.0, 2.0, 4.0, 50.0, 1.0) == 12.0
    assert step(10.0, -7.0, 0.0, 0.0, 50.0, 0.01) == -7.0


def test_through_zero_it_brakes_and_then_accelerates() -> None:
    assert step(25.0, -50.0, 1.0, 2.0, 50.0, 0.5) == pytest.approx(12.5)
    assert step(25.0, -50.0, 1.0, 2.0, 50.0, 1.5) == pytest.approx(-25.0)


@given(
    value=st.floats(-50, 50),
    target=st.floats(-50, 50),
    up=st.floats(0, 10),
    down=st.floats(0, 10),
    cuts=st.lists(st.floats(0.001, 0.5), min_size=1, max_size=20),
)
def test_a_ramp_does_not_depend_on_how_often_it_is_looked_at(value, target, up, down, cuts):
    once = step(value, target, up, down, 50.0, sum(cuts))
    often = value
    for cut in cuts:
        often = step(often, target, up, down, 50.0, cut)
    assert often == pytest.approx(once, abs=1e-5)
    assert min(value, target) - 1e-9 <= often <= max(value, target) + 1e-9
