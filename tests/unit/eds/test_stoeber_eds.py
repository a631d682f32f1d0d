"""Our own EDS of the STÖBER 5000: other tools open it, and the simulated drive has what it says."""

from __future__ import annotations

import pytest

from bridge.eds import Description, read_device_file
from bridge.eds.pdos import pdos
from bridge.mapping import load_family
from bridge.mapping.loader import mappings_dir
from bridge.sim.stoeber.stoeber_5000 import Stoeber5000
from tests.support.eds_checks import compare_defaults, compare_types_and_access, entries, open_with_canopen

FILE = mappings_dir() / "stoeber" / "5000.eds"
NODE = 5
SIMULATED = Stoeber5000(NODE, mapped=False)
"""Device as delivered: no application has mapped anything yet."""
FIND = SIMULATED.slave._views[0].find


@pytest.fixture(scope="module")
def description() -> Description:
    return read_device_file(FILE)


def test_it_has_no_findings(description: Description) -> None:
    assert description.findings == ()


def test_canopen_opens_it(description: Description) -> None:
    other = open_with_canopen(FILE, description, NODE)
    assert other[0x1201][1].default == 0x80000625


def test_the_simulated_drive_has_every_object_with_the_same_type_and_access(description: Description) -> None:
    assert compare_types_and_access(entries(description), FIND) > 150


def test_the_defaults_are_those_of_a_fresh_drive(description: Description) -> None:
    assert (
        compare_defaults([entry for entry in entries(description) if entry.index >= 0x1005], FIND, NODE) > 80
    )


def test_a_drive_as_delivered_maps_nothing(description: Description) -> None:
    assert [one.mapped for one in pdos(description, NODE)] == [()] * 8


@pytest.mark.parametrize("name", ["stoeber/5000", "stoeber/5000-four-axes", "stoeber/5000-posi"])
def test_the_mapping_file_and_the_eds_agree_on_the_identifiers(description: Description, name: str) -> None:
    known = {(pdo.receives, pdo.number): pdo for pdo in pdos(description, NODE)}
    family = load_family(name)
    for slot in family.slot:
        for receives, mine in ((True, slot.rpdo), (False, slot.tpdo)):
            for pdo in mine:
                assert known[receives, pdo.number].cob_id == pdo.cob_id + NODE
    for server in family.sdo:
        objects = {one.index: one for one in description.objects}[0x1200 + server.number - 1]
        values = [entry.default.at(NODE) for entry in objects.entries if entry.default]
        assert [value & 0x7FF for value in values[1:3]] == [server.request + NODE, server.reply + NODE]


def test_the_parameters_of_the_mapping_are_in_the_eds(description: Description) -> None:
    known = {(entry.index, entry.sub) for one in description.objects for entry in one.entries}
    family = load_family("stoeber/5000")
    for parameter in family.parameter:
        ref = family.object_of(parameter)
        assert (ref.index, ref.sub) in known, parameter.name
