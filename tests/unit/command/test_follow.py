"""Setpoints that follow the actual position until the drive is enabled and commanded."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import pytest

from bridge.command import Action, Start, Write
from bridge.command.leg.event import ActualWords
from bridge.command.messages.telegram import Telegram
from bridge.config import Reaction
from bridge.drive import DriveState
from tests.support.leg import Leg, settings_of

SHUTDOWN, RUN, STOP = 0x0006, 0x000F, 0x0007
AT, ELSEWHERE = (0x1111, 0x0001), (0x2222, 0x0002)


def telegram(values: Mapping[str, Any], kept: tuple[int, ...], control_word: int, is_heard: bool) -> Telegram:
    """Decoded: all setpoints at once."""
    return Telegram(values.get("control_word"), values["setpoints"])


class Axis(Leg):
    """The third setpoint follows nothing."""

    def __init__(self, reaction: Reaction = "stop", follows: tuple[tuple[int, int], ...] = ((0, 1), (1, 2))):
        given = settings_of("cia402/cyclic-position", on_expiry=reaction, fieldbus_timeout_ms=1000)
        super().__init__(replace(given, decode=telegram, setpoints=3, resting=(), follows=follows))

    def stands(self, place: tuple[int, int]) -> tuple[int, ...]:
        """What is sent to a drive whose position is this."""
        self.happens(ActualWords((0, *place)))
        return self.state.sent.words

    def write(self, word: int | None, *setpoints: int) -> tuple[int, ...]:
        values: dict[str, Any] = {"setpoints": setpoints}
        self.asks(Write(values if word is None else {**values, "control_word": word}))
        return self.state.sent.words


def at(place: tuple[int, int], reaction: Reaction = "stop") -> Axis:
    axis = Axis(reaction)
    axis.stands(place)
    return axis


def enabled(place: tuple[int, int], reaction: Reaction = "stop") -> Axis:
    axis = at(place, reaction)
    axis.write(SHUTDOWN, 0, 0, 0)
    axis.write(RUN, 0, 0, 0)
    axis.says(DriveState.OPERATION_ENABLED)
    return axis


def test_at_rest_the_drives_own_position_is_sent() -> None:
    axis = Axis()
    assert axis.stands(AT) == (0, *AT, 0)
    assert axis.stands(ELSEWHERE) == (0, *ELSEWHERE, 0)
    before = axis.state
    axis.stands(ELSEWHERE)
    assert axis.state is before, "nothing new"


def test_what_is_written_before_the_drive_is_enabled_does_not_count() -> None:
    axis = at(AT)
    assert axis.write(SHUTDOWN, 7, 7, 7) == (SHUTDOWN, *AT, 7)
    assert axis.write(RUN, 7, 7, 7) == (RUN, *AT, 7)
    axis.says(DriveState.OPERATION_ENABLED)
    assert axis.state.sent.words == (RUN, *AT, 7)
    assert axis.write(None, 8, 8, 8) == (RUN, 8, 8, 8)


def test_enabled_it_follows_no_more() -> None:
    axis = enabled(AT)
    axis.write(None, 8, 0, 0)
    assert axis.stands(ELSEWHERE) == (RUN, 8, 0, 0)


def test_a_stop_makes_it_follow_although_the_drive_is_still_enabled() -> None:
    """While it brakes: an enable before it has come to rest must not lead back to where it was."""
    axis = enabled(AT)
    axis.write(None, 8, 0, 0)
    axis.write(STOP, 8, 0, 0)
    assert axis.stands(ELSEWHERE) == (STOP, *ELSEWHERE, 0)
    assert axis.write(RUN, 8, 0, 0) == (RUN, *ELSEWHERE, 0)


def test_a_start_goes_to_no_place_that_was_written_before_the_stop() -> None:
    axis = enabled(AT)
    axis.write(None, 8, 0, 0)
    assert axis.write(STOP, 8, 0, 0) == (STOP, 8, 0, 0)
    axis.asks(Start())
    assert axis.state.sent.words == (STOP, *AT, 0)
    axis.says(DriveState.OPERATION_ENABLED, 0.2)
    assert axis.state.sent.words == (RUN, *AT, 0)


def test_leaving_the_state_makes_it_follow() -> None:
    axis = enabled(AT)
    axis.write(None, 8, 0, 0)
    axis.says(DriveState.FAULT)
    assert axis.stands(ELSEWHERE) == (RUN, *ELSEWHERE, 0)


@pytest.mark.parametrize("reaction", ["stop", "quick_stop", "disable_voltage"])
def test_a_trip_sends_the_position_and_no_zero(reaction: Reaction) -> None:
    axis = enabled(AT, reaction)
    axis.write(None, 8, 8, 8)
    axis.stands(ELSEWHERE)
    axis.trips()
    assert axis.setpoints == (*ELSEWHERE, 0)
    axis.asks(Action.RESET_FAULT)
    assert axis.setpoints == (*ELSEWHERE, 0)


def test_without_followers_setpoints_at_rest_are_zero() -> None:
    axis = Axis(follows=())
    axis.stands(AT)
    assert axis.write(SHUTDOWN, 5, 6, 0) == (SHUTDOWN, 5, 6, 0)
    axis.asks(Action.STOP)
    assert axis.setpoints == (0, 0, 0)


def test_a_drive_that_falls_out_of_operation_does_not_come_back_with_a_jump() -> None:
    """It may stand where it was before, and be enabled anew by the word that is on the bus."""
    axis = enabled(AT)
    axis.write(None, 8, 0, 0)
    axis.says(DriveState.READY)
    assert axis.state.sent.words == (RUN, *AT, 0)
