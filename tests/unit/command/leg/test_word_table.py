"""Which words a drive gets in each stage, and the table that says so."""

from __future__ import annotations

import pytest

from bridge.command import Action
from bridge.command.leg.event import StopsOnSilence
from bridge.command.leg.state import ANY_TRIP, Motion, Stage
from bridge.command.leg.word_table import (
    MAY_HOLD,
    WORD_TABLE,
    WordChoice,
    WordRule,
    at_rest,
    control_word,
)
from bridge.drive import DriveState
from tests.support.leg import ACKNOWLEDGE, RUN, SHUT_DOWN, Leg, running_nord, settings_of


def test_every_stage_and_motion_has_its_words() -> None:
    assert WORD_TABLE.keys() == {(stage, motion) for stage in Stage for motion in Motion}
    assert {sends.word for sends in WORD_TABLE.values()} == set(WordChoice)


@pytest.mark.parametrize("motion", Motion)
def test_only_a_drive_that_may_move_is_held(motion: Motion) -> None:
    is_moving = motion in (Motion.EXPECTED, Motion.SEEN)
    assert MAY_HOLD[motion] is is_moving
    for stage in set(Stage) - {Stage.HELD}:
        assert WORD_TABLE[stage, motion].may_hold is is_moving


def test_what_enables_is_the_owners_or_was_sent_before_a_trip_that_holds() -> None:
    may_enable = (WordChoice.WRITTEN, WordChoice.BEFORE)
    stages = {stage for (stage, _), sends in WORD_TABLE.items() if sends.word in may_enable}
    assert stages.isdisjoint({Stage.CLOSED, Stage.INTERLOCKED, *ANY_TRIP} - {Stage.HELD})
    assert WORD_TABLE[Stage.HELD, Motion.SEEN] == WordRule(WordChoice.BEFORE, may_hold=True)


@pytest.mark.parametrize(
    ("reaction", "sent", "at_last"),
    [
        ("disable_voltage", 0x0474, 0x0474),
        ("quick_stop", 0x047B, 0x0470),
        ("stop", 0x047E, 0x047E),
        ("hold", 0x047F, 0x047F),
    ],
)
def test_each_reaction_sends_its_stop(reaction: str, sent: int, at_last: int) -> None:
    """BU 2500 §6.5.1: bit 0 off is a ramp, bit 2 off the quick stop, bit 1 off disables the voltage."""
    leg = running_nord(on_expiry=reaction)
    assert leg.trips() == sent
    leg.says(DriveState.READY)
    assert leg.sent == at_last
    assert leg.setpoints == ((0x2000, 0, 0, 0) if reaction == "hold" else (0, 0, 0, 0))


def test_silence_that_stops_nothing_is_disable_voltage() -> None:
    leg = running_nord(on_expiry="silence")
    leg.trips()
    assert leg.state.sent.silent
    leg.happens(StopsOnSilence(stops=False))
    assert not leg.state.sent.silent
    assert leg.sent & 0x0002 == 0


def test_a_stop_holds_a_motor_that_may_turn_and_none_that_stands() -> None:
    """Lenze's stop is its quick stop, which energises the motor while bit 3 is on."""
    enable_operation = 0x0008
    leg = Leg(settings_of("lenze/8400-motec", on_expiry="stop", fieldbus_timeout_ms=200))
    leg.writes(0x0001)
    leg.writes(0x0009)
    leg.says(DriveState.OPERATION_ENABLED)
    assert leg.trips() & enable_operation
    assert leg.says(DriveState.READY) & enable_operation == 0
    leg.asks(Action.RESET_FAULT)
    assert leg.sent & enable_operation == 0


def test_a_stop_of_some_kind_stays_as_it_is_and_an_enabling_word_becomes_one() -> None:
    words = running_nord().settings.words
    assert at_rest(words, SHUT_DOWN) == SHUT_DOWN
    assert not words.enables(at_rest(words, RUN))
    assert at_rest(words, SHUT_DOWN | ACKNOWLEDGE) == SHUT_DOWN, "without the acknowledge"


@pytest.mark.parametrize("bit", [None, False, True])
def test_the_acknowledge_bit_is_always_as_the_owner_wrote_it(bit: bool | None) -> None:
    leg = running_nord()
    state = leg.state._replace(edges=leg.state.edges._replace(bit=bit), word=SHUT_DOWN)
    assert control_word(leg.settings.words, state) == SHUT_DOWN | (ACKNOWLEDGE if bit else 0)
