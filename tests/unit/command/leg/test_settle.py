"""The end of each step."""

from __future__ import annotations

from bridge.command.leg.event import Time
from bridge.command.leg.settle import look_at_way
from bridge.command.leg.state import Motion, Stage
from bridge.drive import DriveState
from tests.support.leg import RUN, SHUT, SHUT_DOWN, Leg, draft_of, running_nord, settings_of, told


def test_motion_begins_with_the_first_enabling_word() -> None:
    leg = Leg(settings_of("nord/sk-tu4-cao", fieldbus_timeout_ms=200))
    leg.writes(SHUT_DOWN)
    leg.says(DriveState.READY)
    leg.writes(RUN)
    assert leg.state.motion is Motion.EXPECTED


def test_a_way_that_is_closed_closes_the_leg_and_one_that_opens_interlocks_it() -> None:
    leg = running_nord()
    draft = draft_of(leg)
    draft.way = SHUT
    look_at_way(draft)
    assert draft.stage is Stage.CLOSED
    draft.way = leg.state.way
    look_at_way(draft)
    assert draft.stage is Stage.INTERLOCKED


def test_a_position_that_is_not_taken_in_time_is_told() -> None:
    leg = Leg(settings_of("cia402/profile-position"))
    leg.says(DriveState.READY)
    leg.writes(0x0006)
    leg.writes(0x002F, position=5000)
    leg.says(DriveState.OPERATION_ENABLED)
    assert leg.sent & 0x0010
    leg.now += 1.0
    leg.happens(Time())
    (said,) = told(leg.effects)
    assert said == "the drive has not taken the position that was written: no answer within 1 s"
