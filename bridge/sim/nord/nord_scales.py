"""Meaning of a NORD inverter's process data by its parameters, and the aim that they give it (BU 2500
§6.5)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from bridge.sim.nord.nord_parameters import NordParameters
from bridge.sim.nord.nord_posicon import LOW_WORD, PositionControl, stretch, target
from bridge.sim.nord.nord_ramp import Demand

SET_POINTS: Final = 5
HUNDRED_PERCENT: Final = 0x4000
LEFT: Final = 1 << 12
BUS_SOURCES: Final = (3, 6)
"""P509: system bus, CANopen (§7.2)."""
_SET_FREQUENCY: Final = 1
"""P546."""
_POSITION: Final = (10, 15)
"""P543: low and high word."""


@dataclass(frozen=True, slots=True)
class Scales:
    """Parameters of the active set that process data depend on. ``setpoints`` and ``actual_values`` are the
    codes of P546 and P543."""

    max_hz: float
    rated_a: float
    bus_controls: bool
    setpoints: tuple[int, ...]
    actual_values: tuple[int, ...]
    position_control: int
    shows_position: bool
    stretch: float
    """Increments to one step of a position's words."""

    @staticmethod
    def of(parameters: NordParameters, in_set: int) -> Scales:
        numbers = range(1, SET_POINTS + 1)
        actual_values = tuple(parameters.meaning(543, number, in_set) for number in numbers)
        return Scales(
            parameters.value(105, in_set),
            parameters.value(112, in_set),
            parameters.raw(509) in BUS_SOURCES,
            tuple(parameters.meaning(546, number, in_set) for number in numbers),
            actual_values,
            parameters.raw(600, 1, in_set),
            any(code in _POSITION for code in actual_values),
            stretch(parameters),
        )

    def share(self, setpoints: Sequence[int]) -> float:
        """The setpoints that are frequencies, together: 1.0 is P105."""
        share = sum(
            ((word & 0xFFFF ^ 0x8000) - 0x8000) / HUNDRED_PERCENT
            for word, code in zip(setpoints, self.setpoints, strict=True)
            if code == _SET_FREQUENCY
        )
        return max(-1.0, min(1.0, share))


@dataclass(frozen=True, slots=True)
class Aim:
    """Aim of a drive: ``hz`` is the set frequency, signed (positive turns right), ``increments`` the
    set position where it positions, and ``most_hz`` the greatest speed at which it may go there."""

    scales: Scales
    hz: float
    increments: int | None
    most_hz: float

    @staticmethod
    def of(scales: Scales, control_word: int, setpoints: Sequence[int], demand: Demand | None) -> Aim:
        """Bit 12 inverts the frequency, bit 11 changes nothing (§6.5.1 note 3: bit 12 = 0 means right); it
        is clipped to P105. In the drive profile nothing is positioned."""
        most_hz = scales.max_hz
        if demand:
            return Aim(scales, max(-most_hz, min(most_hz, demand.target_hz)), None, most_hz)
        share = scales.share(setpoints)
        hz = most_hz * (-share if control_word & LEFT else share)
        if scales.position_control == PositionControl.OFF or LOW_WORD not in scales.setpoints:
            return Aim(scales, hz, None, most_hz)
        increments = target(setpoints, lambda number: scales.setpoints[number - 1], scales.stretch)
        if scales.position_control != PositionControl.AT_P105:
            most_hz *= abs(share)
        return Aim(scales, hz, increments, most_hz)
