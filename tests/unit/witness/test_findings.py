"""Findings of the witness: whether a stop was in time."""

from __future__ import annotations

from dataclasses import FrozenInstanceError

import pytest

from bridge.witness.findings import Alarm, AlarmKind, Cause, Sight, Stop


@pytest.mark.parametrize(
    ("bus", "drive", "in_time"),
    [
        ((200, 210), (50, 60), True),
        ((210, 210), (60, 60), True),
        ((211, 210), (50, 60), False),
        ((200, 210), (61, 60), False),
        ((None, 210), (50, 60), True),
        ((900, None), (50, 60), True),
        ((None, None), (None, 60), True),
    ],
)
def test_a_stop_is_in_time_where_neither_of_its_times_is_beyond_its_bound(
    bus: tuple[int | None, int | None], drive: tuple[int | None, int | None], in_time: bool
) -> None:
    assert Stop("conveyor/fu1", Cause.CONTROLLER, 10.0, *bus, *drive).is_in_time is in_time


def test_findings_are_values() -> None:
    alarm = Alarm("can0", AlarmKind.INTRUDER, 10.0, "somebody")
    assert (
        len({alarm, Alarm("can0", AlarmKind.INTRUDER, 10.0, "somebody"), Sight("can0", 10.0, "somebody")})
        == 2
    )
    with pytest.raises(FrozenInstanceError):
        setattr(alarm, "source", "can1")  # noqa: B010
