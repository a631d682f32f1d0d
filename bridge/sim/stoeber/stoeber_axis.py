"""One axis of a STÖBER inverter: device control byte and speed setpoint in, state and speed out.

The states are those of E48 (ID 441684.06 §11.1: 0…7); the fieldbus manual says no more about the drive.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum
from typing import Final

from bridge.sim.core.ramp import step
from bridge.sim.core.ticks import next_tick

SELF_TEST_S: Final = 0.2
CLOSING_S: Final = 0.02
"""Time in seconds from the enable to speed control: the duration of state 3."""
FAULT_REACTION_S: Final = 0.02
COAST_S: Final = 1.0
"""Run-down from C01 to standstill without voltage."""

ENABLE: Final = 0x01
ACKNOWLEDGE: Final = 0x02
QUICK_STOP: Final = 0x04
HANDSHAKE: Final = 0x80
HUNDRED_PERCENT: Final = 1000
_SHARE_MAX: Final = 2.0
_RATED_A: Final = 6.0


class AxisState(IntEnum):
    """E48."""

    SELF_TEST = 0
    INHIBITED = 1
    READY = 2
    SWITCHED_ON = 3
    ENABLED = 4
    FAULT = 5
    FAULT_REACTION = 6
    QUICK_STOP = 7


ON: Final = (AxisState.SWITCHED_ON, AxisState.ENABLED, AxisState.QUICK_STOP)
FAULTY: Final = (AxisState.FAULT, AxisState.FAULT_REACTION)


@dataclass(slots=True)
class AxisParameters:
    """The saved parameters of an axis. Times are those between standstill and C01."""

    c01_rpm: int = 3000
    c230_percent: int = 200
    accelerate_s: float = 0.5
    decelerate_s: float = 0.5
    quick_stop_s: float = 0.2
    i07: int = 360
    i08: int = 1
    """Way per revolution of the motor, with command positioning."""
    max_speed: int = 18_000
    """I10, in units of the axis per second; the times are those to this speed then."""


class StoeberAxis:
    """State machine and ramp. ``may_switch_on`` says whether the POSISwitch is free for this axis."""

    def __init__(
        self, number: int, parameters: Callable[[], AxisParameters], may_switch_on: Callable[[], bool]
    ) -> None:
        self.number = number
        self.state = AxisState.SELF_TEST
        self.control = 0
        self.setpoint = 0
        """Setpoint in 0.1 % of C01."""
        self.speed_rpm = 0.0
        self._parameters = parameters
        self._may_switch_on = may_switch_on
        self._brakes = False
        self._time = 0.0
        self._until = 0.0

    @property
    def status_byte(self) -> int:
        """Status as in E200: enabled, error, quick stop, axis, active, local, handshake."""
        byte = 0x01 if self.state is AxisState.ENABLED else 0
        byte |= 0x02 if self.state in FAULTY else 0
        byte |= 0x04 if self._is_stopping else 0
        byte |= (self.number - 1) << 3
        byte |= 0x20 if self.state in ON else 0
        return byte | self.control & HANDSHAKE

    @property
    def _is_stopping(self) -> bool:
        """True on the ramp of the quick stop, which a fault may use, too."""
        reacts = self.state is AxisState.FAULT_REACTION and self._brakes
        return self.state is AxisState.QUICK_STOP or reacts

    @property
    def current_a(self) -> float:
        if self.state not in (AxisState.ENABLED, AxisState.QUICK_STOP):
            return 0.0
        return _RATED_A * (0.3 + 0.3 * abs(self.speed_rpm) / self._parameters().c01_rpm)

    @property
    def blocks_others(self) -> bool:
        """Switched on, or still turning on the inverter's account."""
        return self.state in ON or self.speed_rpm != 0

    def power_on(self, now: float) -> None:
        self.control, self.setpoint, self.speed_rpm = 0, 0, 0.0
        self.state, self._time, self._until = AxisState.SELF_TEST, now, now + SELF_TEST_S

    def trip(self, *, brakes: bool) -> None:
        if self.state in FAULTY:
            return
        self._brakes = brakes and self.state in ON
        self.state, self._until = AxisState.FAULT_REACTION, self._time + FAULT_REACTION_S

    def acknowledge(self) -> bool:
        """Leave the fault; False while the reaction to it goes on."""
        if self.state is not AxisState.FAULT:
            return False
        self.state = AxisState.INHIBITED
        return True

    def advance(self, now: float) -> None:
        """Let the time until ``now`` pass."""
        dt_s, self._time = max(0.0, now - self._time), now
        self._ramp(dt_s)
        self.settle()

    def settle(self) -> bool:
        """Take every change of state that is due. True if there was any."""
        before = self.state
        while (state := self._next_state()) is not self.state:
            if state is AxisState.SWITCHED_ON:
                self._until = self._time + CLOSING_S
            self.state = state
        return self.state is not before

    def next_deadline(self) -> float | None:
        timed = (AxisState.SELF_TEST, AxisState.SWITCHED_ON, AxisState.FAULT_REACTION)
        if self.state in timed and self._time < self._until:
            return min(self._until, next_tick(self._time)) if self.speed_rpm else self._until
        return next_tick(self._time) if self._moves else None

    @property
    def _moves(self) -> bool:
        """Whether anything changes with time in a state that lasts."""
        return self.speed_rpm != self._target_rpm()

    def _next_state(self) -> AxisState:
        enable, stop = bool(self.control & ENABLE), bool(self.control & QUICK_STOP)
        due = self._time >= self._until
        match self.state:
            case AxisState.SELF_TEST if due:
                return AxisState.INHIBITED
            case AxisState.INHIBITED if not enable and not stop and self._may_switch_on():
                return AxisState.READY  # a new enable is needed: nothing starts by itself
            case AxisState.READY if stop or not self._may_switch_on():
                return AxisState.INHIBITED
            case AxisState.READY if enable:
                return AxisState.SWITCHED_ON
            case AxisState.SWITCHED_ON | AxisState.ENABLED | AxisState.QUICK_STOP if not enable:
                return AxisState.INHIBITED
            case AxisState.SWITCHED_ON if stop:
                return AxisState.INHIBITED
            case AxisState.SWITCHED_ON if due:
                return AxisState.ENABLED
            case AxisState.ENABLED if stop:
                return AxisState.QUICK_STOP
            case AxisState.QUICK_STOP if self.speed_rpm == 0:
                return AxisState.INHIBITED
            case AxisState.FAULT_REACTION if due and (self.speed_rpm == 0 or not self._brakes):
                return AxisState.FAULT
            case state:
                return state

    def _target_rpm(self) -> float:
        if self.state is not AxisState.ENABLED:
            return 0.0
        share = max(-_SHARE_MAX, min(_SHARE_MAX, self.setpoint / HUNDRED_PERCENT))
        limit = self._parameters().c01_rpm
        return max(-limit, min(limit, share * limit))

    def _ramp(self, dt_s: float) -> None:
        parameters = self._parameters()
        up_s, down_s = parameters.accelerate_s, parameters.decelerate_s
        if self._is_stopping:
            down_s = parameters.quick_stop_s
        elif self.state is not AxisState.ENABLED:
            down_s = COAST_S
        self.speed_rpm = step(self.speed_rpm, self._target_rpm(), up_s, down_s, parameters.c01_rpm, dt_s)
