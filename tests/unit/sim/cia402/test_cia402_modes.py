"""Modes of operation of the simulated CiA 402 drive."""

from __future__ import annotations

import pytest

from bridge.sim.cia402.cia402_modes import (
    BIT_4,
    BIT_5,
    BIT_6,
    BIT_12,
    BIT_13,
    INTERNAL_LIMIT,
    TARGET_REACHED,
    CyclicPosition,
    CyclicVelocity,
    NoMode,
    ProfilePosition,
    ProfileVelocity,
    Targets,
    Velocity,
    slope,
)
from bridge.sim.cia402.cia402_settings import Cia402Settings
from bridge.sim.core.motor import Motor

ENABLE = 0x0F


class Rig:
    def __init__(self, kind: type, **settings: object) -> None:
        self.settings = Cia402Settings(**settings)
        self.motor = Motor(self.settings.max_speed)
        self.targets = Targets()
        self.mode = kind(self.motor, lambda: self.settings, self.targets)

    def word(self, word: int, rising: int = 0) -> None:
        self.mode.on_control_word(ENABLE | word, rising)

    def run(self, seconds: float) -> int:
        for _ in range(round(seconds * 200)):
            self.mode.advance(0.005)
        return self.mode.bits


def test_vl_needs_its_bits_and_stays_within_its_limits() -> None:
    rig = Rig(Velocity, vl_limits=[100, 600])
    rig.targets.vl_velocity = 1000
    rig.word(0)
    assert rig.mode.demand == 0
    rig.word(BIT_4 | BIT_5 | BIT_6)
    assert rig.mode.demand == 100_000  # 600/min
    assert rig.mode.bits == INTERNAL_LIMIT
    assert rig.run(1.0) == INTERNAL_LIMIT | TARGET_REACHED
    rig.targets.vl_velocity = -1
    assert rig.mode.demand == pytest.approx(-100 * 10_000 / 60)
    before = rig.motor.velocity
    rig.word(BIT_4 | BIT_6)
    rig.run(1.0)
    assert rig.motor.velocity == before, "the ramp is locked"


def test_pv_tells_limits_target_and_standstill() -> None:
    rig = Rig(ProfileVelocity, max_profile_velocity=50_000)
    rig.targets.velocity = 80_000
    rig.word(0)
    assert rig.mode.bits == INTERNAL_LIMIT | BIT_12
    assert rig.run(1.0) == INTERNAL_LIMIT | TARGET_REACHED
    assert rig.motor.velocity == 50_000


class TestProfilePosition:
    def go(self, rig: Rig, position: int, more: int = 0) -> int:
        rig.targets.position = position
        rig.word(BIT_4 | more, BIT_4)
        bits = rig.mode.bits
        rig.word(more)
        return bits

    def test_one_set_point_may_wait_and_a_third_has_no_room(self) -> None:
        rig = Rig(ProfilePosition)
        assert self.go(rig, 20_000) & BIT_12
        assert rig.mode.bits & BIT_12 == 0
        assert self.go(rig, 40_000) & BIT_12
        assert rig.mode.bits & BIT_12, "it waits: there is no room"
        self.go(rig, 60_000)
        rig.run(10.0)
        assert rig.motor.position == 40_000
        assert rig.mode.bits == TARGET_REACHED

    def test_bit_5_takes_it_at_once_and_bit_6_adds(self) -> None:
        rig = Rig(ProfilePosition)
        self.go(rig, 900_000)
        rig.run(0.2)
        self.go(rig, 10_000, BIT_5)
        rig.run(10.0)
        self.go(rig, 500, BIT_6)
        rig.run(5.0)
        assert rig.motor.position == 10_500

    def test_limits_are_told(self) -> None:
        rig = Rig(ProfilePosition, position_limits=[-100, 100])
        self.go(rig, 5000)
        assert rig.run(2.0) == TARGET_REACHED | INTERNAL_LIMIT
        assert rig.motor.position == 100


def test_csp_reaches_each_target_in_its_time_and_tells_when_it_cannot() -> None:
    rig = Rig(CyclicPosition, interpolation=[10, -3], following_window=1000, following_ms=10)
    rig.targets.position = 100
    rig.mode.on_target()
    assert rig.run(0.01) == BIT_12
    assert rig.motor.position == 100
    rig.targets.position = 10_000_000
    rig.mode.on_target()
    assert rig.run(0.02) == BIT_12 | BIT_13
    assert rig.mode.following_error
    rig.mode.leave()
    assert not rig.mode.following_error


def test_csv_jumps_and_no_mode_stands_still() -> None:
    rig = Rig(CyclicVelocity)
    rig.targets.velocity = 10_000_000
    assert rig.run(0.005) == BIT_12 | INTERNAL_LIMIT
    assert rig.motor.velocity == rig.settings.max_speed
    still = Rig(NoMode)
    still.targets.velocity = 1000
    assert (still.run(1.0), still.motor.velocity, still.mode.demand) == (0, 0.0, 0.0)


def test_a_ramp_without_a_time_is_a_jump() -> None:
    assert slope([600, 2]) == 50_000
    assert slope([600, 0]) == 0
