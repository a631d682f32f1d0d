"""POSICON, the position control of a NORD inverter: ramps to a position and stops there.

BU 2500 has how positions are transferred (§6.5.4), an example with three axes (§5.4) and what bit 8 of the
status word means (§6.5.2). P600, which switches it on, is as those drives are commonly documented. By §6.5.4
the range of what is transferred grows with P607 over P608: these are taken to be elements 3 of both.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from enum import IntEnum
from typing import Final

from bridge.sim.core.motor import Motor
from bridge.sim.nord.nord_parameters import NordParameters
from bridge.sim.nord.nord_ramp import INCREMENTS, POLE_PAIRS

LOW_WORD: Final = 23
HIGH_WORD: Final = 24
"""P546 (§5.4)."""
_MOST: Final = 50_000 * INCREMENTS
"""§6.5.4: −50000.00 … 50000.00 revolutions."""
_PER_HZ: Final = INCREMENTS / POLE_PAIRS
"""Increments per second at a field of 1 Hz."""
_STEP_S: Final = 0.005
_MOST_STEPS: Final = 2000


ACTUAL: Final = (1, 10, 15)
SETPOINTS: Final = (1, LOW_WORD, HIGH_WORD)
"""P543 and P546 of §5.4, step 5: frequency, position in two words."""


class PositionControl(IntEnum):
    """P600."""

    OFF = 0
    AT_P105 = 1
    AT_SETPOINT = 2
    """Speed of the set frequency."""


def commission(parameters: NordParameters) -> None:
    """A drive as in §5.4."""
    for number, codes in ((543, ACTUAL), (546, SETPOINTS)):
        for element, code in enumerate(codes, start=1):
            parameters.commission(number, code, element)
    parameters.commission(600, PositionControl.AT_SETPOINT)


def stretch(parameters: NordParameters) -> float:
    """Increments to one step of the words."""
    return parameters.raw(607, 3) / parameters.raw(608, 3)


def target(words: Sequence[int], meaning: Callable[[int], int], stretched: float = 1.0) -> int | None:
    """The set position in increments; ``meaning`` has the code of a setpoint, from 1. None without the low
    word. The low word alone is signed (§6.5.4)."""
    by_code = {meaning(number): word for number, word in enumerate(words, start=1)}
    low = by_code.get(LOW_WORD)
    if low is None:
        return None
    bits = 32 if HIGH_WORD in by_code else 16
    value = by_code.get(HIGH_WORD, 0) << 16 | low & 0xFFFF
    signed = (value & (1 << bits) - 1 ^ 1 << bits - 1) - (1 << bits - 1)
    return round(max(-_MOST, min(_MOST, signed * stretched)))


def approach(
    increments: float, hz: float, goal: int, most_hz: float, ramps: tuple[float, float], dt_s: float
) -> tuple[float, float]:
    """Position and frequency ``dt_s`` later, on the way to ``goal``. ``ramps`` are Hz per second, up and
    down."""
    motor = Motor(most_hz * _PER_HZ)
    motor.position, motor.velocity = increments, hz * _PER_HZ
    up, down = (ramp * _PER_HZ for ramp in ramps)
    steps = min(_MOST_STEPS, math.ceil(dt_s / _STEP_S))
    for _ in range(steps):
        if not most_hz:
            motor.ramp_to(0.0, 0.0, down, dt_s / steps)
        elif motor.go_to(float(goal), most_hz * _PER_HZ, up, down, dt_s / steps):
            break
    return motor.position, motor.velocity / _PER_HZ
