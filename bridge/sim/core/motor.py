"""Motor of a simulated drive that positions: position, speed, ramps. Increments and seconds."""

from __future__ import annotations

import math
from typing import Final

from bridge.sim.core.ramp import step

COAST_S: Final = 1.0
"""Run-down from full speed without voltage."""
_STILL: Final = 1.0
"""Fewer increments per second than this count as standstill."""
_WRAP: Final = 1 << 32


class Motor:
    """``position`` wraps at the ends of an INTEGER32, as 6064h does."""

    def __init__(self, max_speed: float) -> None:
        self.max_speed = max_speed
        self.position = 0.0
        self.velocity = 0.0

    @property
    def stands_still(self) -> bool:
        return abs(self.velocity) < _STILL

    def coast(self, dt_s: float) -> None:
        self.ramp_to(0.0, 0.0, self.max_speed / COAST_S, dt_s)

    def ramp_to(self, velocity: float, acceleration: float, deceleration: float, dt_s: float) -> None:
        """Go to this speed; a ramp of 0 is a jump."""
        before = self.velocity
        self._accelerate(velocity, acceleration, deceleration, dt_s)
        if velocity == 0 and self.stands_still:
            self.velocity = 0.0
        self.move((before + self.velocity) / 2 * dt_s)

    def go_to(self, goal: float, speed: float, acceleration: float, deceleration: float, dt_s: float) -> bool:
        """Go to this position and stop there. True once it has."""
        distance = goal - self.position
        braking = max(deceleration, 1.0)
        if abs(distance) < 1.0 and abs(self.velocity) <= braking * dt_s + _STILL:
            self.position, self.velocity = goal, 0.0
            return True
        # As fast as still allows a stop at the target, rather one step early than late.
        fastest = math.sqrt(2 * braking * abs(distance)) - braking * dt_s / 2
        wanted = math.copysign(max(1.0, min(speed, fastest)), distance)
        before = self.velocity
        self._accelerate(wanted, acceleration, 2 * braking, dt_s)
        way = (before + self.velocity) / 2 * dt_s
        if (
            way * distance > 0
            and abs(way) >= abs(distance)
            and abs(self.velocity) <= 4 * braking * dt_s + _STILL
        ):
            self.position, self.velocity = goal, 0.0
            return True
        self.move(way)
        return False

    def _accelerate(self, velocity: float, acceleration: float, deceleration: float, dt_s: float) -> None:
        up_s, down_s = (1 / ramp if ramp > 0 else 0.0 for ramp in (acceleration, deceleration))
        self.velocity = step(self.velocity, velocity, up_s, down_s, 1.0, dt_s)

    def move(self, way: float) -> None:
        self.position += way
        if not -0x8000_0000 <= self.position <= 0x7FFF_FFFF:
            self.position = (self.position + 0x8000_0000) % _WRAP - 0x8000_0000
