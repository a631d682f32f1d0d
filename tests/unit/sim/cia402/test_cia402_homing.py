"""Homing of the simulated CiA 402 drive."""

from __future__ import annotations

import pytest

from bridge.sim.cia402.cia402_homing import SWITCH_AT, Homing
from bridge.sim.cia402.cia402_modes import BIT_4, BIT_12, BIT_13, TARGET_REACHED, Targets
from bridge.sim.cia402.cia402_settings import INCREMENTS, Cia402Settings
from bridge.sim.core.motor import Motor


class Rig:
    def __init__(self, method: int, offset: int = 0) -> None:
        self.settings = Cia402Settings(homing_method=method, home_offset=offset)
        self.motor = Motor(self.settings.max_speed)
        self.homing = Homing(self.motor, lambda: self.settings, Targets())

    def start(self) -> None:
        self.homing.on_control_word(0x1F, BIT_4)

    def run(self, seconds: float) -> int:
        for _ in range(round(seconds * 200)):
            self.homing.advance(0.005)
        return self.homing.bits


@pytest.mark.parametrize(("method", "ends_at"), [(17, -SWITCH_AT), (18, SWITCH_AT)])
def test_the_limit_switch_becomes_the_offset(method: int, ends_at: int) -> None:
    rig = Rig(method, offset=500)
    rig.start()
    assert rig.run(0.5) & (TARGET_REACHED | BIT_12) == 0
    assert rig.run(10.0) == TARGET_REACHED | BIT_12
    assert rig.motor.position == 500
    assert rig.homing.inputs == (1 if ends_at < 0 else 2), "it stands on the switch"


@pytest.mark.parametrize("method", [33, 34, 35, 37])
def test_a_zero_pulse_or_here(method: int) -> None:
    rig = Rig(method)
    rig.motor.position = 1234.0
    rig.start()
    assert rig.run(3.0) == TARGET_REACHED | BIT_12
    assert rig.motor.position == 0
    # Of a pulse the way to it is no longer known: it is less than a turn away.
    assert abs(rig.homing._shift) <= INCREMENTS


def test_without_a_switch_it_fails() -> None:
    rig = Rig(18)
    rig.homing.switches = False
    rig.start()
    assert rig.run(60.0) & (BIT_12 | BIT_13) == BIT_13


def test_it_is_interrupted_when_its_bit_falls() -> None:
    rig = Rig(17)
    rig.start()
    rig.run(0.5)
    rig.homing.on_control_word(0x0F, 0)
    assert rig.run(1.0) == TARGET_REACHED
    assert -SWITCH_AT < rig.motor.position < 0
