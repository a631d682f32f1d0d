"""Events in the log: their level by severity, one line for each kind and source."""

from __future__ import annotations

import logging

import pytest

from bridge.command import Event, EventKind
from bridge.service.event_log import log_event


@pytest.mark.parametrize(
    ("severity", "level"),
    [(1, "INFO"), (299, "INFO"), (300, "WARNING"), (699, "WARNING"), (700, "ERROR"), (1000, "ERROR")],
)
def test_an_event_has_a_level_by_its_severity(
    severity: int, level: str, caplog: pytest.LogCaptureFixture
) -> None:
    """OPC UA Part 5 §6.4.2: 1 … 1000."""
    with caplog.at_level(logging.INFO, "bridge.events"):
        log_event(Event(10.0, EventKind.WATCHDOG, "conveyor/fu1", severity, "tripped"))
    (record,) = caplog.records
    assert (record.levelname, record.getMessage()) == (level, "conveyor/fu1: tripped")


def test_a_trip_and_its_acknowledgement_do_not_hide_each_other(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.INFO, "bridge.events"):
        for severity in (700, 300):
            log_event(Event(10.0, EventKind.WATCHDOG, "conveyor/fu1", severity, "x"))
        log_event(Event(10.0, EventKind.OWNER, "conveyor/fu1", 300, "x"))
    kinds = [record.__dict__["line_kind"] for record in caplog.records]
    assert len(set(kinds)) == 3
    assert {record.__dict__["line_source"] for record in caplog.records} == {"conveyor/fu1"}
