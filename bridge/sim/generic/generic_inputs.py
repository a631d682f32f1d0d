"""Inputs of a simulated node that move by themselves, so that there is something to be seen.

What moves is known by the profile's indices: digital and analogue inputs of CiA 401, position and speed of
CiA 406. Everything else stays where it is.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final

from bridge.sim.core.dictionary import IntegerType
from bridge.sim.generic.generic_plan import At, NodePlan, NumberPlan

TICK_S: Final = 0.1
_DIGITAL: Final = {0x6000: 1, 0x6100: 2, 0x6120: 4}
"""Inputs in groups of 8, 16 and 32 (CiA 401), with their bytes."""
_ANALOGUE: Final = {0x6400: 1, 0x6401: 2, 0x6402: 4}
_POSITION: Final = (0x6004, 0)
_SPEED: Final = (0x6030, 1)
_RANGE: Final = (0x6002, 0)
"""Total measuring range of an encoder, in steps."""
_STEPS_PER_TICK: Final = 100
_TICKS_PER_BIT: Final = 5
_RAMP_TICKS: Final = 100
"""An analogue input goes up as long, and down again."""
_APART_TICKS: Final = 30
"""Ticks by which one of several is ahead of the one before it."""


@dataclass(frozen=True, slots=True)
class Walk:
    """One bit after the other is on: of all elements of an array together."""

    places: tuple[tuple[At, int], ...]
    """Each element and its bits."""

    def values(self, tick: int) -> Iterator[tuple[At, int]]:
        bit = tick // _TICKS_PER_BIT % sum(bits for _, bits in self.places)
        for at, bits in self.places:
            yield at, 1 << bit if 0 <= bit < bits else 0
            bit -= bits


@dataclass(frozen=True, slots=True)
class TriangleWave:
    """Up from ``low`` to ``high`` and down again."""

    at: At
    low: int
    high: int

    def values(self, tick: int) -> Iterator[tuple[At, int]]:
        place = (tick + _APART_TICKS * self.at[1]) % (2 * _RAMP_TICKS)
        up = min(place, 2 * _RAMP_TICKS - place)
        yield self.at, self.low + (self.high - self.low) * up // _RAMP_TICKS


@dataclass(frozen=True, slots=True)
class RotatingShaft:
    """A shaft that turns steadily: its position within ``steps``, and its speed in steps per second, where
    the node has that."""

    steps: int
    has_speed: bool

    def values(self, tick: int) -> Iterator[tuple[At, int]]:
        yield _POSITION, tick * _STEPS_PER_TICK % self.steps
        if self.has_speed:
            yield _SPEED, round(_STEPS_PER_TICK / TICK_S)


Motion = Walk | TriangleWave | RotatingShaft


def motions_of(plan: NodePlan) -> tuple[Motion, ...]:
    """Motions of the inputs of this node; empty for a drive, whose values are its own."""
    if plan.axes:
        return ()
    numbers = {
        one.at: one
        for one in plan.objects
        if isinstance(one, NumberPlan) and one.in_tpdo and not one.writable
    }
    return (*_walks(numbers), *_ramps(numbers), *_turn(plan, numbers))


def _walks(numbers: Mapping[At, NumberPlan]) -> Iterator[Walk]:
    for index, size in _DIGITAL.items():
        elements = sorted(at for at, one in numbers.items() if at[0] == index and one.data_type.size == size)
        if elements:
            yield Walk(tuple((at, 8 * size) for at in elements))


def _ramps(numbers: Mapping[At, NumberPlan]) -> Iterator[TriangleWave]:
    for at, one in numbers.items():
        if _ANALOGUE.get(at[0]) == one.data_type.size:
            low, high = one.low or 0, (1 << 8 * one.data_type.size - 1) - 1
            yield TriangleWave(at, low, high if one.high is None else one.high)


def _turn(plan: NodePlan, numbers: Mapping[At, NumberPlan]) -> Iterator[RotatingShaft]:
    position, speed = numbers.get(_POSITION), numbers.get(_SPEED)
    if position is None or position.data_type not in (IntegerType.UNSIGNED32, IntegerType.INTEGER32):
        return
    steps = next((one.value for one in plan.objects if isinstance(one, NumberPlan) and one.at == _RANGE), 0)
    yield RotatingShaft(
        min(steps, 1 << 31) or 1 << 31,
        speed is not None and speed.data_type in (IntegerType.INTEGER16, IntegerType.INTEGER32),
    )
