"""Our own EDS of a CiA 402 drive: other tools open it, and the simulated drive has what it says."""

from __future__ import annotations

import pytest

from bridge.eds import Description, read_device_file
from bridge.eds.pdos import pdos
from bridge.mapping import family_names, load_family
from bridge.mapping.loader import mappings_dir
from bridge.sim.cia402.cia402_drive import Cia402Drive
from tests.support.eds_checks import compare_defaults, compare_types_and_access, entries, open_with_canopen

FILE = mappings_dir() / "cia402" / "cia402.eds"
NODE = 5
SIMULATED = Cia402Drive(NODE)
FIND = SIMULATED.objects.find
FAMILIES = [name for name in family_names() if name.startswith("cia402/")]


@pytest.fixture(scope="module")
def description() -> Description:
    return read_device_file(FILE)


def test_it_has_no_findings(description: Description) -> None:
    assert description.findings == ()


def test_canopen_opens_it(description: Description) -> None:
    other = open_with_canopen(FILE, description, NODE)
    assert other[0x1400][1].default == 0x205


def test_the_simulated_drive_has_every_object_with_the_same_type_and_access(description: Description) -> None:
    assert compare_types_and_access(entries(description), FIND) > 190


def test_the_defaults_are_those_of_a_fresh_drive(description: Description) -> None:
    assert compare_defaults(entries(description), FIND, NODE) > 140


def test_every_object_of_the_drive_is_in_it(description: Description) -> None:
    listed = {one.index for one in description.objects}
    assert {index for index in range(0x1000, 0x7000) if SIMULATED.objects.has_object(index)} == listed


def test_the_delivered_pdos_are_the_profiles(description: Description) -> None:
    found = {
        (pdo.receives, pdo.number): [(one.index, one.bits) for one in pdo.mapped]
        for pdo in pdos(description, NODE)
    }
    assert found[True, 1] == [(0x6040, 16)]
    assert found[True, 3] == [(0x6040, 16), (0x607A, 32)]
    assert found[True, 4] == [(0x6040, 16), (0x60FF, 32)]
    assert found[False, 2] == [(0x6041, 16), (0x6061, 8)]


@pytest.mark.parametrize("name", FAMILIES)
def test_the_mapping_files_and_the_eds_agree(description: Description, name: str) -> None:
    """Identifiers, what can be mapped, and the parameters' types."""
    family = load_family(name)
    entries = {(entry.index, entry.sub): entry for one in description.objects for entry in one.entries}
    known = {(pdo.receives, pdo.number): pdo for pdo in pdos(description, NODE)}
    (slot,) = family.slot
    for receives, mine in ((True, slot.rpdo), (False, slot.tpdo)):
        (pdo,) = mine
        assert known[receives, pdo.number].cob_id == pdo.cob_id + NODE
        for refs in pdo.objects:
            (part,) = refs[0].parts
            assert entries[part.index, part.sub].pdo_mappable
    for parameter in family.parameter:
        ref = family.object_of(parameter)
        entry = entries[ref.index, ref.sub]
        assert entry.data_type
        kind = entry.data_type.name.lower().replace("unsigned", "uint").replace("integer", "int")
        assert kind == parameter.data_type, parameter.name
        access = (entry.access.readable, entry.access.writable)
        assert access == (parameter.access != "wo", parameter.access != "ro"), parameter.name
