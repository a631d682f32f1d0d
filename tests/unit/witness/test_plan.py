"""What the witness knows of drives, held against what the bridge knows: two hands have written it."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.config import load_site
from bridge.drive import ControlWords, DriveState, StatusWords
from bridge.mapping import load_family
from bridge.mapping.loader import family_names
from bridge.witness.plan import UnknownFamily, WatchedDrive, plan
from tests.support import sites


def watched(folder: Path, mapping: str, slot: str, more: str = "") -> WatchedDrive:
    drive = sites.drive(slot, "modbus", 200, more)
    path = sites.write(folder, sites.bus(sites.node(drive, mapping=mapping)), sites.modbus(0))
    (bus,) = plan(load_site(path))
    (found,) = bus.drives
    return found


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


def test_a_family_that_it_does_not_know_is_named(tmp_path: Path) -> None:
    drive = sites.drive("drive", "modbus", 200, "")
    path = sites.write(tmp_path, sites.bus(sites.node(drive, mapping="acme/one")), sites.modbus(0))
    with pytest.raises(UnknownFamily, match="acme/one"):
        plan(load_site(path))


@pytest.mark.parametrize("key", ['on_expiry = "hold"', "telegram_downtime_s = -0.1"])
def test_where_no_stop_is_promised_none_is_expected(tmp_path: Path, key: str) -> None:
    assert watched(tmp_path, "nord/sk-tu4-cao", "fu1", key).stop_ms == 0


def test_units_are_counted_as_the_reference_says(tmp_path: Path) -> None:
    drives = [sites.drive("fu1", "modbus", 200, "unit_id = 2"), sites.drive("fu2", "modbus", 200, "")]
    drives += [sites.drive("fu3", "modbus", 200, "")]
    path = sites.write(tmp_path, sites.bus(sites.node(*drives)), sites.modbus(0))
    (bus,) = plan(load_site(path))
    assert [drive.unit_id for drive in bus.drives] == [2, 1, 3]
