"""What a drive says of itself: faults by emergency, by asking, by the bridge; which one is shown."""

from __future__ import annotations

import pytest

from bridge.command.status import DriveStatus
from bridge.drive import DriveState, EmergencyMeaning, EmergencyReader, Explained
from bridge.mapping import load_family
from bridge.text import Text

NORD = load_family("nord/sk-tu4-cao")
FAULT, ENABLED = DriveState.FAULT, DriveState.OPERATION_ENABLED


def emergency(code: int) -> EmergencyMeaning:
    return EmergencyReader(NORD).read(code, bytes(5))


@pytest.fixture
def status() -> DriveStatus:
    return DriveStatus(NORD)


def test_without_anything_there_is_no_fault(status: DriveStatus) -> None:
    assert str(status.fault_said(0.0, ENABLED)) == ""
    assert str(status.last_fault_said) == ""
    assert (status.drive_fault, status.last_fault, status.emcy_code) == (0.0, 0.0, 0)
    assert (status.word, status.link_fault) == (0, 0.0)
    assert status.fault(0.0, FAULT) == Explained()


def test_a_drive_in_fault_that_says_no_more_has_a_fault(status: DriveStatus) -> None:
    assert str(status.fault_said(0.0, FAULT)) == "fault"


def test_an_emergency_explains_the_fault_until_it_is_gone(status: DriveStatus) -> None:
    status.on_emcy(emergency(0x2310))
    assert status.emcy_code == 0x2310
    assert str(status.fault_said(0.0, FAULT)) == emergency(0x2310).text
    assert str(status.fault_said(0.0, ENABLED)) == "", "an emergency alone is no state"
    status.on_emcy(emergency(0x0000))
    assert (status.emcy_code, str(status.fault_said(0.0, FAULT))) == (0, "fault")


def test_the_drives_own_number_is_shown_in_any_state(status: DriveStatus) -> None:
    assert status.on_drive_fault(3.0, None)
    assert str(status.fault_said(0.0, FAULT)) == "E003/3.0 overcurrent of the inverter"
    assert str(status.fault_said(0.0, ENABLED)) == "E003/3.0 overcurrent of the inverter"
    facts = {"number": "E003/3.0", "text": "overcurrent of the inverter"}
    assert status.fault_said(0.0, FAULT) == status.last_fault_said == Text.of("fault.numbered", **facts)


def test_an_emergency_has_its_cause_and_remedy_while_the_drive_is_in_fault(status: DriveStatus) -> None:
    status.on_emcy(emergency(0x2310))
    assert "overcurrent" in str(status.fault(0.0, FAULT))
    assert status.fault(0.0, ENABLED) == Explained()


def test_the_bridges_own_fault_comes_first(status: DriveStatus) -> None:
    status.on_drive_fault(3.0, None)
    assert "3.0 " not in str(status.fault_said(10.3, FAULT))
    assert "10.3" in str(status.fault_said(10.3, FAULT))


def test_only_what_changes_something_is_news(status: DriveStatus) -> None:
    assert not status.on_drive_fault(0.0, None)
    assert not status.on_drive_fault(None, None)
    assert status.on_drive_fault(3.0, None)
    assert not status.on_drive_fault(3.0, None)
    assert status.on_drive_fault(0.0, None)


def test_of_the_last_faults_that_bridge_and_drive_tell_the_newest_counts(status: DriveStatus) -> None:
    status.on_drive_fault(None, 4.0)
    assert status.last_fault == 4.0
    status.last_fault = 10.3
    status.on_drive_fault(None, 4.0)
    assert status.last_fault == 10.3, "the drive has told this one before"
    status.on_drive_fault(3.0, None)
    assert status.last_fault == 3.0
    status.on_drive_fault(0.0, None)
    assert status.last_fault == 3.0, "no fault is no last fault"
    assert str(status.last_fault_said) == "E003/3.0 overcurrent of the inverter"
