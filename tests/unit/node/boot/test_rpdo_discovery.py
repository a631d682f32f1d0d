"""Where a node that may be running listens: its RPDOs as they are, or as the mapping file has them."""

from __future__ import annotations

import pytest

from bridge.canopen.pdo import PdoEntry
from bridge.canopen.sdo import SdoError
from bridge.node.boot.actions import BootResult
from bridge.node.boot.rpdo_discovery import find_rpdos, rpdo_plan
from bridge.node.places.word_map import WordPlace
from tests.support import sites
from tests.support.answering import Answering
from tests.support.nodes import node_of

CIA402 = "cia402/velocity"


def number(value: int) -> bytes:
    return value.to_bytes(4, "little")


def listening(objects: dict[tuple[int, int], bytes], mapping: str = CIA402) -> BootResult:
    node = node_of(sites.drive(slot_of(mapping), "lease", 200, ""), mapping=mapping)
    result = BootResult()
    Answering(objects).run(find_rpdos(node, result))
    return result


def slot_of(mapping: str) -> str:
    return sites.family(mapping).slot[0].name


def plans(result: BootResult, mapping: str = CIA402):
    return list(result.memory.rpdos_of(f"conveyor/{slot_of(mapping)}"))


MAPPED = {
    (0x1400, 1): number(0x285),
    (0x1400, 2): b"\1",
    (0x1600, 0): b"\2",
    (0x1600, 1): number(0x6042_0010),
    (0x1600, 2): number(0x6040_0010),
}


def test_an_rpdo_is_noted_as_the_node_has_it() -> None:
    (plan,) = plans(listening(MAPPED))
    assert (plan.cob_id, plan.transmission_type) == (0x285, 1)
    assert plan.places == (WordPlace(1), WordPlace(0)), "speed before the control word"


def test_one_that_cannot_be_read_listens_to_nothing() -> None:
    assert plans(listening({})) == []


@pytest.mark.parametrize("cob_id", [0x8000_0285, 0x2000_0285, 0x085, 0x605])
def test_one_that_is_off_or_on_no_identifier_for_pdos_is_left_out(cob_id: int) -> None:
    """CiA 301 §7.5.2.35: bit 31 is "not valid", bit 29 "29 bits"; 085h and 605h are EMCY and SDO."""
    assert plans(listening({**MAPPED, (0x1400, 1): number(cob_id)})) == []


def test_a_mapping_that_cannot_be_read_is_that_of_the_mapping_file() -> None:
    (plan,) = plans(listening({(0x1400, 1): number(0x205)}))
    assert plan.transmission_type == 255
    assert 0 in plan.words


def test_a_node_that_is_silent_is_not_waited_for() -> None:
    node, result = Answering(MAPPED), BootResult()
    node.silent = {(0x1400, 1)}
    with pytest.raises(SdoError):
        node.run(find_rpdos(node_of(sites.drive(slot_of(CIA402), "lease", 200, ""), mapping=CIA402), result))


def test_a_mapping_that_fits_into_no_frame_is_that_of_the_mapping_file() -> None:
    family = sites.family(CIA402)
    (slot, *_) = family.slot
    long = [PdoEntry(0x6040, 0, 64), PdoEntry(0x6042, 0, 64)]
    plan = rpdo_plan(family, slot, slot.rpdo[0], 0x205, long)
    assert plan.codec.entries == rpdo_plan(family, slot, slot.rpdo[0], 0x205).codec.entries
    assert len(plan.codec.entries) == len(plan.places)
