"""The axis of the simulated CiA 402 drive: state machine, mode and motor put together."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final

from bridge.sim.cia402.cia402_homing import Homing
from bridge.sim.cia402.cia402_modes import (
    CyclicPosition,
    CyclicVelocity,
    NoMode,
    OperationMode,
    ProfilePosition,
    ProfileVelocity,
    Targets,
    Velocity,
    slope,
)
from bridge.sim.cia402.cia402_settings import INCREMENTS, Cia402Mode, Cia402Settings
from bridge.sim.cia402.cia402_states import ENABLE_VOLTAGE, QUICK_STOP, Automaton, Cia402State, StopRamp
from bridge.sim.core.motor import Motor
from bridge.sim.core.ticks import next_tick

INIT_S: Final = 0.1
FOLLOWING_ERROR: Final = 0x8611
_STEP_S: Final = 0.005
_MOST_STEPS: Final = 2000
_VOLTAGE: Final = 0x0010
_REMOTE: Final = 0x0200
_ABORT: Final = {2: ENABLE_VOLTAGE, 3: QUICK_STOP}
"""6007h: the bit of the control word that it clears."""


class Cia402Axis:
    """Times are seconds of the caller's clock. ``report`` gets the code of a fault, 0 after its reset."""

    def __init__(self, settings: Callable[[], Cia402Settings], report: Callable[[int], None]) -> None:
        self._settings = settings
        self._report = report
        self.targets = Targets()
        self.motor = Motor(settings().max_speed)
        self.automaton = Automaton(lambda: settings().options)
        self.error_code = 0
        """603Fh."""
        parts = (self.motor, settings, self.targets)
        self.homing = Homing(*parts)
        self.profile_position = ProfilePosition(*parts)
        self.cyclic_position = CyclicPosition(*parts)
        self._modes: dict[int, OperationMode] = {
            Cia402Mode.VELOCITY: Velocity(*parts),
            Cia402Mode.PROFILE_VELOCITY: ProfileVelocity(*parts),
            Cia402Mode.PROFILE_POSITION: self.profile_position,
            Cia402Mode.HOMING: self.homing,
            Cia402Mode.CYCLIC_POSITION: self.cyclic_position,
            Cia402Mode.CYCLIC_VELOCITY: CyclicVelocity(*parts),
            Cia402Mode.NONE: NoMode(*parts),
        }
        self._mode = self._modes[Cia402Mode.NONE]
        self._commanded: int | None = None
        self._was_enabled = False
        self._time = 0.0
        self._ready_at = 0.0

    @property
    def state(self) -> Cia402State:
        return self.automaton.state

    @property
    def demand_velocity(self) -> int:
        """The demanded speed in increments per second."""
        follows = self.state is Cia402State.ENABLED and self.automaton.ramp is None
        return round(self._mode.demand) if follows else 0

    @property
    def actual_rpm(self) -> int:
        return max(-0x8000, min(0x7FFF, round(self.motor.velocity * 60 / INCREMENTS)))

    @property
    def demand_rpm(self) -> int:
        return max(-0x8000, min(0x7FFF, round(self.demand_velocity * 60 / INCREMENTS)))

    @property
    def status_word(self) -> int:
        word = self.state | _VOLTAGE | _REMOTE
        if self.state is Cia402State.ENABLED:
            word |= self._mode.bits
            if self.automaton.ramp is not None:  # halted or being stopped: bit 10 means standstill
                word = word & ~0x0400 | (0x0400 if self.motor.stands_still else 0)
        elif self._mode is self.homing:
            word |= self.homing.bits & 0x3000
        return word

    def power_on(self, now: float) -> None:
        self.motor.position = self.motor.velocity = 0.0
        self.targets.vl_velocity = self.targets.position = self.targets.velocity = 0
        self.error_code = 0
        self.homing.power_on()
        self.automaton.power_on()
        self._commanded = None
        self._was_enabled = False
        self.set_mode()
        self._time, self._ready_at = now, now + INIT_S

    def set_mode(self) -> None:
        """6060h was written."""
        mode = self._modes[self._settings().mode]
        if mode is not self._mode:
            self._mode.leave()
            self._mode = mode
            if self._was_enabled:
                mode.on_control_word(self.automaton.control_word, 0)

    @property
    def control_word(self) -> int:
        return self.automaton.control_word if self._commanded is None else self._commanded

    def command(self, word: int) -> None:
        """6040h was written; it takes effect after the set-points that follow in the same PDO."""
        self._commanded = word

    def obey(self) -> None:
        """The PDO or the SDO request has been processed."""
        word, self._commanded = self._commanded, None
        if word is not None:
            self._on_control_word(word)

    def _on_control_word(self, word: int) -> None:
        rising = word & ~self.automaton.control_word
        if self.automaton.on_control_word(word, standstill=self.motor.stands_still):
            self.error_code = 0
            self._report(0)
        self._note_state()
        if self.state is Cia402State.ENABLED:
            self._mode.on_control_word(word, rising)

    def on_target_position(self) -> None:
        self.cyclic_position.on_target()

    def fail(self, code: int, *, lasting: bool = False) -> None:
        """An error of the drive: transition 13."""
        self.error_code = code
        self.automaton.fault(lasting=lasting)
        self._report(code)
        self._settle()

    def abort_connection(self, code: int) -> bool:
        """6007h: the master is gone. True if that is a fault to be reported."""
        option = self._settings().abort_connection
        if option == 1:
            self.fail(code)
            return True
        if option in _ABORT:
            # As if the control word had asked for it, so that the next one is obeyed again.
            self._on_control_word(self.automaton.control_word & ~_ABORT[option])
        return False

    def advance(self, now: float) -> bool:
        """Let the time until ``now`` pass. True if any has."""
        dt_s, self._time = max(0.0, now - self._time), now
        if self.state is Cia402State.NOT_READY and now >= self._ready_at:
            self.automaton.initialised()
            self._settle()
        if not self._is_busy:
            self._settle()
            return dt_s > 0
        steps = 0 if dt_s == 0 else min(_MOST_STEPS, max(1, math.ceil(dt_s / _STEP_S)))
        for _ in range(steps):
            self._move(dt_s / steps)
            self._settle()
        return steps > 0

    def next_deadline(self) -> float | None:
        if self.state is Cia402State.NOT_READY:
            return self._ready_at
        return next_tick(self._time) if self._is_busy else None

    @property
    def _is_busy(self) -> bool:
        """Whether anything changes with time."""
        if not self.motor.stands_still or self.automaton.leaving:
            return True
        if self.state in (Cia402State.FAULT_REACTION, Cia402State.QUICK_STOP_ACTIVE):
            return not self.motor.stands_still
        follows = self.state is Cia402State.ENABLED and self.automaton.ramp is None
        return follows and not (self._mode.bits & 0x0400 and abs(self._mode.demand) < 1)

    def _move(self, dt_s: float) -> None:
        automaton, settings = self.automaton, self._settings()
        ramp = automaton.ramp
        if ramp is None:
            self._mode.advance(dt_s)
            if self._mode is self.cyclic_position and self.cyclic_position.following_error:
                self.fail(FOLLOWING_ERROR)
        elif ramp is StopRamp.COAST:
            self.motor.coast(dt_s)
        else:
            self.motor.ramp_to(0.0, 0.0, self._braking(settings, ramp), dt_s)

    def _braking(self, settings: Cia402Settings, ramp: StopRamp) -> float:
        is_quick = ramp is StopRamp.QUICK
        if settings.mode == Cia402Mode.VELOCITY:
            return slope(settings.vl_quick_stop if is_quick else settings.vl_deceleration)
        return float(settings.quick_stop_deceleration if is_quick else settings.deceleration)

    def _settle(self) -> None:
        self.automaton.settle(standstill=self.motor.stands_still)
        self._note_state()

    def _note_state(self) -> None:
        """A mode's action ends when the drive leaves "operation enabled"."""
        is_enabled = self.state is Cia402State.ENABLED
        if self._was_enabled and not is_enabled:
            self._mode.leave()
        elif is_enabled and not self._was_enabled:
            self._mode.on_control_word(self.automaton.control_word, 0)
        self._was_enabled = is_enabled
