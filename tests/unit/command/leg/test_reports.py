"""Reports: what a drive says of its motion and of where it is."""

from __future__ import annotations

import pytest

from bridge.command.leg import reports
from bridge.command.leg.event import ActualWords, StartAnew
from bridge.command.leg.state import Motion
from bridge.drive import DriveState
from tests.support.leg import Leg, draft_of, running_nord, settings_of


@pytest.mark.parametrize(
    ("before", "after"),
    [
        (Motion.EXPECTED, Motion.SEEN),
        (Motion.SEEN, Motion.SEEN),
        (Motion.FAULTED, Motion.ENDED),
        (Motion.ENDED, Motion.ENDED),
    ],
)
def test_once_told_anew_nothing_that_was_sent_before_is_awaited(before: Motion, after: Motion) -> None:
    draft = draft_of(running_nord())
    draft.motion = before
    reports.on_told_anew(draft)
    assert draft.motion is after


def test_motion_is_seen_and_ends() -> None:
    leg = running_nord()
    assert leg.state.motion is Motion.SEEN
    leg.says(DriveState.QUICK_STOP_ACTIVE)
    assert leg.state.motion is Motion.SEEN
    leg.says(DriveState.READY)
    assert leg.state.motion is Motion.ENDED


def test_a_bus_that_is_back_expects_no_late_motion() -> None:
    leg = running_nord()
    leg.happens(StartAnew())
    assert not leg.enables
    assert leg.state.motion is Motion.SEEN


def test_setpoints_of_a_drive_that_nobody_commands_follow_it() -> None:
    leg = Leg(settings_of("cia402/cyclic-position"))
    leg.says(DriveState.READY)
    leg.happens(ActualWords((0x0231, 0x2222, 0x0002)))
    assert leg.setpoints == (0x2222, 0x0002)
