"""Linear ramp between two speeds, in whatever unit."""

from __future__ import annotations

from typing import Final

SNAP_HZ: Final = 1e-9
"""Closer than this, the target counts as reached: sums of floats are never exact."""


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
