"""Our own EDS files of the NORD nodes: other tools open them, and the simulated nodes have what they say."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.eds import Description, Entry, read_device_file
from bridge.eds.pdos import pdos
from bridge.mapping import load_family
from bridge.mapping.loader import mappings_dir
from bridge.sim.nord.nord_node import NordNode
from bridge.sim.nord.nord_single import NordSingle
from bridge.sim.nord.nord_single_settings import RJ45_5XX, RJ45_54X, TU3
from bridge.sim.nord.nord_tu4 import NordTu4
from tests.support.eds_checks import compare_defaults, compare_types_and_access, entries, open_with_canopen

PROFILE = range(0x6000, 0xA000)
"""In sk-tu4-cao.eds and sk-cu4-cao.eds, though there only with P168 [-01] = 1 (BU 2500 §6.7.3)."""
NODE = 5
NODES: dict[str, NordNode] = {
    # Numbered as §6.7.5 does.
    "sk-tu4-cao": NordTu4(NODE, layout="five"),
    "sk-cu4-cao": NordTu4(NODE, kind="SK CU4-CAO", layout="five"),
    "sk-tu4-cao-ds402": NordTu4(NODE, profile=True),
    "sk-tu3-cao": NordSingle(NODE, TU3),
    "sk-5xxe-rj45": NordSingle(NODE, RJ45_5XX),
    "sk-54xe-rj45": NordSingle(NODE, RJ45_54X),
}
ON_DEMAND = {name for name in NODES if name in ("sk-tu4-cao", "sk-cu4-cao")}
MAPPINGS = {
    **{f"nord/{name}": name for name in NODES},
    **{f"nord/sk-tu3-cao-{view}": "sk-tu3-cao" for view in ("pdo1", "pdo3", "pdo4")},
    "nord/sk-5xxe-rj45-encoder": "sk-5xxe-rj45",
    "nord/sk-54xe-rj45-encoder": "sk-54xe-rj45",
}


def path(name: str) -> Path:
    return mappings_dir() / "nord" / f"{name}.eds"


@pytest.fixture(params=NODES)
def name(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture
def description(name: str) -> Description:
    return read_device_file(path(name))


def of_a_fresh_node(name: str, description: Description) -> list[Entry]:
    return [entry for entry in entries(description) if not (name in ON_DEMAND and entry.index in PROFILE)]


def test_every_file_is_looked_at():
    assert {file.stem for file in (mappings_dir() / "nord").glob("*.eds")} == set(NODES)


def test_it_has_no_findings(description: Description):
    assert description.findings == ()


def test_canopen_opens_it(name: str, description: Description):
    other = open_with_canopen(path(name), description, NODE)
    assert other[0x1800][1].default == 0x40000185


def test_the_simulated_node_has_every_object_with_the_same_type_and_access(
    name: str, description: Description
):
    find = NODES[name].slave._dictionary.find
    assert compare_types_and_access(of_a_fresh_node(name, description), find) > 50


def test_the_defaults_of_pdos_and_sdos_are_those_of_a_fresh_node(name: str, description: Description):
    listed = [
        entry
        for entry in of_a_fresh_node(name, description)
        if 0x1200 <= entry.index < 0x1B00 or entry.index in PROFILE
    ]
    assert compare_defaults(listed, NODES[name].slave._dictionary.find, NODE) > 20


@pytest.mark.landing(11)
@pytest.mark.parametrize("mapping", MAPPINGS)
def test_the_mapping_file_and_the_eds_agree_on_the_pdos(mapping: str):
    """The EDS has the second of two layouts in the mapping file, that of §6.7.5."""
    known = {(pdo.receives, pdo.number): pdo for pdo in pdos(read_device_file(path(MAPPINGS[mapping])), NODE)}
    for slot in load_family(mapping).slot:
        for receives, each in ((True, slot.rpdo), (False, slot.tpdo)):
            for pdo in each:
                summary = known[receives, pdo.number]
                assert summary.cob_id == pdo.cob_id + NODE
                if pdo.static or "ds402" in mapping:
                    continue  # the object is not named; the mapping is left to the master
                own = [refs[-1].parts[0] for refs in pdo.objects]
                assert [(one.index, one.sub) for one in summary.mapped] == [(p.index, p.sub) for p in own]


@pytest.mark.parametrize("mapping", MAPPINGS)
def test_what_the_mapping_maps_and_writes_is_in_the_eds(mapping: str):
    family = load_family(mapping)
    description = read_device_file(path(MAPPINGS[mapping]))
    known = {(entry.index, entry.sub) for one in description.objects for entry in one.entries}
    refs = [poll.object for poll in family.poll]
    for slot in family.slot:
        refs += [
            part
            for pdo in (*slot.rpdo, *slot.tpdo)
            for words in pdo.objects
            for part in words[-1].parts
            if not pdo.static
        ]
    wanted = {(ref.index, ref.sub) for ref in refs if ref.index >= 0x3000}
    assert wanted <= known
