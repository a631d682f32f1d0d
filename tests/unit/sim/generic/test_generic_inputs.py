"""Inputs of a simulated node that move by themselves."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

from bridge.sim.core.communication_objects import DeviceIdentity
from bridge.sim.core.dictionary import IntegerType
from bridge.sim.generic.generic_inputs import RotatingShaft, TriangleWave, Walk, motions_of
from bridge.sim.generic.generic_plan import NodePlan, NumberPlan

IDENTITY = DeviceIdentity(0, 1, 2, 3, 4, "x", "1", "1")


def moved(index: int, sub: int, kind: IntegerType, **more: int) -> NumberPlan:
    return NumberPlan((index, sub), kind, writable=False, in_tpdo=True, **more)


def test_one_bit_after_the_other_is_on_over_all_elements() -> None:
    walk = Walk((((0x6000, 1), 8), ((0x6000, 2), 8)))
    seen = [dict(walk.values(tick)) for tick in range(0, 16 * 5, 5)]
    assert [one[0x6000, 1] | one[0x6000, 2] << 8 for one in seen] == [1 << bit for bit in range(16)]


def test_an_analogue_input_goes_up_and_down_within_its_range() -> None:
    values = [value for tick in range(400) for _, value in TriangleWave((0x6401, 1), -50, 100).values(tick)]
    assert (min(values), max(values)) == (-50, 100)
    assert max(abs(b - a) for a, b in pairwise(values)) <= 2


def test_a_shaft_turns_steadily_within_its_steps() -> None:
    seen = [dict(RotatingShaft(1000, True).values(tick)) for tick in range(12)]
    assert [one[0x6004, 0] for one in seen] == [100 * tick % 1000 for tick in range(12)]
    assert {one[0x6030, 1] for one in seen} == {1000}


def test_what_moves_is_known_by_its_index_and_a_drives_values_are_its_own() -> None:
    objects = (
        moved(0x6000, 1, IntegerType.UNSIGNED8),
        moved(0x6401, 1, IntegerType.INTEGER16, low=0, high=10),
        moved(0x6004, 0, IntegerType.UNSIGNED32),
        NumberPlan((0x6002, 0), IntegerType.UNSIGNED32, 4096),
        moved(0x2000, 1, IntegerType.UNSIGNED8),
        NumberPlan((0x6000, 2), IntegerType.UNSIGNED8, in_tpdo=True),
    )
    plan = NodePlan(IDENTITY, objects)
    assert motions_of(plan) == (
        Walk((((0x6000, 1), 8),)),
        TriangleWave((0x6401, 1), 0, 10),
        RotatingShaft(4096, False),
    )
    assert motions_of(replace(plan, objects=())) == ()
