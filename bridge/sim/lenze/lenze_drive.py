"""The device control and motor of an 8400 motec: control word in, status word and speed out.

The CANopen manual (EDS84DMOTCAN 3.0) leaves the words to the port interconnection (§8.2). These are the
device control's own, as ``mappings/lenze/8400-motec.toml`` describes them and with its reservations.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from enum import IntEnum
from typing import Final

from bridge.sim.core.dirty_flag import DirtyFlag
from bridge.sim.core.ramp import step
from bridge.sim.core.ticks import next_tick
from bridge.sim.lenze.lenze_settings import LenzeCodes

INIT_S: Final = 0.2
"""Time in seconds that the initialisation lasts; the manual gives none."""
COAST_S: Final = 1.0
"""The motor's run-down from C00011 to standstill without voltage."""
HUNDRED_PERCENT: Final = 0x4000

SWITCH_ON: Final = 0x0001
DISABLE_VOLTAGE: Final = 0x0002
QUICK_STOP: Final = 0x0004
ENABLE_OPERATION: Final = 0x0008
RESET_FAULT: Final = 0x0080


class DeviceState(IntEnum):
    """Device states; the value is what bits 8…11 of the status word show."""

    INIT = 1
    READY_TO_SWITCH_ON = 3
    SWITCHED_ON = 4
    OPERATION_ENABLED = 5
    TROUBLE = 7
    FAULT = 8


class Reaction(IntEnum):
    """Choices of C00592 and C00593 (§12.2)."""

    NONE = 0
    FAULT = 1
    TROUBLE = 2
    WARNING_LOCKED = 4


_PRIORITY: Final = (Reaction.FAULT, Reaction.TROUBLE, Reaction.WARNING_LOCKED)


class LenzeDrive:
    """State machine, ramps and errors of one drive. Times are seconds of the caller's clock."""

    def __init__(self, codes: Callable[[], LenzeCodes]) -> None:
        self._codes = codes
        self.dirty = DirtyFlag()
        self.state = DeviceState.INIT
        self.control_word = 0
        self.setpoint = 0
        self.speed_rpm = 0.0
        self.temperature_c = 43
        self._errors: dict[int, Reaction] = {}
        self._causes: set[int] = set()
        self._time = 0.0
        self._ready_at = 0.0

    @property
    def errors(self) -> list[int]:
        """Numbers of present and unacknowledged errors, that of C00168 first."""
        return sorted(self._errors, key=lambda number: _PRIORITY.index(self._errors[number]))

    @property
    def error_number(self) -> int:
        """C00168; 0 is none."""
        return next(iter(self.errors), 0)

    @property
    def inhibited(self) -> bool:
        return self.state is not DeviceState.OPERATION_ENABLED

    @property
    def status_word(self) -> int:
        at_setpoint = not self.inhibited and self.speed_rpm == self._target_rpm()
        word = 0x0082 if self.inhibited else 0
        word |= 0x0018 if at_setpoint else 0
        word |= 0x0040 if self.speed_rpm == 0 else 0
        word |= self.state << 8
        word |= 0x1000 if Reaction.WARNING_LOCKED in self._errors.values() else 0
        return word | (0x2000 if self.state is DeviceState.TROUBLE else 0)

    @property
    def speed_word(self) -> int:
        return _word(self.speed_rpm / self._codes().reference_rpm)

    def power_on(self, now: float) -> None:
        self.control_word = self.setpoint = 0
        self._errors.clear()
        self._causes.clear()
        self.speed_rpm = 0.0
        self.state, self._time, self._ready_at = DeviceState.INIT, now, now + INIT_S
        self.dirty.is_set = True

    def on_words(self, words: Sequence[int]) -> None:
        """CAN1_IN: control word and speed setpoint; the other words are not connected."""
        if self.control_word == words[0] and self.setpoint == words[1]:
            return  # said again
        self.dirty.is_set = True
        rising = words[0] & ~self.control_word
        self.control_word, self.setpoint = words[0], words[1]
        if rising & RESET_FAULT:
            self._errors = {n: reaction for n, reaction in self._errors.items() if n in self._causes}
        self._settle()

    def error(self, number: int, reaction: Reaction, *, lasting: bool = True) -> None:
        """An error occurs. A ``lasting`` cause (that of a trouble always is) blocks the acknowledge until
        ``cause_gone``."""
        if reaction is Reaction.NONE or number in self._causes:
            return
        if lasting or reaction is Reaction.TROUBLE:
            self._causes.add(number)
        self._errors[number] = reaction
        self.dirty.is_set = True
        self._settle()

    def cause_gone(self, number: int) -> None:
        """A trouble ends with its cause; a fault and a locked warning wait for the acknowledge."""
        self._causes.discard(number)
        if self._errors.get(number) is Reaction.TROUBLE:
            del self._errors[number]
            self.dirty.is_set = True
            self._settle()

    def advance(self, now: float) -> None:
        """Let the time until ``now`` pass."""
        dt_s, self._time = max(0.0, now - self._time), now
        before = self.state, self.speed_rpm
        self._ramp(dt_s)
        self._settle()
        if before != (self.state, self.speed_rpm):
            self.dirty.is_set = True

    def next_deadline(self) -> float | None:
        if self.state is DeviceState.INIT:
            return self._ready_at
        return None if self.speed_rpm == self._target_rpm() else next_tick(self._time)

    def _settle(self) -> None:
        """Make all transitions that errors and control word ask for."""
        reactions = self._errors.values()
        if self.state is DeviceState.INIT and self._time < self._ready_at:
            return
        if Reaction.FAULT in reactions:
            self.state = DeviceState.FAULT
        elif Reaction.TROUBLE in reactions:
            self.state = DeviceState.TROUBLE
        elif not self.control_word & SWITCH_ON:
            self.state = DeviceState.READY_TO_SWITCH_ON
        elif self.control_word & (ENABLE_OPERATION | DISABLE_VOLTAGE) == ENABLE_OPERATION:
            self.state = DeviceState.OPERATION_ENABLED
        else:
            self.state = DeviceState.SWITCHED_ON

    def _target_rpm(self) -> float:
        """The demanded speed: the setpoint, clipped to C00011, or standstill."""
        if self.inhibited or self.control_word & QUICK_STOP:
            return 0.0
        share = ((self.setpoint & 0xFFFF ^ 0x8000) - 0x8000) / HUNDRED_PERCENT
        return self._codes().reference_rpm * max(-1.0, min(1.0, share))

    def _ramp(self, dt_s: float) -> None:
        codes = self._codes()
        up_s, down_s, quick_s = (time_ms / 1000 for time_ms in codes.ramp_ms)
        if self.inhibited:
            down_s = COAST_S
        elif self.control_word & QUICK_STOP:
            down_s = quick_s
        target = self._target_rpm()
        self.speed_rpm = step(self.speed_rpm, target, up_s, down_s, codes.reference_rpm, dt_s)


def _word(share: float) -> int:
    """A share of the reference speed as a word: 1.0 is 4000h, limited to ±200 %."""
    return max(-0x8000, min(0x7FFF, round(share * HUNDRED_PERCENT))) & 0xFFFF
