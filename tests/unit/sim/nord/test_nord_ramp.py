"""The shaft's position of a NORD inverter (BU 2500 §6.5.4)."""

from __future__ import annotations

import pytest

from bridge.sim.nord.nord_ramp import INCREMENTS, POLE_PAIRS, turned


def test_the_position_follows_the_mean_of_two_frequencies() -> None:
    assert turned(0.0, 0.0, 50.0, 2.0) == 50 / POLE_PAIRS * INCREMENTS
    assert turned(100.0, -POLE_PAIRS, -POLE_PAIRS, 1.0) == 100 - INCREMENTS


def test_it_wraps_at_32_bits() -> None:
    assert turned(0x7FFF_FFFF, 0.002, 0.002, 1.0) == pytest.approx(-0x8000_0000)
