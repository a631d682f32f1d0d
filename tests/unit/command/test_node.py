"""A configured node: its drives or its device, who has parameters, and whose an object is."""

from __future__ import annotations

from pathlib import Path

from bridge.catalogue import Catalogue
from bridge.command import Plant
from bridge.command.node import Node
from bridge.config import Site
from bridge.mapping.model import ObjectRef
from tests.support import sites
from tests.support.devices import ENCODER, IO_BLOCK, OUTPUTS
from tests.support.nodes import device_plant, node_of


def test_a_node_of_drives_is_commanded_by_them_and_has_their_parameters() -> None:
    node = node_of(sites.drive("fu1", "none", 0, ""), sites.drive("fu2", "none", 0, ""))
    assert [one.name for one in node.commanded] == ["conveyor/fu1", "conveyor/fu2"]
    assert list(node.members) == list(node.drives)
    assert node.name == "conveyor"


def test_a_device_is_commanded_where_it_has_outputs(tmp_path: Path) -> None:
    encoder = device_plant(tmp_path / "a", ENCODER).nodes["shaft"]
    assert list(encoder.commanded) == []
    assert list(encoder.members) == list(encoder.devices)
    assert [one.name for one in encoder.members] == ["shaft"]
    block = device_plant(tmp_path / "b", IO_BLOCK, OUTPUTS).nodes["shaft"]
    (device,) = block.devices
    (outputs,) = device.commanded
    assert list(block.commanded) == [outputs]


def with_axes() -> Node:
    """A node with a drive on each of its two axes."""
    plain = sites.family(sites.FAMILY)
    slots = [slot.model_copy(update={"axis": axis}) for axis, slot in enumerate(plain.slot[:2], 1)]
    family = plain.model_copy(update={"slot": [*slots, *plain.slot[2:]]})
    drives = [sites.drive(slot.name, "none", 0, "") for slot in slots]
    site = Site.model_validate(sites.parsed(sites.site(sites.bus(sites.node(*drives)))))
    return Plant(Catalogue.of(site, {sites.FAMILY: family}), "1.2.3").nodes["conveyor"]


def test_of_several_axes_each_has_the_objects_of_its_own_profile() -> None:
    """CiA 301 §7.4.1: 6000h … 67FFh for the first, 6800h … 6FFFh for the second."""
    node = with_axes()
    refs = [ObjectRef(index, 0) for index in (0x6040, 0x67FF, 0x6840)]
    found = [[node.is_of(drive, ref) for ref in refs] for drive in node.drives]
    assert found == [[True, True, False], [False, False, True]]


def test_of_drives_with_one_axis_each_any_object_may_be_anybodys() -> None:
    node = node_of()
    (drive,) = node.drives
    assert node.is_of(drive, ObjectRef(0x6040, 0))
    assert node.is_of(drive, ObjectRef(0x2066, 1))
    assert drive.spec.names.resolve("P102").address == node.names.resolve("P102").address
