"""Our own EDS of the 8400 motec: other tools open it, and the simulated node has what it says."""

from __future__ import annotations

import pytest

from bridge.eds import Description, read_device_file
from bridge.eds.pdos import pdos
from bridge.mapping import load_family
from bridge.mapping.loader import mappings_dir
from bridge.sim.core.dictionary import Number
from bridge.sim.lenze.lenze_motec import LenzeMotec
from tests.support.eds_checks import compare_defaults, compare_types_and_access, entries, open_with_canopen

FILE = mappings_dir() / "lenze" / "8400-motec.eds"
FAMILY = load_family("lenze/8400-motec")
NODE = 5
SIMULATED = LenzeMotec(NODE)
FIND = SIMULATED.objects.find
INTEGERS = {"uint8": "UNSIGNED8", "uint16": "UNSIGNED16", "uint32": "UNSIGNED32", "int32": "INTEGER32"}


@pytest.fixture(scope="module")
def description() -> Description:
    return read_device_file(FILE)


def test_it_has_no_findings(description: Description) -> None:
    assert description.findings == ()


def test_canopen_opens_it(description: Description) -> None:
    other = open_with_canopen(FILE, description, NODE)
    assert other[0x1401][1].default == 0x40000305


def test_the_simulated_node_has_every_object_with_the_same_type_and_access(description: Description) -> None:
    assert compare_types_and_access(entries(description), FIND, static=True) > 150


def test_the_defaults_are_those_of_a_fresh_node(description: Description) -> None:
    assert compare_defaults(entries(description), FIND, NODE) > 100


def test_no_object_can_be_mapped(description: Description) -> None:
    """§13, I-1600: the mapping is static."""
    assert not any(entry.pdo_mappable for one in description.objects for entry in one.entries)


def test_limits_are_those_of_the_simulated_node(description: Description) -> None:
    checked = 0
    for one in description.objects:
        for entry in one.entries:
            node = FIND(entry.index, entry.sub)
            assert isinstance(node, Number)
            if entry.index >= 0x2000 and entry.low is not None and node.low is not None:
                assert (entry.low.at(NODE), entry.high and entry.high.at(NODE)) == (node.low, node.high), (
                    entry
                )
                checked += 1
    assert checked > 30


def test_the_mapping_file_and_the_eds_agree_on_the_pdos(description: Description) -> None:
    known = {(pdo.receives, pdo.number): pdo for pdo in pdos(description, NODE)}
    (slot,) = FAMILY.slot
    for receives, each in ((True, slot.rpdo), (False, slot.tpdo)):
        for pdo in each:
            summary = known[receives, pdo.number]
            assert summary.cob_id == pdo.cob_id + NODE
            assert summary.mapped == ()


def test_the_mapping_file_and_the_eds_agree_on_the_codes(description: Description) -> None:
    """The codes are those that the manual tabulates (§12); the drive's own are not in it."""
    entries = {(entry.index, entry.sub): entry for one in description.objects for entry in one.entries}
    checked = 0
    for parameter in FAMILY.parameter:
        ref = FAMILY.object_of(parameter)
        entry = entries.get((ref.index, ref.sub))
        if entry is None:
            continue
        assert entry.data_type
        assert INTEGERS[parameter.data_type] == entry.data_type.name, parameter.name
        assert (parameter.access == "rw") == entry.access.writable, parameter.name
        checked += 1
    assert checked > 60
