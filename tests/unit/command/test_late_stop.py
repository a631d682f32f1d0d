"""The owner's control word that stops, however long it has waited: a stop, and nothing else
(docs/explanation/dead-man-chain.md, "What fresh means")."""

from __future__ import annotations

from typing import get_args

import pytest

from bridge.command import Code, Outcome, Start, Write
from bridge.command.leg.effect import StartEnded
from bridge.config import Reaction
from bridge.drive import DriveState
from tests.support.leg import Leg, settings_of
from tests.support.leg_words import LENZE
from tests.support.outcomes import in_english

SHUT_DOWN, RUN, ACKNOWLEDGE = 0x047E, 0x047F, 0x0080
"""NORD's (BU 2500 §6.5.1, §6.8)."""
LATE_S = 60.0


class Drive(Leg):
    def __init__(self, mapping: str = "nord/sk-tu4-cao", on_expiry: str = "stop") -> None:
        super().__init__(settings_of(mapping, fieldbus_timeout_ms=1000, on_expiry=on_expiry))

    def runs(self) -> None:
        self.says(DriveState.READY)
        self.writes(self.settings.words.ready)
        self.writes(self.settings.words.run, setpoint_1=0x2000)
        self.says(DriveState.OPERATION_ENABLED)
        assert self.enables

    def late(self, word: int) -> int:
        return self.asks(Write({"control_word": word, "setpoint_1": 0x1000}), received_at=self.now - LATE_S)


@pytest.fixture
def drive() -> Drive:
    drive = Drive()
    drive.runs()
    return drive


def test_it_is_sent_without_setpoints_and_is_no_sign_of_life(drive: Drive):
    assert drive.late(SHUT_DOWN) == SHUT_DOWN
    assert in_english(drive.outcome) == Outcome(Code.OK, "came late, and counts as a stop only")
    assert not any(drive.setpoints)
    assert drive.state.timer.deadline == 101.0
    drive.writes(RUN)
    assert not drive.outcome.forwarded, "the owner has to stop it anew, in time"


def test_it_is_a_stop_that_was_asked_for():
    """Lenze's holds the motor: it stays as it is when the drive stands."""
    drive = Drive(LENZE.mapping)
    drive.runs()
    stop = drive.settings.words.stop(drive.sent)
    assert drive.late(stop) == stop
    assert drive.says(DriveState.READY) == stop


@pytest.mark.parametrize("is_set", [True, False])
def test_it_makes_no_edge_of_the_acknowledge_bit(drive: Drive, is_set: bool):
    was = RUN | ACKNOWLEDGE if is_set else RUN
    drive.writes(was)
    stop = SHUT_DOWN | was & ACKNOWLEDGE
    for word in (SHUT_DOWN | ACKNOWLEDGE, SHUT_DOWN):
        assert drive.late(word) == stop
    assert drive.writes(stop) == stop


@pytest.mark.parametrize("on_expiry", sorted(set(get_args(Reaction)) - {"hold"}))
def test_to_a_drive_that_is_being_stopped_it_is_not_forwarded(on_expiry: str):
    drive = Drive(on_expiry=on_expiry)
    drive.runs()
    drive.trips()
    before = drive.state.sent
    drive.late(SHUT_DOWN)
    assert in_english(drive.outcome) == Outcome(Code.OK, "tripped: acknowledge first", forwarded=False)
    assert drive.state.sent == before


def test_what_is_held_is_stopped_by_it():
    drive = Drive(on_expiry="hold")
    drive.runs()
    assert drive.trips() == RUN
    assert drive.late(SHUT_DOWN) == SHUT_DOWN
    assert drive.outcome.forwarded
    assert drive.state.stage.is_tripped


def test_it_ends_a_start(drive: Drive):
    drive.writes(SHUT_DOWN)
    drive.says(DriveState.SWITCH_ON_INHIBITED)
    drive.asks(Start())
    drive.late(SHUT_DOWN)
    assert [effect.outcome.code for effect in drive.effects if isinstance(effect, StartEnded)] == [
        Code.CANCELLED
    ]
    drive.says(DriveState.READY)
    assert not drive.enables
