"""Factory settings of the bus interface (BU 2500 §6.4, §7.1)."""

from __future__ import annotations

import pytest

from bridge.sim.nord.nord_settings import Layout, factory_communication, place_of, values_per_drive


@pytest.mark.parametrize(("slot", "place"), [("fu1", 0), (4, 3), ("fu3", 2)])
def test_a_slot_has_its_place(slot: str | int, place: int) -> None:
    assert place_of(slot) == place


@pytest.mark.parametrize("slot", ["fu5", 0])
def test_there_are_four(slot: str | int) -> None:
    with pytest.raises(ValueError, match="no slot"):
        place_of(slot)


@pytest.mark.parametrize(("layout", "first"), [("three", 4), ("five", 6)])
def test_each_drive_has_its_words(layout: Layout, first: int) -> None:
    made = factory_communication(5, layout)
    assert values_per_drive(layout) + 1 == first
    assert made.rpdo[1].mapping == [0x3000_0210, *(0x3002_0010 | sub << 8 for sub in range(first, first + 3))]
    assert [pdo.cob_id for pdo in made.tpdo] == [0x185, 0x285, 0x385, 0x485, 0x1C5]


def test_as_delivered_the_fifth_and_the_further_channels_are_off() -> None:
    made = factory_communication(5, "three")
    assert [pdo.enabled for pdo in made.rpdo] == [True] * 4 + [False]
    assert [channel.enabled for channel in made.sdo] == [True] + [False] * 3
    assert (made.tpdo[0].inhibit_100us, made.rpdo[0].inhibit_100us) == (100, 0)
