"""The motor of simulated drives that position."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.sim.core.motor import COAST_S, Motor

TICK_S = 0.01


def test_it_speeds_up_by_its_ramp_and_turns_meanwhile() -> None:
    motor = Motor(10_000)
    for _ in range(100):
        motor.ramp_to(1000, 1000, 1000, TICK_S)
    assert motor.velocity == pytest.approx(1000)
    assert motor.position == pytest.approx(500, rel=0.02)


def test_without_voltage_it_runs_down_from_full_speed_in_its_time() -> None:
    motor = Motor(10_000)
    motor.velocity = 10_000
    for _ in range(round(COAST_S / TICK_S)):
        assert not motor.stands_still
        motor.coast(TICK_S)
    assert motor.stands_still


@given(goal=st.integers(-50_000, 50_000), speed=st.integers(100, 5000), ramp=st.integers(500, 20_000))
def test_it_stops_at_its_goal_and_no_further(goal: int, speed: int, ramp: int) -> None:
    motor = Motor(10_000)
    furthest = 0.0
    for _ in range(100_000):
        if motor.go_to(goal, speed, ramp, ramp, TICK_S):
            break
        furthest = max(furthest, abs(motor.position))
        assert abs(motor.velocity) <= speed + 1
    assert (motor.position, motor.velocity) == (goal, 0.0)
    assert furthest <= abs(goal) + speed * TICK_S


def test_the_position_wraps_as_an_integer32() -> None:
    motor = Motor(1000)
    motor.position = 0x7FFF_FFFF
    motor.move(1.0)
    assert motor.position == -0x8000_0000
    motor.move(-1.0)
    assert motor.position == 0x7FFF_FFFF
