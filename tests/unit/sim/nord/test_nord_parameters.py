"""Parameters of one NORD inverter (BU 2500 §6.6)."""

from __future__ import annotations

import pytest

from bridge.sim.core.dictionary import Dictionary
from bridge.sim.core.sdo_abort import SdoAbort
from bridge.sim.nord.nord_parameters import SK_5XXE, NordParameters, add_display, sub_index


def test_sub_indices_count_elements_and_sets() -> None:
    assert [sub_index(element, set_) for element, set_ in ((1, 1), (1, 4), (2, 1), (5, 3))] == [1, 4, 5, 19]


def entry(parameters: NordParameters, number: int, sub: int):
    objects = Dictionary()
    parameters.add_to(objects)
    return objects.find(0x2000 + number, sub)


def test_a_write_is_for_its_set_and_outlasts_the_power_where_p560_says_so() -> None:
    made = NordParameters()
    entry(made, 102, 2).download((500).to_bytes(2, "little"))
    assert [made.value(102, set_) for set_ in (1, 2)] == [2.0, 5.0]
    made.power_on()
    assert made.value(102, 2) == 5.0
    entry(made, 560, 0).download(b"\0\0")
    writes = made.eeprom_writes
    entry(made, 102, 2).download((700).to_bytes(2, "little"))
    assert (made.value(102, 2), made.eeprom_writes) == (7.0, writes)
    made.power_on()
    assert made.value(102, 2) == 5.0
    with pytest.raises(SdoAbort):
        entry(made, 105, 1).download(b"\0\0")


def test_commissioning_sets_all_sets_and_names_what_is_wrong() -> None:
    made = NordParameters()
    made.commission(105, 60.0)
    assert {made.value(105, set_) for set_ in range(1, 5)} == {60.0}
    made.commission(543, 9, element=2)
    assert [made.raw(543, element) for element in (1, 2, 3)] == [1, 9, 5]
    with pytest.raises(ValueError, match=r"P105 = 1000 is outside 0\.1 … 400"):
        made.commission(105, 1000)
    with pytest.raises(KeyError):
        made.commission(999, 1)


def test_meanings_are_elements_or_three_parameters() -> None:
    assert [NordParameters().meaning(543, value, 1) for value in range(1, 6)] == [1, 3, 5, 0, 0]
    single = NordParameters(SK_5XXE)
    single.commission(544, 7)
    assert [single.meaning(543, value, 1) for value in range(1, 6)] == [1, 7, 5, 0, 0]


def test_the_keypad_writes_as_p560_says() -> None:
    made = NordParameters()
    made.at_keypad(105, 700)
    made.power_on()
    assert made.value(105) == 70.0
    made.commission(560, 0)
    made.at_keypad(105, 800)
    assert made.value(105) == 80.0
    made.power_on()
    assert made.value(105) == 70.0


def test_a_display_is_the_same_in_every_set() -> None:
    objects = Dictionary()
    add_display(objects, 700, 2, lambda element: 10 * element)
    assert [objects.find(0x22BC, sub).upload()[0] for sub in (1, 4, 5, 8)] == [10, 10, 20, 20]
