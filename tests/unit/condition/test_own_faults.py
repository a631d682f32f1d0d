"""Faults of the drives themselves, by status word and emergency code, and those that answer a silent bus."""

from __future__ import annotations

from bridge.condition.own_faults import with_faults
from bridge.condition.plant_layout import layout_of
from tests.support import sites

FAULT, READY = 0x0008, 0x0231
"""NORD's status words (BU 2500 §6.5.2)."""


def layout():
    catalogue = sites.catalogue_of(sites.site(sites.bus(sites.node(sites.drive("fu1", "none", 0)))))
    return with_faults(layout_of(catalogue.points, catalogue), catalogue)


def test_a_drive_in_fault_is_explained_by_its_last_emergency() -> None:
    own = layout().own_faults["conveyor/fu1"]
    found = own(FAULT, 0x2310)
    assert found is not None
    assert "overcurrent" in str(found)
    assert str(own(FAULT, 0)) == "fault"


def test_a_drive_that_is_in_no_fault_has_none_whatever_it_said_last() -> None:
    own = layout().own_faults["conveyor/fu1"]
    assert own(READY, 0x2310) is None


def test_faults_of_a_silent_bus_have_the_makers_numbers() -> None:
    """BU 2500 §8: E010 is the time-out of the telegrams."""
    found = layout().bus_faults["conveyor/fu1"]
    assert found
    assert any(number.endswith("10.2") for number in found)
