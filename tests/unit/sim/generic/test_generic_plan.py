"""The plan of a simulated node, as delivered."""

from __future__ import annotations

from bridge.sim.core.communication_objects import DeviceIdentity
from bridge.sim.core.communication_settings import CobId
from bridge.sim.core.dictionary import IntegerType
from bridge.sim.generic.generic_plan import LEAST_ENTRIES, BytesPlan, Copy, GenericPdo, NodePlan, NumberPlan

IDENTITY = DeviceIdentity(0, 1, 2, 3, 4, "x", "1", "1")


def plan() -> NodePlan:
    objects = (NumberPlan((0x6083, 0), IntegerType.UNSIGNED32, 7), BytesPlan((0x1008, 0), b"x"))
    rpdo = (GenericPdo(3, CobId(0x405), (0x6040_0010,)),)
    return NodePlan(IDENTITY, objects, rpdo)


def test_commissioned_it_has_other_numbers_and_the_rest_is_the_same() -> None:
    made = plan().with_numbers({(0x6083, 0): 9, (0x1008, 0): 5})
    assert made.objects == (NumberPlan((0x6083, 0), IntegerType.UNSIGNED32, 9), BytesPlan((0x1008, 0), b"x"))
    assert plan().objects[0].value == 7


def test_the_pdos_between_are_there_and_off() -> None:
    made = plan().communication(5)
    assert [(pdo.cob_id, pdo.enabled) for pdo in made.rpdo] == [(0x205, False), (0x305, False), (0x405, True)]
    assert (made.rpdo[2].mapping, len(made.rpdo[2].entries)) == ([0x6040_0010], LEAST_ENTRIES)
    assert (made.tpdo, made.emcy.cob_id, made.sdo[0].send.cob_id) == ([], 0x85, 0x585)


def test_a_copy_of_another_axis_lies_800h_further() -> None:
    made = Copy((0x6040, 0), (0x6041, 0), stays=True)
    assert made.on_axis(2) == Copy((0x6840, 0), (0x6841, 0), stays=True)
    assert made.on_axis(1) == made
