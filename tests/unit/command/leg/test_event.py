"""Events of a leg: values that do not change, and what they say where nothing is given."""

from __future__ import annotations

from dataclasses import FrozenInstanceError
from typing import get_args

import pytest

from bridge.command import Identity, Source
from bridge.command.leg.event import (
    ActualWords,
    BridgeGap,
    Connection,
    Event,
    NodeBack,
    StartAnew,
    StatusReport,
    StopsOnSilence,
    Time,
)
from bridge.command.leg.state import Way
from bridge.drive import DriveState

PLC = Identity(Source.MODBUS, "192.168.1.10")
EVENTS = (
    StatusReport(DriveState.OPERATION_ENABLED, False, ""),
    ActualWords((0x0231, 0)),
    Time(),
    NodeBack(),
    StartAnew(),
    BridgeGap(),
    StopsOnSilence(True),
    Connection(PLC, True),
    Way(is_open=True, why=""),
)


@pytest.mark.parametrize("event", EVENTS, ids=lambda event: type(event).__name__)
def test_an_event_is_a_value_that_a_table_can_be_asked_by(event: Event) -> None:
    """The exploration keeps them in sets."""
    assert isinstance(event, get_args(Event))
    assert len({event, event}) == 1


def test_an_event_does_not_change() -> None:
    with pytest.raises(FrozenInstanceError):
        setattr(Time(), "way", Way(is_open=True, why=""))  # noqa: B010


def test_two_of_a_kind_are_told_apart_by_what_they_say() -> None:
    assert Connection(PLC, True) != Connection(PLC, False)
    assert not Connection(PLC, True).has_others
    assert Time().way is None
    assert NodeBack() != StartAnew()
