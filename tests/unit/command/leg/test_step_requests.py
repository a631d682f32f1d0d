"""Requests: what they make of the leg, and that a refused one makes nothing of it."""

from __future__ import annotations

import pytest

from bridge.command import Action, Code, Identity, Role, Source, Start, Write
from bridge.command.leg import step
from bridge.command.leg.settle import settle
from bridge.command.leg.state import Stage
from bridge.command.messages.request import Command, Do, Request
from bridge.drive import DriveState
from tests.support.leg import PLC, SHUT_DOWN, Leg, draft_of, running_nord, settings_of

SHUTDOWN, OPERATION = 0x0006, 0x000F
"""CiA 402-2, control word."""
READER = Identity(Source.OPCUA, "reader", Role.OBSERVER)


@pytest.mark.parametrize("action", [Action.RESET_FAULT, Action.STOP])
def test_a_request_is_answered_once(action: Action) -> None:
    leg = running_nord()
    leg.asks(action)
    assert leg.outcome.ok


def test_an_acknowledge_leaves_the_trip_behind_the_interlock() -> None:
    leg = running_nord()
    leg.trips()
    draft = draft_of(leg)
    step._handle(draft, Request(PLC, "n/d", Do(Action.RESET_FAULT)))
    settle(draft)
    assert draft.stage is Stage.INTERLOCKED
    assert not draft.is_enabling
    assert draft.pulse_until is not None


def test_an_edge_in_the_owners_word_makes_no_pulse_of_the_bridges_own() -> None:
    leg = running_nord()
    leg.trips()
    leg.writes(SHUT_DOWN)
    leg.writes(SHUT_DOWN | 0x0080)
    assert leg.state.stage is Stage.INTERLOCKED
    assert leg.state.pulse_until is None


@pytest.mark.parametrize(
    ("who", "command", "code"),
    [
        (READER, Do(Action.STOP), Code.NOT_ALLOWED),
        (PLC, Write({"control_word": 0x0000}), Code.NOT_VALID),
        (PLC, Write({"control_word": 0x047F, "setpoint_1": 1e9}), Code.OUT_OF_RANGE),
        (PLC, Start(2), Code.OUT_OF_RANGE),
    ],
)
def test_a_refused_request_changes_nothing(who: Identity, command: Command, code: Code) -> None:
    leg = running_nord()
    before = leg.state
    leg.asks(command, who)
    assert leg.outcome.code is code
    assert leg.state is before


class TestADriveThatHasJustStoppedWhereNobodyKnows:
    """Its position was lost while it ran; its owner's stop has closed the way since the last event."""

    @pytest.fixture
    def leg(self) -> Leg:
        leg = Leg(settings_of("cia402/cyclic-position", fieldbus_timeout_ms=1000))
        leg.writes(SHUTDOWN)
        leg.writes(OPERATION)
        leg.says(DriveState.OPERATION_ENABLED)
        leg.happens(leg.state.way._replace(why_unplaced="its position is late"))
        leg.writes(SHUTDOWN)
        return leg

    def test_is_not_started(self, leg: Leg) -> None:
        heard = leg.state.timer
        leg.now += 0.5
        leg.asks(Start())
        assert (leg.outcome.code, leg.outcome.message) == (Code.NOT_READY, "its position is late")
        assert leg.state.timer == heard, "what is refused is no sign of life"

    def test_gets_no_setpoints(self, leg: Leg) -> None:
        leg.writes(position=0.0)
        assert leg.outcome.ok
        assert not leg.outcome.forwarded
        assert leg.outcome.message == "its position is late"


def test_a_refused_start_is_none_and_no_sign_of_life() -> None:
    leg = running_nord()
    leg.trips()
    before = leg.state
    leg.asks(Start())
    assert leg.outcome.code is Code.ACKNOWLEDGE_FIRST
    assert leg.state is before
    other = Leg(settings_of("nord/sk-tu4-cao"))
    other.says(DriveState.READY)
    other.happens(other.state.way._replace(why_unsent="the kernel refuses them"))
    before = other.state
    other.asks(Start())
    assert (other.outcome.code, other.outcome.message) == (Code.NOT_READY, "the kernel refuses them")
    assert other.state is before
