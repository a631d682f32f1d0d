"""Our own EDS of the SK TU4-CAO: other tools open it, and the simulated node has what it says."""

from __future__ import annotations

import canopen
import pytest

from bridge.eds import Description, Entry, read_device_file
from bridge.eds.pdos import pdos
from bridge.mapping import load_family
from bridge.mapping.loader import mappings_dir
from bridge.sim.dictionary import Number, Text
from bridge.sim.nord_tu4 import NordTu4

FILE = mappings_dir() / "nord" / "sk-tu4-cao.eds"
PROFILE = range(0x6000, 0x6100)
"""There only with P168 [-01] = 1 (BU 2500 §6.7.3), which the simulation leaves at 0."""
NODE = 5
SIMULATED = NordTu4(NODE, layout="five")
"""Numbered as §6.7.5 does."""


@pytest.fixture(scope="module")
def description() -> Description:
    return read_device_file(FILE)


def simulated(entry: Entry) -> Number | Text:
    found = SIMULATED.slave._dictionary.find(entry.index, entry.sub)
    assert isinstance(found, Number | Text)
    return found


def test_it_has_no_findings(description: Description) -> None:
    assert description.findings == ()


def test_canopen_opens_it(description: Description) -> None:
    other = canopen.import_od(str(FILE), NODE)
    for one in description.objects:
        for entry in one.entries:
            member = other[one.index] if one.object_type == 7 else other[one.index][entry.sub]
            assert (member.data_type, member.access_type) == (entry.data_type, entry.access), one.name
    assert other[0x1802][1].default == 0x40000385


def test_the_simulated_node_has_every_object_with_the_same_type_and_access(description: Description) -> None:
    checked = 0
    for one in description.objects:
        for entry in one.entries:
            if entry.index in PROFILE:
                continue
            node = simulated(entry)
            assert entry.data_type
            if isinstance(node, Text):
                assert entry.data_type.name == "VISIBLE_STRING"
                continue
            writable = node.write is not None
            assert node.data_type.name == entry.data_type.name, entry
            assert (node.read is not None, writable) == (entry.access.readable, entry.access.writable), entry
            assert (node.in_tpdo or node.in_rpdo) == entry.pdo_mappable, entry
            checked += 1
    assert checked > 150


def test_the_defaults_of_pdos_and_sdos_are_those_of_a_fresh_node(description: Description) -> None:
    for one in description.objects:
        for entry in one.entries:
            if 0x1200 <= entry.index < 0x1B00 and entry.default:
                node = simulated(entry)
                assert isinstance(node, Number)
                assert node.read
                assert node.read() == entry.default.at(NODE), entry


def test_the_mapping_file_and_the_eds_agree_on_the_pdos(description: Description) -> None:
    known = {(pdo.receives, pdo.number): pdo for pdo in pdos(description, NODE)}
    for slot in load_family("nord/sk-tu4-cao").slot:
        for receives, pdo in ((True, slot.rpdo), (False, slot.tpdo)):
            summary = known[receives, pdo.number]
            assert summary.cob_id == pdo.cob_id + NODE
            five = [(refs[-1].index, refs[-1].sub) for refs in pdo.objects]
            assert [(one.index, one.sub) for one in summary.mapped] == five
