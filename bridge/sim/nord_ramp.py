"""Ramp generator of a NORD inverter (P102, P103, P426), and its shaft's position (BU 2500 §6.5.4)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

SNAP_HZ: Final = 1e-9
"""Closer than this, the target counts as reached: sums of floats are never exact."""
POLE_PAIRS: Final = 2
"""A motor of four poles, as in §5.4."""
INCREMENTS: Final = 1000
"""Increments of a position per revolution (§6.5.4)."""


@dataclass(frozen=True, slots=True)
class Demand:
    """What an interface demands in the drive profile (§6.7.3), in place of the drive's setpoints and ramps.
    The times are those between 0 and P105; None is P102 or P103."""

    target_hz: float
    accelerate_s: float | None
    decelerate_s: float | None


def step(value_hz: float, target_hz: float, up_s: float, down_s: float, max_hz: float, dt_s: float) -> float:
    """The frequency ``dt_s`` after ``value_hz`` on the way to ``target_hz``.

    ``up_s`` and ``down_s`` are the times between 0 and ``max_hz`` (P105); 0 means a jump. Through zero the
    drive first brakes with ``down_s``, then accelerates with ``up_s``.
    """
    if value_hz * target_hz < 0:
        zero_after_s = abs(value_hz) * down_s / max_hz
        if zero_after_s > dt_s:
            return _toward(value_hz, 0.0, down_s, max_hz, dt_s)
        value_hz, dt_s = 0.0, dt_s - zero_after_s
    time_s = up_s if abs(target_hz) > abs(value_hz) else down_s
    return _toward(value_hz, target_hz, time_s, max_hz, dt_s)


def _toward(value_hz: float, target_hz: float, time_s: float, max_hz: float, dt_s: float) -> float:
    distance_hz = target_hz - value_hz
    if time_s <= 0:
        return target_hz
    move_hz = max_hz / time_s * dt_s
    if abs(distance_hz) <= move_hz + SNAP_HZ:
        return target_hz
    return value_hz + (move_hz if distance_hz > 0 else -move_hz)


def turned(increments: float, from_hz: float, to_hz: float, dt_s: float) -> float:
    """The position in increments ``dt_s`` later, between two frequencies of the field. It wraps at 32
    bits."""
    increments += (from_hz + to_hz) / 2 / POLE_PAIRS * dt_s * INCREMENTS
    return (increments + 0x8000_0000) % 0x1_0000_0000 - 0x8000_0000
