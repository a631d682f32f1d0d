"""What the parameters of a NORD inverter's active set make of its process data."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from bridge.sim.nord.nord_parameters import NordParameters
from bridge.sim.nord.nord_posicon import LOW_WORD, PositionControl

SET_POINTS: Final = 5
BUS_SOURCES: Final = (3, 6)
"""P509: system bus, CANopen (§7.2)."""
_POSITION: Final = (10, 15)
"""P543: low and high word."""


@dataclass(frozen=True, slots=True)
class Scales:
    """They hold until a parameter changes, or the active set. ``setpoints`` and ``actual_values`` are the
    codes of P546 and P543."""

    max_hz: float
    rated_a: float
    bus_controls: bool
    setpoints: tuple[int, ...]
    actual_values: tuple[int, ...]
    position_control: int
    positions: bool
    """A setpoint is a position, and it is followed."""
    shows_position: bool

    @staticmethod
    def of(parameters: NordParameters, in_set: int, *, is_profile: bool) -> Scales:
        """In the drive profile (``is_profile``) nothing is positioned."""
        numbers = range(1, SET_POINTS + 1)
        setpoints = tuple(parameters.meaning(546, number, in_set) for number in numbers)
        actual_values = tuple(parameters.meaning(543, number, in_set) for number in numbers)
        control = parameters.raw(600, 1, in_set)
        is_followed = not is_profile and control != PositionControl.OFF
        return Scales(
            parameters.value(105, in_set),
            parameters.value(112, in_set),
            parameters.raw(509) in BUS_SOURCES,
            setpoints,
            actual_values,
            control,
            positions=is_followed and LOW_WORD in setpoints,
            shows_position=any(code in _POSITION for code in actual_values),
        )
