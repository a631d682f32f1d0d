"""Drives as the witness knows them, compared with the bridge's: two hands wrote the two."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from bridge.catalogue import Catalogue
from bridge.config import DriveTable, load_site
from bridge.drive import ControlWords, DriveState, StatusWords
from bridge.lint import lint
from bridge.mapping import load_family
from bridge.mapping.loader import family_names
from bridge.project import load_project
from bridge.witness.plan import (
    EnableWord,
    Speed,
    UnknownFamily,
    WatchedBus,
    WatchedDrive,
    WatchedOutputs,
    plan,
)
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


@pytest.mark.landing(13)
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


@pytest.mark.landing(4)
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


@pytest.mark.landing(5)
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
    catalogue = Catalogue.of(project.site, project.families)
    assert [one.unit_id for one in bus.drives] == [one.unit_id for one in catalogue.drives.values()] == [3]
    assert {one.name: one.unit_id for one in catalogue.devices.values()} == {"shaft": 2, "other": 1}


def bus_of(folder: Path, node: str, more: str = "", *, own: int | None = None) -> WatchedBus:
    path = sites.write(folder, sites.bus(node, more=more), sites.modbus(0))
    (bus,) = plan(load_site(path), folder, own_timeout_ms=own)
    return bus


FU1 = sites.drive("fu1", "modbus", 200)


def test_a_frame_that_is_too_short_has_no_speed() -> None:
    assert Speed(2, 2).of(b"\x37\x0b\x00") is None


def test_a_speed_has_a_sign() -> None:
    assert Speed(2, 2).of(bytes.fromhex("37 0B FE FF 01")) == -2


@pytest.mark.parametrize("mapping", ["cia402/acme", "cia402/velocity"])
def test_every_mapping_of_a_folder_is_its_family(tmp_path: Path, mapping: str) -> None:
    assert watched(tmp_path, mapping, "drive").status.mask == 0x006F


@pytest.mark.parametrize("mapping", ["nord/sk-tu4-cao-mine", "acme/cia402/"])
def test_a_name_that_only_begins_like_a_family_is_none(tmp_path: Path, mapping: str) -> None:
    with pytest.raises(UnknownFamily):
        watched(tmp_path, mapping, "fu1")


def test_a_node_that_is_not_used_has_no_drives(tmp_path: Path) -> None:
    assert not bus_of(tmp_path, sites.node(FU1, more="enabled = false")).drives


@pytest.mark.parametrize(("sync", "heartbeat"), [(10, 0), (0, 100), (20, 50)])
def test_what_the_bridge_sends_alone_is_watched(tmp_path: Path, sync: int, heartbeat: int) -> None:
    bus = bus_of(
        tmp_path,
        sites.node(FU1),
        f"sync_period_ms = {sync}\nheartbeat_ms = {heartbeat}\nmaster_node_id = 126",
    )
    assert {can_id: period for can_id, (_, period) in bus.beats.items()} == {
        can_id: period for can_id, period in ((0x080, sync), (0x77E, heartbeat)) if period
    }


def test_what_the_bridge_does_not_send_is_not_watched(tmp_path: Path) -> None:
    assert not bus_of(tmp_path, sites.node(FU1), "sync_period_ms = 0\nheartbeat_ms = 0").beats


def test_a_time_out_that_nobody_may_set_is_the_sites(tmp_path: Path) -> None:
    assert watched(tmp_path, "nord/sk-tu4-cao", "fu1").timeout_ms == 200


@pytest.mark.parametrize(
    ("node", "drive", "own", "silent_ms"),
    [
        ("", "", None, 0),
        ("", "", 500, 1000),
        ("own_timeout_ms = 400", "", 500, 900),
        ("own_timeout_ms = 400", "tpdo = { event_ms = 50 }", None, 450),
        ("own_timeout_ms = 400", "tpdo_deadline_ms = 70", None, 470),
        ("own_timeout_ms = 400", "tpdo = [{ event_ms = 50 }, { number = 2, event_ms = 90 }]", None, 490),
        ("own_timeout_ms = 400", "tpdo = { transmission_type = 1 }\ntpdo_deadline_ms = 70", None, 470),
    ],
)
def test_after_what_time_a_drive_stops_by_itself(
    tmp_path: Path, node: str, drive: str, own: int | None, silent_ms: int
) -> None:
    """One TPDO later that is seen."""
    bus = bus_of(tmp_path, sites.node(sites.drive("fu1", "modbus", 200, drive), more=node), own=own)
    assert bus.drives[0].silent_ms == silent_ms


@pytest.mark.parametrize(
    ("node", "drive", "lost_ms"),
    [
        ("supervision_ms = 300", "", 1300),
        ("supervision_ms = 300\nlife_time_factor = 4", "", 1300),
        ('supervision = "guarding"\nsupervision_ms = 300\nlife_time_factor = 4', "", 2200),
        ('supervision = "none"', "tpdo = { event_ms = 50 }", 1150),
        ('supervision = "none"', "tpdo = { transmission_type = 1 }", 0),
    ],
)
def test_after_what_time_a_drive_is_cut_off(tmp_path: Path, node: str, drive: str, lost_ms: int) -> None:
    bus = bus_of(tmp_path, sites.node(sites.drive("fu1", "modbus", 200, drive), more=node))
    assert bus.drives[0].lost_ms == lost_ms


def test_drives_are_called_as_the_bridge_calls_them(tmp_path: Path) -> None:
    named = sites.drive("fu2", "modbus", 200, 'name = "lift"')
    assert [one.name for one in bus_of(tmp_path, sites.node(FU1, named)).drives] == [
        "conveyor/fu1",
        "conveyor/lift",
    ]
    assert [one.name for one in bus_of(tmp_path, sites.node(FU1)).drives] == ["conveyor/fu1"]


@pytest.mark.parametrize("mapping", family_names())
def test_a_single_drive_is_called_as_the_bridge_calls_it(tmp_path: Path, mapping: str) -> None:
    family = sites.family(mapping)
    if not family.slot:
        return
    drive = DriveTable.model_validate({"slot": family.slot[0].name, "control": "modbus"})
    ours = f"conveyor/{family.leaf_of(drive)}"
    assert watched(tmp_path, mapping, family.slot[0].name).name == ours


@pytest.mark.parametrize(
    ("mapping", "slot", "stops"), [("nord/sk-tu4-cao", "fu1", False), ("cia402/velocity", "drive", True)]
)
def test_which_drives_nmt_stops(tmp_path: Path, mapping: str, slot: str, stops: bool) -> None:
    assert watched(tmp_path, mapping, slot).nmt_stops is stops


@pytest.mark.parametrize(
    ("mapping", "slot", "speed"),
    [
        ("nord/sk-tu4-cao", "fu1", Speed(2, 2)),
        ("nord/sk-tu4-cao-posicon", "fu1", None),
        ("cia402/profile-velocity", "drive", Speed(2, 4)),
    ],
)
def test_which_drives_tell_their_speed(tmp_path: Path, mapping: str, slot: str, speed: Speed | None) -> None:
    assert watched(tmp_path, mapping, slot).speed == speed


def beside_ms(folder: Path, *nodes: str, more: str = "") -> int:
    found = bus_of(folder, "".join(nodes), more).drives[0].beside_ms
    assert found is not None
    return found


def test_nodes_that_are_not_used_send_nothing(tmp_path: Path) -> None:
    unused = sites.node(FU1, name="spare", node_id=6, more="enabled = false")
    assert beside_ms(tmp_path, sites.node(FU1), unused) == beside_ms(tmp_path, sites.node(FU1))


def test_a_full_bus_is_reckoned_with_to_an_end(tmp_path: Path) -> None:
    """Five frames of 13.5 ms for the bus, the node and the drive, on a fifth of it."""
    rate = "bitrate = 10000\nsync_period_ms = 10"
    assert beside_ms(tmp_path, sites.node(FU1), more=rate) == 2 * 10 + 20 + 15 * 13.5 / 0.2 + 0.5
    assert (
        beside_ms(tmp_path, sites.node(FU1), more="bitrate = 10000\nsync_period_ms = 100\ndeadman_ms = 300")
        == 498
    )


def test_a_foreign_interface_has_a_queue(tmp_path: Path) -> None:
    tables = [
        sites.bus(sites.node(FU1), interface=name, more='channel = "x"') for name in ("socketcan", "pcan")
    ]
    own, foreign = (
        plan(load_site(sites.write(tmp_path, table, sites.modbus(0))), tmp_path)[0].drives[0].beside_ms
        for table in tables
    )
    assert own is not None and foreign == own + 50


def test_the_identifiers_of_the_site_file_count_where_it_has_them(tmp_path: Path) -> None:
    drive = watched(tmp_path, "nord/sk-tu4-cao", "fu1", "tpdo = { event_ms = 100 }")
    assert drive.tpdo == 0x185


def test_a_drive_is_held_to_what_is_known_of_its_times() -> None:
    word = EnableWord(0, 2, 0x0F, 0x0F)
    known = WatchedDrive("a/drive", 1, 0x205, 0x185, word, word, 200, 100, 500, 700)
    assert known.promise(has_numbers=True) == (
        "a/drive: dead controller: 300 ms, dead bridge: 500 ms, stop followed within 700 ms"
    )
    unknown = replace(known, silent_ms=0)
    assert unknown.promise(has_numbers=False) == (
        "a/drive: dead controller: not judged, dead bridge: 3000 ms (the drive's own time-out is not known, "
        "give --own-timeout-ms), stop followed within 700 ms"
    )


@pytest.mark.parametrize(
    ("changes", "has_numbers", "promise"),
    [
        ({}, True, "io: outputs: dead controller: 300 ms, dead bridge: 500 ms"),
        ({}, False, "io: outputs: dead controller: not judged, dead bridge: 500 ms"),
        ({"why_active": "they stay"}, True, "io: outputs: dead controller: 300 ms, dead bridge: they stay"),
        ({"why_unknown": "no file"}, True, "io: its outputs are not judged: no file"),
    ],
)
def test_outputs_are_held_to_what_is_known_of_them(
    changes: dict[str, str], has_numbers: bool, promise: str
) -> None:
    outputs = WatchedOutputs("io", 1, 20, timeout_ms=200, beside_ms=100, silent_ms=500)
    bus = WatchedBus("can", "can0", (), {}, outputs=(replace(outputs, **changes),))
    assert [one.promise(has_numbers=has_numbers) for one in bus.watched] == [promise]
    assert bus.written == {20: frozenset()}
