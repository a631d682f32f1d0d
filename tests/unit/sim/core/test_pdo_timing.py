"""Moments at which PDOs are sent and take effect."""

from __future__ import annotations

import pytest

from bridge.sim.core.communication_settings import PdoSettings
from bridge.sim.core.dictionary import Cell, Dictionary, IntegerType, Number, constant
from bridge.sim.core.pdo_timing import Rpdo, Tpdo, entries_of, places_of, unpack
from bridge.sim.core.sdo_abort import SdoAbort


def test_type_0_answers_a_sync_with_what_has_changed_and_n_every_nth() -> None:
    tpdo, on_change = Tpdo(), PdoSettings(0x185, transmission_type=0)
    assert tpdo.on_sync(on_change, b"a")
    tpdo.sent(b"a", 1.0)
    assert [tpdo.on_sync(on_change, b"a"), tpdo.on_sync(on_change, b"b")] == [False, True]
    third = PdoSettings(0x185, transmission_type=3)
    tpdo.start()
    assert [tpdo.on_sync(third, b"a") for _ in range(6)] == [False, False, True] * 2
    assert tpdo.due(third, lambda: b"z", 9.0) is None


def test_an_event_waits_for_the_inhibit_time_and_the_timer_sends_without_one() -> None:
    tpdo = Tpdo()
    settings = PdoSettings(0x185, transmission_type=255, inhibit_100us=500, event_timer_ms=200)
    assert tpdo.due(settings, lambda: b"a", 1.0) == b"a"
    tpdo.sent(b"a", 1.0)
    assert tpdo.next_deadline(settings) == pytest.approx(1.2)
    assert tpdo.due(settings, lambda: b"b", 1.01) is None
    assert tpdo.next_deadline(settings) == pytest.approx(1.05)
    assert tpdo.due(settings, lambda: b"b", 1.05) == b"b"
    tpdo.sent(b"b", 1.05)
    assert tpdo.due(settings, lambda: b"b", 1.2) is None
    assert tpdo.due(settings, lambda: b"b", 1.2501) == b"b"


def test_a_synchronous_rpdo_takes_effect_with_the_sync_and_once() -> None:
    rpdo, synchronous = Rpdo(), PdoSettings(0x205, transmission_type=1)
    assert rpdo.on_data(PdoSettings(0x205), b"now") == b"now"
    assert rpdo.on_data(synchronous, b"old") is None
    assert rpdo.on_data(synchronous, b"new") is None
    assert [rpdo.on_sync(), rpdo.on_sync()] == [b"new", None]
    rpdo.on_data(synchronous, b"x")
    rpdo.reset()
    assert rpdo.on_sync() is None


def test_an_rpdo_writes_its_objects_leaves_gaps_and_counts_what_is_refused() -> None:
    objects, cell = Dictionary(), Cell()
    objects.add(0x6040, 0, Number(IntegerType.UNSIGNED16, cell.get, cell.set))
    objects.add(0x6041, 0, constant(IntegerType.UNSIGNED8, 0))
    mapping = [0x0005_0008, 0x6040_0010, 0x6041_0008, 0x7000_0008]
    pdo = PdoSettings(0x205, entries=mapping, count=4)
    places = places_of(objects, pdo)
    assert [(place.start, place.end) for place in places] == [(1, 3), (3, 4), (4, 5)]
    assert unpack(places, bytes([0xFF, 0x0F, 0x01, 7, 7])) == 2, "one is read-only, one is missing"
    assert cell.value == 0x010F


def test_a_tpdo_of_what_is_missing_is_refused() -> None:
    with pytest.raises(SdoAbort):
        entries_of(Dictionary(), PdoSettings(0x185, entries=[0x6041_0010], count=1))
