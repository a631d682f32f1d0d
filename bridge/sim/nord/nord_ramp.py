"""Demands on the ramp of a NORD inverter, and its shaft's position (BU 2500 §6.5.4)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

POLE_PAIRS: Final = 2
"""A motor of four poles, as in §5.4."""
INCREMENTS: Final = 1000
"""Increments of a position per revolution (§6.5.4)."""


@dataclass(frozen=True, slots=True)
class Demand:
    """Demand of an interface in the drive profile (§6.7.3), in place of the drive's setpoints and ramps. The
    times are those between 0 and P105; None is P102 or P103."""

    target_hz: float
    accelerate_s: float | None
    decelerate_s: float | None


def turned(increments: float, from_hz: float, to_hz: float, dt_s: float) -> float:
    """The position in increments ``dt_s`` later, between two frequencies of the field. It wraps at 32
    bits."""
    increments += (from_hz + to_hz) / 2 / POLE_PAIRS * dt_s * INCREMENTS
    return (increments + 0x8000_0000) % 0x1_0000_0000 - 0x8000_0000
