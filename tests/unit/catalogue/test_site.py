"""The catalogue of a site: what is in it, that it needs no run time, and that the run time has the same."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path
from typing import Final

import pytest

import bridge.catalogue
from tests.support import sites
from tests.support.devices import IO_BLOCK, OUTPUTS
from tests.support.nodes import device_plant

_TWO: Final = sites.site(
    sites.bus(sites.node(sites.drive("fu1", "modbus", 200, "unit_id = 2"), sites.drive("fu2", "none", 0)))
)
_RUN_TIME: Final = ("Columns", "Feed", "Image", "Reading")


def test_it_has_everything_by_its_name_in_the_order_of_the_site_file() -> None:
    catalogue = sites.catalogue_of(_TWO)
    assert list(catalogue.nodes) == ["conveyor"]
    assert list(catalogue.drives) == ["conveyor/fu1", "conveyor/fu2"]
    assert [one.unit_id for one in catalogue.drives.values()] == [2, 1]
    assert catalogue.nodes["conveyor"].drives == tuple(catalogue.drives.values())
    assert not catalogue.devices


def test_what_a_drive_has_is_among_the_points_of_the_site() -> None:
    catalogue = sites.catalogue_of(_TWO)
    for drive in catalogue.drives.values():
        of_drive = tuple(one for one in catalogue.points if one.name.startswith(f"{drive.name}/"))
        assert drive.points == of_drive


def test_a_node_that_is_no_drive_has_its_points_and_those_of_a_node(tmp_path: Path) -> None:
    catalogue = device_plant(tmp_path, IO_BLOCK, OUTPUTS).catalogue
    device = catalogue.devices["shaft"]
    assert catalogue.nodes["shaft"].members == (device,)
    assert device.points == tuple(one for one in catalogue.points if one.name.startswith("shaft/"))
    assert {"shaft/output/valves", "shaft/node/state"} <= {one.name for one in device.points}


def test_the_plant_has_the_points_of_its_catalogue() -> None:
    plant = sites.plant_of(_TWO)
    assert tuple(plant.image.points) == plant.catalogue.points
    assert [one.spec for one in plant.drives.values()] == list(plant.catalogue.drives.values())


def test_nothing_of_the_run_time_is_loaded_for_it() -> None:
    """In a process of its own; the package of points brings the image's class with it."""
    told = subprocess.run(
        [sys.executable, "-c", "import sys, bridge.catalogue; print(*sys.modules)"],
        capture_output=True,
        text=True,
        check=True,
    )
    loaded = set(told.stdout.split())
    rooms = {name.split(".")[1] for name in loaded if name.startswith("bridge.")}
    assert "catalogue" in rooms
    assert not rooms & {"command", "node", "master", "northbound", "service", "condition", "can", "mirror"}
    assert not loaded & {"asyncio", "bridge.base.clock"}


@pytest.mark.parametrize(
    "file", sorted(Path(bridge.catalogue.__file__).parent.glob("*.py")), ids=lambda file: file.name
)
def test_no_module_of_it_names_an_image(file: Path) -> None:
    names = {node.id for node in ast.walk(ast.parse(file.read_text("utf-8"))) if isinstance(node, ast.Name)}
    assert not names & {*_RUN_TIME, "Plant", "Drive", "Channel"}
