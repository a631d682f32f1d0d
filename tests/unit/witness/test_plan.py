"""What the witness knows of drives, held against what the bridge knows: two hands have written it."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.command import Plant
from bridge.config import load_site
from bridge.drive import ControlWords, DriveState, StatusWords
from bridge.lint import lint
from bridge.mapping import load_family
from bridge.mapping.loader import family_names
from bridge.project import load_project
from bridge.witness.plan import UnknownFamily, WatchedDrive, plan
from tests.support import sites
from tests.support.devices import DEVICES


def watched(folder: Path, mapping: str, slot: str, more: str = "") -> WatchedDrive:
    drive = sites.drive(slot, "modbus", 200, more)
    path = sites.write(folder, sites.bus(sites.node(drive, mapping=mapping)), sites.modbus(0))
    (bus,) = plan(load_site(path), path.parent)
    (found,) = bus.drives
    return found


LIGHT_TO_HEAVY = [
    ("nord/sk-tu3-cao-pdo4", "drive"),
    ("cia402/cyclic-velocity", "drive"),
    ("lenze/8400-motec", "drive"),
    ("stoeber/5000", "axis1"),
    ("nord/sk-tu4-cao", "fu1"),
]
_FULL_PERCENT = 75
"""Above such a load frames may wait for as long as one likes."""
FAMILIES = [(mapping, slot.name) for mapping in family_names() for slot in load_family(mapping).slot]


@pytest.mark.parametrize(("mapping", "slot"), FAMILIES)
def test_both_say_the_same_of_every_word(tmp_path: Path, mapping: str, slot: str) -> None:
    family = load_family(mapping)
    control, status = ControlWords(family.control_word), StatusWords(family.status_word)
    drive = watched(tmp_path, mapping, slot)
    for word in range(0x10000):
        data = word.to_bytes(2, "little")
        assert drive.control.enables(data) is control.enables(word), f"{word:04X}h"
        assert drive.status.enables(data) is (status.state(word) is DriveState.OPERATION_ENABLED)


@pytest.mark.parametrize(("mapping", "slot"), FAMILIES)
def test_both_have_it_on_the_same_identifiers(tmp_path: Path, mapping: str, slot: str) -> None:
    table = load_family(mapping).slot_named(slot)
    drive = watched(tmp_path, mapping, slot)
    assert (drive.rpdo, drive.tpdo) == (table.rpdo[0].cob_id + 5, table.tpdo[0].cob_id + 5)


def test_the_identifiers_of_the_site_file_count(tmp_path: Path) -> None:
    more = "rpdo = { cob_id = 0x345 }\ntpdo = { cob_id = 0x2C5, event_ms = 100 }"
    drive = watched(tmp_path, "nord/sk-tu4-cao", "fu1", more)
    assert (drive.rpdo, drive.tpdo) == (0x345, 0x2C5)


@pytest.mark.parametrize(("mapping", "slot"), FAMILIES)
@pytest.mark.parametrize("number", [1, 2, 3, 4, 5])
def test_only_the_pdo_with_the_word_is_looked_for(
    tmp_path: Path, mapping: str, slot: str, number: int
) -> None:
    """Further PDOs of the drive may be given an identifier as well."""
    more = (
        f"rpdo = [{{ number = {number}, cob_id = 0x345 }}]\ntpdo = [{{ number = {number}, cob_id = 0x2C5 }}]"
    )
    table = load_family(mapping).slot_named(slot)
    drive = watched(tmp_path, mapping, slot, more)
    first, says = table.rpdo[0], table.tpdo[0]
    assert drive.rpdo == (0x345 if first.number == number else first.cob_id + 5)
    assert drive.tpdo == (0x2C5 if says.number == number else says.cob_id + 5)


@pytest.mark.parametrize(("mapping", "slot"), LIGHT_TO_HEAVY)
@pytest.mark.parametrize("rate", [50_000, 125_000, 250_000, 1_000_000])
@pytest.mark.parametrize("nodes", [1, 3, 9])
def test_nobody_is_held_to_less_than_the_bridge_publishes(
    tmp_path: Path, mapping: str, slot: str, rate: int, nodes: int
) -> None:
    """Without the way through the front: the witness begins to count where the bridge does."""
    tables = [
        sites.node(sites.drive(slot, "modbus", 200, ""), name=f"n{one}", node_id=one, mapping=mapping)
        for one in range(1, nodes + 1)
    ]
    path = sites.write(tmp_path, sites.bus(*tables, more=f"bitrate = {rate}"), sites.modbus(0))
    project = load_project(path)
    verdict = lint(project.site, project.families, path, project.downloads)
    (bus,) = plan(project.site, tmp_path)
    if verdict.loads[0].most_percent > _FULL_PERCENT:
        return
    for drive, case in zip(bus.drives, verdict.worst_cases, strict=True):
        published = sum(term.ms for term in case.stop.terms if term.name not in ("way_ms", "sync_ms"))
        assert published <= drive.stop_ms(200) <= 3 * published


def test_a_family_that_it_does_not_know_is_named(tmp_path: Path) -> None:
    drive = sites.drive("drive", "modbus", 200, "")
    path = sites.write(tmp_path, sites.bus(sites.node(drive, mapping="acme/one")), sites.modbus(0))
    with pytest.raises(UnknownFamily, match="acme/one"):
        plan(load_site(path), path.parent)


@pytest.mark.parametrize("key", ['on_expiry = "hold"', "telegram_downtime_s = -0.1"])
def test_where_no_stop_is_promised_none_is_expected(tmp_path: Path, key: str) -> None:
    assert watched(tmp_path, "nord/sk-tu4-cao", "fu1", key).stop_ms(200) == 0


def test_before_the_bridge_tells_an_owner_may_have_set_the_longest(tmp_path: Path) -> None:
    more = "fieldbus_timeout_writable = true\nfieldbus_timeout_range_ms = [100, 3000]"
    assert watched(tmp_path, "nord/sk-tu4-cao", "fu1", more).timeout_ms == 3000


def test_units_are_counted_as_the_reference_says(tmp_path: Path) -> None:
    drives = [sites.drive("fu1", "modbus", 200, "unit_id = 2"), sites.drive("fu2", "modbus", 200, "")]
    drives += [sites.drive("fu3", "modbus", 200, "")]
    path = sites.write(tmp_path, sites.bus(sites.node(*drives)), sites.modbus(0))
    (bus,) = plan(load_site(path), path.parent)
    assert [drive.unit_id for drive in bus.drives] == [2, 1, 3]


def test_a_node_without_drives_has_a_unit(tmp_path: Path) -> None:
    (tmp_path / "encoder.eds").write_bytes((DEVICES / "encoder.eds").read_bytes())
    shaft = sites.node(name="shaft", node_id=20, mapping="eds:encoder.eds")
    given = sites.node(name="other", node_id=21, mapping="eds:encoder.eds", more="unit_id = 1")
    drive = sites.node(sites.drive("fu1", "modbus", 200, sites.SCALED))
    path = sites.write(tmp_path, sites.bus(shaft, given, drive), sites.modbus(0))
    (bus,) = plan(load_site(path), path.parent)
    project = load_project(path)
    plant = Plant(project.site, project.families, "0")
    assert [one.unit_id for one in bus.drives] == list(plant.by_unit) == [3]
    assert {one.name: one.unit_id for one in plant.devices.values()} == {"shaft": 2, "other": 1}
