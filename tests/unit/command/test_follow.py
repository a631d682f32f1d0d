"""Setpoints that follow the actual position until the drive is enabled and commanded."""

from __future__ import annotations

import pytest

from bridge.command.output import Gate
from bridge.config import Reaction
from bridge.drive import ControlWords, DriveState
from bridge.mapping import load_family

SHUTDOWN, RUN, STOP = 0x0006, 0x000F, 0x0007
WORDS = ControlWords(load_family("cia402/cyclic-position").control_word)
AT, ELSEWHERE = (0x1111, 0x0001), (0x2222, 0x0002)


def gate_at(place: tuple[int, int], reaction: Reaction = "stop") -> Gate:
    """The third setpoint follows nothing."""
    gate = Gate(WORDS, 3, reaction, 0, [(0, 1), (1, 2)])
    gate.follow((0, *place))
    gate.compute(0.0, may_enable=True)
    return gate


def write(gate: Gate, word: int | None, setpoints: tuple[int, int, int]) -> tuple[int, ...]:
    gate.take(word, setpoints, may_enable=True)
    return gate.compute(0.0, may_enable=True).words


def enabled(place: tuple[int, int], reaction: Reaction = "stop") -> Gate:
    gate = gate_at(place, reaction)
    write(gate, SHUTDOWN, (0, 0, 0))
    write(gate, RUN, (0, 0, 0))
    gate.on_state(DriveState.OPERATION_ENABLED)
    gate.compute(0.0, may_enable=True)
    return gate


def test_at_rest_the_drives_own_position_is_sent() -> None:
    gate = gate_at(AT)
    assert gate.sent.words == (0, *AT, 0)
    assert gate.follow((0, *ELSEWHERE))
    assert gate.compute(0.0, may_enable=True).words == (0, *ELSEWHERE, 0)
    assert not gate.follow((0, *ELSEWHERE)), "nothing new"


def test_what_is_written_before_the_drive_is_enabled_does_not_count() -> None:
    gate = gate_at(AT)
    assert write(gate, SHUTDOWN, (7, 7, 7)) == (SHUTDOWN, *AT, 7)
    assert write(gate, RUN, (7, 7, 7)) == (RUN, *AT, 7)
    gate.on_state(DriveState.OPERATION_ENABLED)
    assert gate.compute(0.0, may_enable=True).words == (RUN, *AT, 7)
    assert write(gate, None, (8, 8, 8)) == (RUN, 8, 8, 8)


def test_enabled_it_follows_no_more() -> None:
    gate = enabled(AT)
    write(gate, None, (8, 0, 0))
    assert not gate.follow((0, *ELSEWHERE))
    assert gate.setpoints == (8, 0, 0)


def test_a_stop_makes_it_follow_although_the_drive_is_still_enabled() -> None:
    """While it brakes: an enable before it has come to rest must not lead back to where it was."""
    gate = enabled(AT)
    write(gate, None, (8, 0, 0))
    write(gate, STOP, (8, 0, 0))
    assert gate.follow((0, *ELSEWHERE))
    assert write(gate, RUN, (8, 0, 0)) == (RUN, *ELSEWHERE, 0)


def test_leaving_the_state_makes_it_follow() -> None:
    gate = enabled(AT)
    write(gate, None, (8, 0, 0))
    gate.on_state(DriveState.FAULT)
    gate.follow((0, *ELSEWHERE))
    assert gate.compute(0.0, may_enable=True).words == (RUN, *ELSEWHERE, 0)


@pytest.mark.parametrize("reaction", ["stop", "quick_stop", "disable_voltage"])
def test_a_trip_sends_the_position_and_no_zero(reaction: Reaction) -> None:
    gate = enabled(AT, reaction)
    write(gate, None, (8, 8, 8))
    gate.follow((0, *ELSEWHERE))
    gate.trip(1.0)
    assert gate.compute(1.0, may_enable=True).words[1:] == (*ELSEWHERE, 0)
    gate.clear(2.0, DriveState.READY, pulse=False)
    assert gate.compute(2.0, may_enable=True).words[1:] == (*ELSEWHERE, 0)


def test_without_followers_setpoints_at_rest_are_zero() -> None:
    gate = Gate(WORDS, 2, "stop", 0)
    assert not gate.follow((0, 1, 2))
    assert write(gate, SHUTDOWN, (5, 6, 0)[:2]) == (SHUTDOWN, 5, 6)
    gate.stop(STOP)
    assert gate.compute(0.0, may_enable=True).words == (STOP, 0, 0)
