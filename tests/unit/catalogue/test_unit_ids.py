"""Modbus unit ids: as given, the others in order."""

from __future__ import annotations

import pytest

from bridge.base.errors import FileFaults
from bridge.catalogue.unit_ids import DEVICE, unit_ids
from bridge.config import Site
from tests.support import sites


def site_of(*nodes: str) -> Site:
    return Site.model_validate(sites.parsed(sites.site(sites.bus(*nodes), sites.modbus())))


def test_they_are_as_given_and_else_in_order() -> None:
    given = sites.drive("fu1", "modbus", 0, "unit_id = 2")
    site = site_of(sites.node(given, sites.drive("fu2", "none", 0, ""), sites.drive("fu3", "none", 0, "")))
    assert unit_ids(site) == {("conveyor", 0): 2, ("conveyor", 1): 1, ("conveyor", 2): 3}


def test_a_node_that_is_no_drive_has_its_own() -> None:
    shaft = sites.node(name="shaft", node_id=20, mapping="eds:encoder.eds")
    given = sites.node(name="other", node_id=21, mapping="eds:encoder.eds", more="unit_id = 1")
    assert unit_ids(site_of(shaft, given)) == {("shaft", DEVICE): 2, ("other", DEVICE): 1}


def many_drives(count: int) -> Site:
    """Two on each node but the last one, a hundred nodes on a bus."""
    slots = [("fu1", "fu2")[: count - place] for place in range(0, count, 2)]
    nodes = [
        sites.node(*(sites.drive(slot, "modbus", 0, "") for slot in has), name=f"n{n}", node_id=n % 100 + 1)
        for n, has in enumerate(slots)
    ]
    buses = sites.bus(*nodes[:100]), sites.bus(*nodes[100:], name="can1")
    return Site.model_validate(sites.parsed(sites.site(*buses, sites.modbus())))


def test_modbus_has_247_units_and_no_drive_goes_without() -> None:
    """1 … 247 (Modbus over serial line V1.02, 2.2)."""
    assert list(unit_ids(many_drives(247)).values()) == list(range(1, 248))
    with pytest.raises(FileFaults) as told:
        unit_ids(many_drives(248))
    assert str(told.value) == ": unit_id: more than 247 drives have no Modbus unit id"
