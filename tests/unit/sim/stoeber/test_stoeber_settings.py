"""Factory settings of a STÖBER inverter (ID 441684.06 §7.2, §8.1.3)."""

from __future__ import annotations

import pytest

from bridge.sim.stoeber.stoeber_settings import (
    MAP_ENTRIES,
    StoeberPdo,
    coordinate,
    factory_communication,
    factory_settings,
)


@pytest.mark.parametrize(("name", "index"), [("A00", 0x2000), ("C01", 0x2401), ("E200", 0x28C8)])
def test_a_coordinate_is_an_index(name: str, index: int) -> None:
    assert coordinate(name) == index


def test_empty_places_of_a_mapping_do_not_count() -> None:
    assert StoeberPdo(0x205, entries=[0x2401_0010, 0, 0x2402_0010]).mapping == [0x2401_0010, 0x2402_0010]


@pytest.mark.parametrize(
    ("how", "used"),
    [
        ({"axes": 1, "mapped": False}, [0, 0, 0, 0]),
        ({"axes": 1, "mapped": True}, [2, 0, 0, 0]),
        ({"axes": 4, "mapped": True}, [2, 2, 2, 2]),
        ({"axes": 1, "mapped": True, "positions": True}, [4, 2, 0, 0]),
    ],
)
def test_an_application_maps_its_words(how: dict[str, bool], used: list[int]) -> None:
    made = factory_communication(5, **how)
    assert [pdo.count for pdo in made.rpdo] == used
    assert all(len(pdo.entries) == MAP_ENTRIES for pdo in (*made.rpdo, *made.tpdo))


def test_a_node_without_an_address_has_no_emergency_message() -> None:
    assert not factory_communication(0, 1, mapped=True).emcy.enabled
    assert factory_communication(5, 1, mapped=True).emcy.cob_id == 0x85


def test_each_channel_works_on_its_axis() -> None:
    assert factory_settings(4).edited_axis == [0, 0, 1, 2, 3]
    assert factory_settings(1).edited_axis == [0] * 5
