"""A family as its mapping file has it: its drives, channels, sets, axes, and where its parameters are."""

from __future__ import annotations

import pytest

from bridge.config import DriveTable
from bridge.mapping.model import ObjectRef
from tests.support import sites

NORD = sites.family(sites.FAMILY)
CIA402 = sites.family("cia402/velocity")


def test_drives_are_found_by_the_names_of_their_slots() -> None:
    assert NORD.slot_named("fu2").name == "fu2"
    with pytest.raises(KeyError):
        NORD.slot_named("fu99")
    with pytest.raises(KeyError):
        NORD.parameter_named("P99999")
    assert not NORD.is_device


def test_a_drive_is_called_by_its_name_or_its_slot_or_is_the_only_one() -> None:
    slot = CIA402.slot[0].name
    assert NORD.leaf_of(DriveTable.model_validate({"slot": "fu2"})) == "fu2"
    assert NORD.leaf_of(DriveTable.model_validate({"slot": "fu2", "name": "lift"})) == "lift"
    assert CIA402.leaf_of(DriveTable.model_validate({"slot": slot})) == "drive"


def test_four_parameter_sets_are_two_bits() -> None:
    """BU 2500 §6.5.1."""
    assert NORD.sets == 4
    assert CIA402.sets == 1


def test_a_drive_is_reached_over_the_first_channel_or_one_that_was_opened() -> None:
    """BU 2500 §6.4."""
    first, second = NORD.slot_named("fu1"), NORD.slot_named("fu2")
    assert NORD.sdo_channel(first, ()) == 1
    assert NORD.sdo_channel(second, ()) is None
    number = next(server.number for server in NORD.sdo if server.slot == "fu2")
    assert NORD.sdo_channel(second, (9, number)) == number
    assert NORD.is_on_first(first)
    assert NORD.is_on_first(None)
    assert not NORD.is_on_first(second)


def test_an_object_of_another_axis_stands_800h_further() -> None:
    """CiA 301 §7.4.1."""
    second = CIA402.of_axis(2)
    assert CIA402.place(ObjectRef(0x6040, 0)) == ObjectRef(0x6040, 0)
    assert second.place(ObjectRef(0x6040, 1)) == ObjectRef(0x6840, 1)
    assert second.place(ObjectRef(0x2000, 1)) == ObjectRef(0x2000, 1), "the maker's own are of the node"
    assert second.of_axis(2) is second
    assert CIA402.place(ObjectRef(0x6040, 0)) == ObjectRef(0x6040, 0), "the family itself is as it was"


def test_with_one_axis_nothing_is_per_axis() -> None:
    assert not CIA402.is_per_axis(ObjectRef(0x6040, 0))
    slots = [slot.model_copy(update={"axis": 2}) for slot in CIA402.slot]
    two = CIA402.model_copy(update={"slot": [*CIA402.slot, *slots]})
    assert two.is_per_axis(ObjectRef(0x6040, 0))
    assert not two.is_per_axis(ObjectRef(0x2000, 0))


def test_a_drive_has_the_words_that_its_pdos_carry_and_their_values() -> None:
    slot = NORD.slot_named("fu1")
    rpdo, tpdo = NORD.carried(slot)
    assert rpdo == [word for word in NORD.process.rpdo if word in rpdo]
    assert rpdo[0] == "control_word"
    assert tpdo[0] == "status_word"
    less = slot.model_copy(
        update={"rpdo": [pdo.model_copy(update={"words": ["control_word"]}) for pdo in slot.rpdo[:1]]}
    )
    assert NORD.carried(less)[0] == ["control_word"]
    assert {one.group for one in NORD.values_of(less)} <= {"actual"}


def test_a_parameter_is_an_object_and_in_another_set_the_next_element() -> None:
    """BU 2500 §6.4.3: P102 is 2066h."""
    ref = NORD.object_of(NORD.parameter_named("P102"))
    assert ref.index == 0x2066
    assert NORD.object_in_set(ref, 1) == ref
    step = NORD.parameter_names.set_step if NORD.parameter_names else 0
    assert NORD.object_in_set(ref, 3) == ObjectRef(ref.index, ref.sub + 2 * step)


def test_bits_without_which_a_drive_cannot_be_commanded() -> None:
    """IEC 61800-7-201: bits 0 … 3 and 7 of 6040h; bits 0 … 3, 5 and 6 of 6041h."""
    command, actual = CIA402.needed_bits("command"), CIA402.needed_bits("actual")
    assert command & 0x8F == 0x8F
    assert actual & 0x6F == 0x6F
