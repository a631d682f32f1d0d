"""The NORD SK TU4-CAO family, against the manual's own figures (BU 2500 de-4319)."""

from __future__ import annotations

import pytest

from bridge.mapping import family_names
from tests.support.rig import NORD

SLOTS = ("fu1", "fu2", "fu3", "fu4")


def test_is_found_by_its_name():
    assert "nord/sk-tu4-cao" in family_names()


def test_is_one_node_with_four_drives_at_addresses_1_to_63():
    assert tuple(slot.name for slot in NORD.slot) == SLOTS
    assert (NORD.family.node_id_low, NORD.family.node_id_high) == (1, 63)


@pytest.mark.parametrize(
    ("slot", "rpdo", "tpdo"),
    [("fu1", 0x200, 0x180), ("fu2", 0x300, 0x280), ("fu3", 0x400, 0x380), ("fu4", 0x500, 0x480)],
)
def test_cob_ids_are_those_of_the_factory(slot: str, rpdo: int, tpdo: int):
    """§6.4."""
    it = NORD.slot_named(slot)
    assert (it.rpdo[0].cob_id, it.tpdo[0].cob_id) == (rpdo, tpdo)
    assert it.rpdo[0].number == it.tpdo[0].number == SLOTS.index(slot) + 1


@pytest.mark.parametrize("number", range(4))
def test_both_layouts_of_setpoints_are_known(number: int):
    """Three to a drive (§7.1.2, P165) and five to a drive (§6.7.5)."""
    slot = NORD.slot[number]
    for pdo, word, values in ((slot.rpdo[0], 0x3000, 0x3002), (slot.tpdo[0], 0x3001, 0x3003)):
        (first, *others) = pdo.objects
        assert [str(mapped) for mapped in first] == [f"{word:04X}:{number + 1:02X}"]
        for place, mapped in enumerate(others, 1):
            layouts = (3 * number + place, 5 * number + place)  # the factory's first
            known = [f"{values:04X}:{sub:02X}" for sub in dict.fromkeys(layouts)]
            assert [str(one) for one in mapped] == known


@pytest.mark.parametrize(
    ("name", "states"),
    [
        ("P509", {3: "system bus", 6: "CANopen"}),  # §7.2, §8.1
        ("P510", {0: "automatic"}),  # §7.2
        (
            "P543",  # §5.4, §6.8
            {
                1: "actual frequency",
                10: "actual position, increments, low word",
                15: "actual position, increments, high word",
            },
        ),
        (
            "P546",  # §5.4, §6.8
            {
                1: "set frequency",
                23: "set position, increments, low word",
                24: "set position, increments, high word",
            },
        ),
        (
            "P152",  # §7.1.1
            {0: "no change", 1: "load factory settings", 2: "basic parameters", 3: "I parameters"},
        ),
        ("P160", {0: "off", 1: "receive on", 2: "transmit on", 3: "both on"}),  # §7.1.2
    ],
)
def test_settings_have_the_texts_that_the_manual_has(name: str, states: dict[int, str]):
    assert NORD.parameter_named(name).states == states


def test_process_data_are_always_four_words():
    """§6.4, note."""
    for slot in NORD.slot:
        assert len(NORD.rpdo_words(slot.rpdo[0])) == len(NORD.tpdo_words(slot.tpdo[0])) == 4
    assert NORD.process.exact_length


def test_the_digital_outputs_go_with_fu1_by_rpdo5():
    """§6.4: 240h + node id, off at factory; §6.7.5: 3004h."""
    _, pdo = NORD.slot_named("fu1").rpdo
    assert (pdo.number, pdo.cob_id, pdo.optional, str(pdo.objects[0][0])) == (5, 0x240, True, "3004:00")
    assert [len(slot.rpdo) for slot in NORD.slot] == [2, 1, 1, 1]
    assert [value.leaf for value in NORD.values_of(NORD.slot[1]) if value.group == "command"] == [
        "command/frequency",
        "command/position",
    ]


def test_emergencies_say_which_drive_in_byte_3():
    assert NORD.emcy.drive_byte == 3
    assert [slot.emcy_drive for slot in NORD.slot] == [0, 1, 2, 3]


def test_parameters_are_at_2000h_and_their_number():
    """§6.6.1: P102 is 2066h; set 1 of the first element is sub-index 1."""
    objects = {p.name: str(NORD.object_of(p)) for p in NORD.parameter}
    assert objects["P102"] == "2066:01"
    assert (objects["P105"], objects["P112"]) == ("2069:01", "2070:01")
    assert (objects["P543"], objects["P509"], objects["P700[2]"]) == ("221F:01", "21FD:00", "22BC:05")
    # §7.1: the interface's own count from 1
    assert (objects["P151"], objects["P173"]) == ("2097:01", "20AD:01")


def test_fault_numbers_are_those_of_the_interface():
    """§8.4."""
    faults = NORD.faults
    assert (faults.controller_silent, faults.bridge_timeout) == (10.3, 102.0)
    assert (faults.telegram_downtime, faults.node_missing) == (10.2, 10.9)
    for number in ("10.2", "10.3", "10.9", "102.0"):
        assert faults.texts[number]


def test_a_slot_that_is_not_there_is_a_key_error():
    with pytest.raises(KeyError):
        NORD.slot_named("fu5")
