"""Modes of operation: use of set-points and of the bits in the control word (CiA 402).

A mode runs while the drive is enabled and not being stopped, and gives bits 10 … 13 of the status word.
``leave`` ends its action.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, Protocol

from bridge.sim.cia402.cia402_settings import INCREMENTS, Cia402Settings
from bridge.sim.core.motor import Motor

BIT_4: Final = 0x0010
BIT_5: Final = 0x0020
BIT_6: Final = 0x0040
TARGET_REACHED: Final = 0x0400
INTERNAL_LIMIT: Final = 0x0800
BIT_12: Final = 0x1000
BIT_13: Final = 0x2000


class Targets:
    """The set-point objects."""

    def __init__(self) -> None:
        self.vl_velocity = 0
        """6042h, 1/min."""
        self.position = 0
        """607Ah."""
        self.velocity = 0
        """60FFh."""


class OperationMode(Protocol):
    def on_control_word(self, word: int, rising: int) -> None:
        """A control word came while the drive is enabled."""
        ...

    def advance(self, dt_s: float) -> None: ...

    def leave(self) -> None: ...

    @property
    def bits(self) -> int: ...

    @property
    def demand(self) -> float:
        """The speed to go to, in increments per second."""
        ...


class Parts:
    """Parts that all modes share."""

    def __init__(self, motor: Motor, settings: Callable[[], Cia402Settings], targets: Targets) -> None:
        self.motor = motor
        self._settings = settings
        self.targets = targets
        self._word = 0

    @property
    def settings(self) -> Cia402Settings:
        return self._settings()

    def on_control_word(self, word: int, rising: int) -> None:
        del rising
        self._word = word

    def leave(self) -> None:
        self._word = 0


class Velocity(Parts):
    """vl: 6042h in 1/min by 604Ch, 6046h, 6048h, 6049h."""

    @property
    def _limited(self) -> float:
        """The target, in the drive's own numbers, within 6046h."""
        least, most = self.settings.vl_limits
        target = self.targets.vl_velocity if self._word & BIT_6 and self._word & BIT_4 else 0
        if not target:
            return 0.0
        size = min(max(abs(target), least), most)
        return float(size if target > 0 else -size)

    @property
    def demand(self) -> float:
        return self._limited * self.settings.vl_factor * INCREMENTS / 60

    def advance(self, dt_s: float) -> None:
        if self._word & BIT_4 and not self._word & BIT_5:  # the ramp is locked
            self.motor.ramp_to(self.motor.velocity, 0.0, 0.0, dt_s)
            return
        up, down = (slope(pair) for pair in (self.settings.vl_acceleration, self.settings.vl_deceleration))
        self.motor.ramp_to(self.demand, up, down, dt_s)

    @property
    def bits(self) -> int:
        asked = self.targets.vl_velocity if self._word & BIT_6 and self._word & BIT_4 else 0
        bits = INTERNAL_LIMIT if asked != self._limited else 0
        return bits | (TARGET_REACHED if abs(self.motor.velocity - self.demand) < 1 else 0)


class ProfileVelocity(Parts):
    """pv: 60FFh, limited by 607Fh and 6080h, with 6083h and 6084h."""

    @property
    def demand(self) -> float:
        most = min(float(self.settings.max_profile_velocity), self.settings.max_speed)
        return min(max(float(self.targets.velocity), -most), most)

    def advance(self, dt_s: float) -> None:
        self.motor.ramp_to(self.demand, self.settings.acceleration, self.settings.deceleration, dt_s)

    @property
    def bits(self) -> int:
        settings, velocity = self.settings, self.motor.velocity
        bits = INTERNAL_LIMIT if self.demand != self.targets.velocity else 0
        bits |= TARGET_REACHED if abs(velocity - self.demand) <= settings.velocity_window else 0
        return bits | (BIT_12 if abs(velocity) <= settings.velocity_threshold else 0)


