"""An axis of a STÖBER inverter with the application command positioning (ID 441684.06 §10).

§10 names target position, speed, accelerations and commands such as "go absolute". Bits and numbers are those
of mappings/stoeber/5000-posi.toml; the manual prints none.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from enum import IntEnum
from typing import Final

from bridge.sim.core.motor import Motor
from bridge.sim.stoeber.stoeber_axis import AxisParameters, AxisState, StoeberAxis

START: Final = 0x10
_COMMAND: Final = 0x0F
TAKEN: Final = 0x01
REACHED: Final = 0x02
REFERENCED: Final = 0x04
POSITIVE_LIMIT: Final = 0x08
NEGATIVE_LIMIT: Final = 0x10
ABORTED: Final = 0x20
LIMIT_AT: Final = 100_000
"""Distance of the limit switches, to both sides of the place where the axis stood when it was made."""
HOME_AT: Final = -2_000
"""Place of the reference switch."""
_STEP_S: Final = 0.005
_MOST_STEPS: Final = 2000


class PosiCommand(IntEnum):
    """The low four bits of I210."""

    ABSOLUTE = 1
    RELATIVE = 2
    HOMING = 3


class PositioningAxis(StoeberAxis):
    """The set-points are in the units of the axis, of which ``I07`` / ``I08`` make a revolution. A command
    begins with the rising edge of the start bit in I210, if the axis is enabled."""

    def __init__(
        self, number: int, parameters: Callable[[], AxisParameters], may_switch_on: Callable[[], bool]
    ) -> None:
        super().__init__(number, parameters, may_switch_on)
        self.command = 0
        """I210."""
        self.target = 0
        self.velocity = 0
        self.acceleration = 0
        self.deceleration = 0
        """I213, I216, I217, I218; a ramp of 0 is the one of the parameters."""
        self.motor = Motor(parameters().max_speed)
        self.has_home_switch = True
        self._seen = 0
        self._goal: float | None = None
        self._bits = 0
        self._machine = 0.0
        """Place on the machine of position 0, which the reference switch sets."""

    @property
    def posi_status(self) -> int:
        """I200."""
        place = self.place
        bits = self._bits
        bits |= POSITIVE_LIMIT if place >= LIMIT_AT else 0
        return bits | (NEGATIVE_LIMIT if place <= -LIMIT_AT else 0)

    @property
    def place(self) -> float:
        """Place of the axis, seen from the limit switches."""
        return self.motor.position + self._machine

    def power_on(self, now: float) -> None:
        super().power_on(now)
        self._machine, self.motor.position, self.motor.velocity = self.place, 0.0, 0.0
        self.command = self._seen = self._bits = 0
        self.target = self.velocity = self.acceleration = self.deceleration = 0
        self._goal = None

    def settle(self) -> bool:
        changed = super().settle()
        if self.state is not AxisState.ENABLED:
            self._goal = None
        rising = self.command & ~self._seen & START
        self._seen = self.command
        if rising and self.state is AxisState.ENABLED:
            self._begin()
        elif not self.command & START:
            self._bits &= ~TAKEN
        return changed

    def _begin(self) -> None:
        base = self.motor.position if self._goal is None else self._goal
        match self.command & _COMMAND:
            case PosiCommand.ABSOLUTE:
                self._goal = float(self.target)
            case PosiCommand.RELATIVE:
                self._goal = base + self.target
            case PosiCommand.HOMING:
                self._bits &= ~REFERENCED
                self._goal = (HOME_AT if self.has_home_switch else -2 * LIMIT_AT) - self._machine
            case _:
                return  # no command of this number: it is not taken
        self._bits = self._bits & ~(REACHED | ABORTED) | TAKEN

    @property
    def _speed(self) -> float:
        return float(min(self.velocity, self._parameters().max_speed))

    @property
    def _moves(self) -> bool:
        return self.motor.velocity != 0 or (self._goal is not None and self._speed > 0)

    def _ramp(self, dt_s: float) -> None:
        steps = min(_MOST_STEPS, math.ceil(dt_s / _STEP_S)) if self._moves else 0
        for _ in range(steps):
            self._move(dt_s / steps)
        parameters = self._parameters()
        self.speed_rpm = self.motor.velocity * 60 * parameters.i08 / parameters.i07

    def _move(self, dt_s: float) -> None:
        parameters, motor = self._parameters(), self.motor
        motor.max_speed = parameters.max_speed
        up = self.acceleration or motor.max_speed / max(parameters.accelerate_s, _STEP_S)
        down = self.deceleration or motor.max_speed / max(parameters.decelerate_s, _STEP_S)
        if self._is_stopping:
            motor.ramp_to(0.0, 0.0, motor.max_speed / max(parameters.quick_stop_s, _STEP_S), dt_s)
        elif self.state is not AxisState.ENABLED:
            motor.coast(dt_s)
        elif self._goal is None or not self._speed:
            motor.ramp_to(0.0, 0.0, down, dt_s)
        elif self._is_blocked(self._goal):
            self._goal = None
            self._bits |= ABORTED
        elif motor.go_to(self._goal, self._speed, up, down, dt_s):
            self._arrived()

    def _is_blocked(self, goal: float) -> bool:
        """True at a limit switch, and on the way beyond it."""
        way = goal - self.motor.position
        return (way > 0 and self.place >= LIMIT_AT) or (way < 0 and self.place <= -LIMIT_AT)

    def _arrived(self) -> None:
        self._goal = None
        self._bits |= REACHED
        if self._seen & _COMMAND == PosiCommand.HOMING:
            self._machine, self.motor.position = self.place, 0.0
            self._bits |= REFERENCED
