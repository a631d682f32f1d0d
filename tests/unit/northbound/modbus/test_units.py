"""A client with a wrong unit id is told so, and not that somebody else has the drive."""

from __future__ import annotations

import logging

import pytest

from bridge.command import Code, Event, EventKind
from bridge.command.audit import AuditEntry
from bridge.text import Text, render
from tests.support.modbus_site import READY, Rig

SITE = "this site has 1-2, 9, and 255 for the bridge itself"


class Told:
    """A rig whose events and entries of the audit log are kept."""

    def __init__(self) -> None:
        self.rig = Rig()
        self.rig.runs(READY)
        self.events: list[Event] = []
        self.entries: list[AuditEntry] = []
        self.rig.plant.on_event(self.events.append)
        self.rig.plant.audit.tell_to(self.entries.append)

    @property
    def refusals(self) -> list[str]:
        return [event.message for event in self.events if event.kind is EventKind.REFUSED]


def test_a_write_to_a_unit_that_does_not_exist_names_those_that_do() -> None:
    told = Told()
    assert told.rig.write(0, 0x047E, unit=7) == 0x0A
    assert told.refusals == [
        f"write on 'unit 7' by modbus:10.0.0.5 refused: no drive or device has unit id 7; {SITE}"
    ]
    (entry,) = told.entries
    assert (entry.target, entry.ending.code) == ("unit 7", Code.UNKNOWN_TARGET)


@pytest.mark.parametrize("unit", [0, 255])
def test_a_write_to_the_bridges_own_unit_says_that_it_is_the_bridges(unit: int) -> None:
    """0 and 255 are what many controllers send where nobody sets a unit id."""
    told = Told()
    assert told.rig.write(0, 0x047E, unit=unit) == 0x01
    why = f"unit {unit} is the bridge itself, which is only read; {SITE}"
    assert told.refusals == [f"write on 'unit {unit}' by modbus:10.0.0.5 refused: {why}"]
    (entry,) = told.entries
    assert (entry.ending.code, entry.ending.message) == (Code.READ_ONLY, why)


def test_a_read_of_a_unit_that_does_not_exist_is_in_the_log(caplog: pytest.LogCaptureFixture) -> None:
    told = Told()
    assert told.rig.read(3, 0, 1, unit=7) == [-0x0A]
    (record,) = caplog.records
    assert record.levelno == logging.WARNING
    why = f"no drive or device has unit id 7; {SITE}"
    assert record.getMessage() == f"Modbus: 10.0.0.5:40001 is refused: {why}"
    assert (vars(record)["line_source"], vars(record)["line_kind"]) == ("10.0.0.5", 7), (
        "one line, then counts"
    )


@pytest.mark.parametrize("unit", [0, 7, 255])
def test_the_page_says_it_in_german(unit: int) -> None:
    told = Told()
    told.rig.write(0, 0x047E, unit=unit)
    (said,) = [event.said for event in told.events if event.kind is EventKind.REFUSED]
    assert isinstance(said, Text)
    assert isinstance(dict(said.facts)["why"], Text)
    assert render(said, "de").startswith(f"Schreiben an 'unit {unit}' von modbus:10.0.0.5 abgelehnt: ")
