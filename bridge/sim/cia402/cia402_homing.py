"""Homing mode of the simulated CiA 402 drive: methods 17, 18 (limit switch), 33, 34 (zero pulse), 35 and 37
(here), of 6098h."""

from __future__ import annotations

import math
from collections.abc import Callable
from enum import Enum
from typing import Final

from bridge.sim.cia402.cia402_modes import BIT_4, BIT_12, BIT_13, TARGET_REACHED, Parts, Targets
from bridge.sim.cia402.cia402_settings import INCREMENTS, Cia402Settings
from bridge.sim.core.motor import Motor

METHODS: Final = (17, 18, 33, 34, 35, 37)
SWITCH_AT: Final = 100_000
"""Position of the limit switches, relative to where the drive was switched on."""
_GIVES_UP_AFTER: Final = 4 * SWITCH_AT


class _Phase(Enum):
    IDLE = "not started, or interrupted"
    RUNNING = "in progress"
    DONE = "attained"
    FAILED = "failed"


class Homing(Parts):
    """hm: begins with bit 4 and ends when that falls. ``switches`` False: they are never found."""

    def __init__(self, motor: Motor, settings: Callable[[], Cia402Settings], targets: Targets) -> None:
        super().__init__(motor, settings, targets)
        self.switches = True
        self._shift = 0.0
        """The machine's position is the drive's position plus this."""
        self._phase = _Phase.IDLE
        self._goal = 0.0
        self._speed = 0.0

    def power_on(self) -> None:
        self._shift, self._phase = 0.0, _Phase.IDLE

    def on_control_word(self, word: int, rising: int) -> None:
        if rising & BIT_4:
            self._begin()
        elif not word & BIT_4 and self._phase is _Phase.RUNNING:
            self._phase = _Phase.IDLE

    def _begin(self) -> None:
        method, speeds = self.settings.homing_method, self.settings.homing_speeds
        place = self.motor.position + self._shift
        self._phase = _Phase.RUNNING
        self._speed = float(speeds[0] if method in (17, 18) else speeds[1])
        match method:
            case 17 | 18:
                way = SWITCH_AT if self.switches else _GIVES_UP_AFTER
                self._goal = float(-way if method == 17 else way)
            case 33:
                self._goal = math.ceil(place / INCREMENTS - 1) * INCREMENTS
            case 34:
                self._goal = math.floor(place / INCREMENTS + 1) * INCREMENTS
            case _:
                self._goal = place
        self._goal -= self._shift

    @property
    def inputs(self) -> int:
        """60FDh: bit 0 is the negative limit switch, bit 1 the positive one."""
        place = self.motor.position + self._shift
        is_there = self.switches
        return (place <= -SWITCH_AT and is_there) | (place >= SWITCH_AT and is_there) << 1

    @property
    def demand(self) -> float:
        return self.motor.velocity

    def advance(self, dt_s: float) -> None:
        ramp = self.settings.homing_acceleration
        if self._phase is not _Phase.RUNNING:
            self.motor.ramp_to(0.0, 0.0, ramp, dt_s)
        elif self.motor.go_to(self._goal, self._speed, ramp, ramp, dt_s):
            self._arrived()

    def _arrived(self) -> None:
        settings, motor = self.settings, self.motor
        if settings.homing_method in (17, 18) and not self.switches:
            self._phase = _Phase.FAILED
            return
        self._shift += motor.position - settings.home_offset
        motor.position = float(settings.home_offset)
        self._phase = _Phase.DONE

    def leave(self) -> None:
        if self._phase is _Phase.RUNNING:
            self._phase = _Phase.IDLE

    @property
    def bits(self) -> int:
        bits = TARGET_REACHED if self.motor.stands_still and self._phase is not _Phase.RUNNING else 0
        if self._phase is _Phase.DONE:
            bits |= BIT_12
        return bits | (BIT_13 if self._phase is _Phase.FAILED else 0)
