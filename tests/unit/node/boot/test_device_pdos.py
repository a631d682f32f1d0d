"""PDOs of a device that is no drive: those that carry its inputs and outputs, and why others do not."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.command.node import Node
from bridge.mapping.entry_types import ObjectRef
from bridge.node.boot.actions import BootResult, SignalPlan
from bridge.node.boot.device_pdos import plan_device
from bridge.text import render
from tests.support.answering import Answering
from tests.support.devices import ENCODER, IO_BLOCK, OUTPUTS
from tests.support.nodes import device_plant

POSITION, SPEED, ALARMS = ObjectRef(0x6004, 0), ObjectRef(0x6030, 1), ObjectRef(0x6503, 0)


def number(value: int, size: int = 4) -> bytes:
    return value.to_bytes(size, "little")


def pdo(parameter: int, cob_id: int, *entries: int, kind: int = 255, event_ms: int = 0):
    mapping = parameter + 0x200
    return {
        (parameter, 1): number(cob_id),
        (parameter, 2): number(kind, 1),
        (parameter, 5): number(event_ms, 2),
        (mapping, 0): number(len(entries), 1),
        **{(mapping, sub): number(entry) for sub, entry in enumerate(entries, 1)},
    }


@pytest.fixture
def encoder(tmp_path: Path) -> Node:
    return device_plant(tmp_path, ENCODER).nodes["shaft"]


def planned(node: Node, objects: dict[tuple[int, int], bytes]) -> BootResult:
    result = BootResult()
    result.devices["shaft"] = Answering(objects).run(plan_device(node, result))
    return result


def tpdos(result: BootResult) -> SignalPlan:
    return result.devices["shaft"].tpdos


def rpdos(result: BootResult) -> SignalPlan:
    return result.devices["shaft"].rpdos


def test_a_tpdo_that_carries_an_input_is_used_with_its_times(encoder: Node) -> None:
    result = planned(encoder, pdo(0x1800, 0x194, 0x6004_0020, event_ms=100))
    (plan,) = tpdos(result).pdos
    assert (plan.name, plan.cob_id, plan.transmission_type, plan.event_timer_ms) == ("TPDO1", 0x194, 255, 100)
    assert plan.codec.unpack(number(0xFFFF_FFFE)) == [-2] or list(plan.codec.unpack(number(0xFFFF_FFFE))) == [
        -2
    ]


def test_inputs_that_none_carries_have_their_reason(encoder: Node) -> None:
    result = planned(encoder, pdo(0x1800, 0x194, 0x6004_0020))
    assert {ref: render(why) for ref, why in tpdos(result).unserved.items()} == {
        SPEED: "no TPDO of the node carries 6030:01",
        ALARMS: "no TPDO of the node carries 6503:00",
    }
    assert "no TPDO of the node carries 6030:01" in map(render, result.notes)


def test_one_that_is_off_is_the_reason_for_what_it_would_carry(encoder: Node) -> None:
    result = planned(encoder, pdo(0x1800, 0x8000_0194, 0x6004_0020))
    assert render(tpdos(result).unserved[POSITION]) == "TPDO1 is switched off in the node"


def test_what_another_carries_is_served_all_the_same(encoder: Node) -> None:
    objects = {**pdo(0x1800, 0x8000_0194, 0x6004_0020), **pdo(0x1801, 0x294, 0x6004_0020)}
    result = planned(encoder, objects)
    assert POSITION not in tpdos(result).unserved
    assert [plan.name for plan in tpdos(result).pdos] == ["TPDO2"]


def test_what_nothing_describes_is_noted_and_a_synchronous_one_has_no_timer(encoder: Node) -> None:
    result = planned(encoder, pdo(0x1800, 0x194, 0x6004_0020, 0x2345_0108, kind=1, event_ms=100))
    assert "TPDO1 carries 2345:01, which nothing here describes" in map(render, result.notes)
    assert (
        tpdos(result).pdos[0].transmission_type,
        tpdos(result).pdos[0].event_timer_ms,
    ) == (1, 0)


def test_an_identifier_that_is_not_for_pdos_is_used_for_none(encoder: Node) -> None:
    result = planned(encoder, pdo(0x1800, 0x594, 0x6004_0020))
    assert "1800h:01 is 00000594h: no identifier for a PDO" in map(render, result.notes)
    assert tpdos(result).pdos == []


def test_a_mapping_that_fits_into_no_frame_is_told(encoder: Node) -> None:
    result = planned(encoder, pdo(0x1800, 0x194, 0x6004_0020, 0x6004_0020, 0x6004_0020))
    assert any(render(note).startswith("TPDO1 is not used: ") for note in result.notes)


@pytest.mark.parametrize(("place", "is_found"), [(4, True), (5, False)])
def test_pdos_are_looked_for_until_four_in_a_row_are_missing(
    encoder: Node, place: int, is_found: bool
) -> None:
    objects = {**pdo(0x1800, 0x194, 0x6503_0010), **pdo(0x1800 + place, 0x294, 0x6004_0020)}
    result = planned(encoder, objects)
    assert (POSITION not in tpdos(result).unserved) is is_found


def test_outputs_have_rpdos_and_what_else_those_carry_gets_0(tmp_path: Path) -> None:
    block = device_plant(tmp_path, IO_BLOCK, OUTPUTS).nodes["shaft"]
    result = planned(block, pdo(0x1400, 0x214, 0x6200_0108, 0x2345_0108))
    assert [plan.name for plan in rpdos(result).pdos] == ["RPDO1"]
    assert "RPDO1 carries 2345:01, too, which get 0" in map(render, result.notes)
    assert render(rpdos(result).unserved[ObjectRef(0x6411, 1)]) == "no RPDO of the node carries 6411:01"


def test_a_device_without_outputs_has_an_empty_plan_for_them(encoder: Node) -> None:
    plan = rpdos(planned(encoder, {}))
    assert (plan.pdos, plan.unserved) == ([], {})
