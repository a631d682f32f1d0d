"""Views of PDOs: a mapping of drives says them all, for any other node its device description does."""

from __future__ import annotations

from pathlib import Path

from bridge.bustools.pdo_views import pdo_views, without_pdos
from bridge.lint import family_dictionaries
from bridge.mapping.model import Family
from tests.support import sites
from tests.support.devices import ENCODER
from tests.support.nodes import device_plant, node_of


def test_those_of_drives_are_by_their_mapping_whatever_is_described() -> None:
    node = node_of()
    described = family_dictionaries([node.table.mapping]).get(node.table.mapping)
    views = pdo_views(node.table, node.family, None)
    assert {view.label.split()[0] for view in views.values()} >= {"RPDO1", "TPDO1"}
    assert pdo_views(node.table, node.family, described).keys() == views.keys()


def test_of_any_other_node_nothing_is_known_without_a_description(tmp_path: Path) -> None:
    node = device_plant(tmp_path, ENCODER).nodes["shaft"]
    assert pdo_views(node.table, node.family, None) == {}


def test_a_description_is_needed_where_there_are_no_drives(tmp_path: Path) -> None:
    encoder = device_plant(tmp_path, ENCODER).nodes["shaft"].family
    families: dict[str, Family] = {"shaft": encoder, sites.FAMILY: sites.family(sites.FAMILY)}
    assert without_pdos(families) == ["shaft"]
