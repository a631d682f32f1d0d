"""Descriptions of drives and devices: who commands them, and whose parameters are reached."""

from __future__ import annotations

from dataclasses import FrozenInstanceError
from pathlib import Path

import pytest

from bridge.catalogue import Catalogue, DeviceSpec
from tests.support import sites
from tests.support.devices import ENCODER, IO_BLOCK, OUTPUTS
from tests.support.nodes import device_plant


def catalogue(control: str = "modbus", node: str = "") -> Catalogue:
    drives = [sites.drive(slot, control, 0, sites.SCALED) for slot in ("fu1", "fu2")]
    return sites.catalogue_of(sites.site(sites.bus(sites.node(*drives, more=node))))


def device(folder: Path, mapping: str = ENCODER, more: str = "") -> DeviceSpec:
    return device_plant(folder, mapping, more).catalogue.devices["shaft"]


def test_a_drive_is_commanded_by_whom_the_site_file_says() -> None:
    for control in ("modbus", "lease", "none"):
        one = catalogue(control).drives["conveyor/fu1"]
        assert (one.control, one.is_commanded) == (control, True)


def test_a_drives_parameters_are_reached_by_an_open_channel() -> None:
    """SDO1 of a SK TU4-CAO reaches FU1 (BU 2500 §6.4)."""
    assert [one.sdo_channel for one in catalogue().drives.values()] == [1, None]
    opened = catalogue(node="sdo_channels = [2]")
    assert [one.sdo_channel for one in opened.drives.values()] == [1, 2]


def test_inputs_are_commanded_by_nobody(tmp_path: Path) -> None:
    one = device(tmp_path)
    assert (one.control, one.stop_by_anyone, one.is_commanded, one.sdo_channel) == (
        "none",
        False,
        False,
        1,
    )


def test_outputs_are_commanded_as_their_node_says(tmp_path: Path) -> None:
    one = device(tmp_path, IO_BLOCK, OUTPUTS)
    assert one.is_commanded
    assert (one.control, one.stop_by_anyone) == (one.node.outputs.control, one.node.outputs.stop_by_anyone)
    assert one.control != "none"


def test_a_description_does_not_change() -> None:
    with pytest.raises(FrozenInstanceError):
        catalogue().drives["conveyor/fu1"].unit_id = 7  # type: ignore[misc]