class ProfilePosition(Parts):
    """pp: a new set-point with each edge of bit 4, of which one may wait; bit 5: take it at once; bit 6:
    relative."""

    def __init__(self, motor: Motor, settings: Callable[[], Cia402Settings], targets: Targets) -> None:
        super().__init__(motor, settings, targets)
        self.goal: float | None = None
        self._waiting: float | None = None
        self._acknowledged = False
        self._is_limited = False
        self._reached = True

    def on_control_word(self, word: int, rising: int) -> None:
        super().on_control_word(word, rising)
        if rising & BIT_4:
            self._new_setpoint(word)
        self._answer()

    def _new_setpoint(self, word: int) -> None:
        if self._waiting is not None and not word & BIT_5:
            return  # no room for another: bit 12 stays 1
        base = self.motor.position if self.goal is None else self.goal
        goal = self._within(self.targets.position + (base if word & BIT_6 else 0))
        if word & BIT_5 or self.goal is None or self._reached:
            self.goal, self._waiting, self._reached = goal, None, False
        else:
            self._waiting = goal
        self._acknowledged = True

    def _answer(self) -> None:
        """Bit 12 falls with bit 4, but not before a waiting set-point has begun."""
        if not self._word & BIT_4 and self._waiting is None:
            self._acknowledged = False

    def _within(self, position: float) -> float:
        low, high = self.settings.position_limits
        inside = min(max(position, low), high) if low < high else position
        self._is_limited = inside != position
        return min(max(inside, -0x8000_0000), 0x7FFF_FFFF)

    @property
    def demand(self) -> float:
        return self.motor.velocity

    def advance(self, dt_s: float) -> None:
        settings = self.settings
        if self.goal is None:
            self.motor.ramp_to(0.0, 0.0, settings.deceleration, dt_s)
            return
        speed = min(float(settings.profile_velocity), settings.max_profile_velocity, settings.max_speed)
        self._reached = self.motor.go_to(self.goal, speed, settings.acceleration, settings.deceleration, dt_s)
        if self._reached and self._waiting is not None:
            self.goal, self._waiting, self._reached = self._waiting, None, False
            self._answer()

    def leave(self) -> None:
        super().leave()
        self.goal = self._waiting = None
        self._acknowledged = self._is_limited = False
        self._reached = True

    @property
    def bits(self) -> int:
        bits = INTERNAL_LIMIT if self._is_limited else 0
        bits |= BIT_12 if self._acknowledged else 0
        return bits | (TARGET_REACHED if self._reached else 0)


class CyclicPosition(Parts):
    """csp: a new 607Ah with each SYNC; in between, the speed that reaches it within the time in 60C2h."""

    def __init__(self, motor: Motor, settings: Callable[[], Cia402Settings], targets: Targets) -> None:
        super().__init__(motor, settings, targets)
        self._late_s = 0.0
        self._speed = 0.0

    @property
    def following_error(self) -> bool:
        """Whether the target was outside 6065h for longer than 6066h."""
        return self._late_s * 1000 > self.settings.following_ms

    @property
    def demand(self) -> float:
        return self.motor.velocity

    def on_target(self) -> None:
        """607Ah was written."""
        units, power = self.settings.interpolation
        period_s = max(units * 10.0**power, 1e-3)
        distance = abs(self.targets.position - self.motor.position)
        self._speed = min(distance / period_s, self.settings.max_speed)

    def advance(self, dt_s: float) -> None:
        motor, distance = self.motor, self.targets.position - self.motor.position
        way = min(abs(distance), self._speed * dt_s)
        motor.velocity = 0.0 if way == 0 else (self._speed if distance > 0 else -self._speed)
        motor.move(way if distance > 0 else -way)
        is_late = abs(self.targets.position - motor.position) > self.settings.following_window
        self._late_s = self._late_s + dt_s if is_late else 0.0

    def leave(self) -> None:
        super().leave()
        self._late_s = self._speed = 0.0

    @property
    def bits(self) -> int:
        return BIT_12 | (BIT_13 if self._late_s else 0)


class CyclicVelocity(Parts):
    """csv: a new 60FFh with each SYNC, without ramps."""

    @property
    def demand(self) -> float:
        most = self.settings.max_speed
        return min(max(float(self.targets.velocity), -most), most)

    def advance(self, dt_s: float) -> None:
        self.motor.ramp_to(self.demand, 0.0, 0.0, dt_s)

    @property
    def bits(self) -> int:
        return BIT_12 | (INTERNAL_LIMIT if self.demand != self.targets.velocity else 0)


class NoMode(Parts):
    """No mode assigned: the motor stands still."""

    @property
    def demand(self) -> float:
        return 0.0

    def advance(self, dt_s: float) -> None:
        self.motor.ramp_to(0.0, 0.0, self.settings.deceleration, dt_s)

    @property
    def bits(self) -> int:
        return 0


def slope(pair: list[int]) -> float:
    """A ramp of the vl mode, 1/min in s, in increments per second squared; 0 is a jump."""
    speed, time_s = pair
    return speed * INCREMENTS / 60 / time_s if time_s else 0.0
