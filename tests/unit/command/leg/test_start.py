"""``Start``: through the drive's states to operation enabled, with one outcome."""

from __future__ import annotations

import pytest

from bridge.command import Action, Code, Outcome, Request, Start
from bridge.command.drive_link import NodeState
from bridge.drive import DriveState
from tests.support.rig import (
    ENABLED,
    FAULT,
    FAULT_REACTION,
    INHIBITED,
    OPERATOR,
    OTHER_PLC,
    PLC,
    QUICK_STOPPING,
    READY,
    SHUT_DOWN,
    SWITCHED_ON,
    Rig,
    emergency,
)


@pytest.fixture
def rig() -> Rig:
    """An inhibited drive whose controller has time."""
    rig = Rig(fieldbus_timeout_ms=10_000)
    rig.node(NodeState.OPERATIONAL)
    rig.drive_says(INHIBITED)
    return rig


@pytest.fixture
def running() -> Rig:
    rig = Rig(fieldbus_timeout_ms=10_000)
    rig.run()
    return rig


UNKNOWN = 0x0B1A
"""Bits 6 … 0 of no state (BU 2500 §6.5.2)."""


def restart_the_node(rig: Rig) -> None:
    rig.wait(0.5)
    rig.node(NodeState.BOOTING)
    rig.node(NodeState.OPERATIONAL)


def is_led_from_inhibited(rig: Rig, outcomes: list[Outcome]) -> None:
    rig.drive_says(INHIBITED)
    assert rig.sent == SHUT_DOWN
    rig.drive_says(READY)
    assert rig.enables
    rig.drive_says(ENABLED)
    assert codes(outcomes) == [Code.OK]


def codes(outcomes: list[Outcome]) -> list[Code]:
    return [outcome.code for outcome in outcomes]


@pytest.mark.parametrize("steps", [(READY,), (READY, SWITCHED_ON), ()])
@pytest.mark.parametrize(("direction", "word"), [(0, 0x047F), (1, 0x0C7F), (-1, 0x147F)])
def test_leads_to_operation_enabled(rig: Rig, steps: tuple[int, ...], direction: int, word: int):
    outcomes = rig.submit(Action.START, direction=direction)
    assert rig.sent == SHUT_DOWN
    for step in steps:
        rig.drive_says(step)
        assert rig.sent == word
        assert outcomes == []
    rig.drive_says(ENABLED)
    assert rig.sent == word
    assert codes(outcomes) == [Code.OK]
    rig.wait(5)
    assert len(outcomes) == 1


def test_uses_the_setpoints_that_were_written_before(rig: Rig):
    rig.write(SHUT_DOWN, 0x1000)
    rig.submit(Action.START)
    rig.drive_says(READY)
    assert rig.sent_setpoints[0] == 0x1000


def test_is_a_telegram_and_makes_its_sender_the_owner(rig: Rig):
    rig.submit(Action.START)
    assert rig.watchdog == "running"
    assert rig.channel.owner is not None


def test_of_a_running_drive_is_done_at_once_and_changes_its_direction(running: Rig):
    assert codes(running.submit(Action.START, direction=-1)) == [Code.OK]
    assert running.sent == 0x147F


def test_after_a_stop_is_a_fresh_enable(rig: Rig):
    rig.submit(Action.START)
    rig.drive_says(READY)
    rig.drive_says(ENABLED)
    rig.ask(Action.STOP, OPERATOR)
    assert not rig.enables
    rig.drive_says(READY)
    rig.submit(Action.START)
    assert rig.enables


def test_right_after_disable_voltage_makes_the_drive_ready_that_is_about_to_be_inhibited(rig: Rig):
    rig.drive_says(READY)
    rig.ask(Action.DISABLE_VOLTAGE)
    outcomes = rig.submit(Action.START)  # before the drive has said what became of it
    is_led_from_inhibited(rig, outcomes)


@pytest.mark.parametrize("word", [FAULT, FAULT_REACTION])
def test_waits_after_a_fault_that_may_have_come_before_the_last_one_enabled(rig: Rig, word: int):
    rig.drive_says(READY)
    rig.submit(Action.START)
    rig.drive_says(word)
    rig.drive_says(READY)
    rig.submit(Action.START)
    assert not rig.enables
    rig.wait(0.2)
    rig.drive_says(READY)
    assert rig.enables


@pytest.mark.parametrize("action", [Action.STOP, Action.QUICK_STOP, Action.DISABLE_VOLTAGE])
def test_right_after_a_stop_of_a_running_drive_waits_for_what_becomes_of_it(running: Rig, action: Action):
    running.ask(action)
    stopping = running.sent
    outcomes = running.submit(Action.START)  # the drive's last word is still "enabled"
    assert (outcomes, running.sent) == ([], stopping)
    is_led_from_inhibited(running, outcomes)


def test_of_a_drive_on_its_ramp_lets_it_turn_again(running: Rig):
    running.write(SHUT_DOWN)
    outcomes = running.submit(Action.START)
    running.wait(0.19)
    running.drive_says(ENABLED)
    assert (outcomes, running.enables) == ([], False)
    running.wait(0.01)
    running.drive_says(ENABLED)
    assert running.enables
    assert codes(outcomes) == [Code.OK]


def test_of_a_drive_that_has_nothing_new_to_say_believes_its_last_word(running: Rig):
    running.write(SHUT_DOWN)
    outcomes = running.submit(Action.START)
    running.wait(0.999)
    assert (outcomes, running.enables) == ([], False)
    running.wait(0.001)
    assert running.enables
    assert codes(outcomes) == [Code.OK]


def test_asked_again_and_again_does_not_take_longer(running: Rig):
    running.write(SHUT_DOWN)
    for _ in range(3):
        running.submit(Action.START)
        running.wait(0.1)
    running.drive_says(ENABLED)
    assert running.enables


def test_after_a_restart_of_the_node_waits_for_what_the_drive_says(running: Rig):
    restart_the_node(running)
    outcomes = running.submit(Action.START)  # the last word is the one from before
    running.wait(0.9)
    assert (outcomes, running.enables) == ([], False)
    is_led_from_inhibited(running, outcomes)


def test_of_a_drive_that_says_the_same_as_before_its_node_restarted(rig: Rig):
    restart_the_node(rig)
    outcomes = rig.submit(Action.START)
    rig.wait(0.1)
    is_led_from_inhibited(rig, outcomes)


def test_of_a_drive_that_says_nothing_after_a_restart_makes_it_ready_and_enables_it(rig: Rig):
    """One that sends only changes: what it sent before its node was operational is lost."""
    restart_the_node(rig)
    outcomes = rig.submit(Action.START)
    rig.wait(0.999)
    assert not rig.enables
    rig.wait(0.001)
    assert rig.sent == SHUT_DOWN
    rig.wait(1.0)
    assert rig.enables
    assert outcomes == [], "nothing says so yet"
    rig.drive_says(ENABLED)
    assert codes(outcomes) == [Code.OK]


def test_of_a_drive_that_is_enabled_late_waits_for_what_becomes_of_the_stop(rig: Rig):
    rig.submit(Action.START)
    rig.drive_says(READY)
    assert rig.enables
    rig.ask(Action.DISABLE_VOLTAGE)
    outcomes = rig.submit(Action.START)
    assert not rig.enables
    for late in (SWITCHED_ON, ENABLED):  # by the first start
        rig.drive_says(late)
        assert (outcomes, rig.enables) == ([], False)
    is_led_from_inhibited(rig, outcomes)


def test_a_word_that_means_no_state_leads_to_nothing(running: Rig):
    running.ask(Action.QUICK_STOP)
    stopping = running.sent
    outcomes = running.submit(Action.START)
    running.drive_says(UNKNOWN)
    assert running.channel.state is DriveState.UNKNOWN
    running.wait(2.5)
    assert (outcomes, running.sent) == ([], stopping)


def test_asked_again_and_again_still_leads_out_of_a_quick_stop(rig: Rig):
    rig.drive_says(QUICK_STOPPING)
    rig.submit(Action.START)
    rig.wait(0.6)
    outcomes = rig.submit(Action.START)
    rig.wait(0.4)
    assert rig.sent & 0x0002 == 0, "disable voltage"
    is_led_from_inhibited(rig, outcomes)


def test_of_a_drive_that_was_released_while_it_turned_stops_it_first(running: Rig):
    running.ask(Action.RELEASE_CONTROL)
    outcomes = running.submit(Action.START)
    assert (outcomes, running.enables) == ([], False)
    running.drive_says(READY)
    assert running.enables
    running.drive_says(ENABLED)
    assert codes(outcomes) == [Code.OK]


def test_is_cancelled_by_a_restart_of_the_node_where_its_loss_is_ignored():
    rig = Rig(fieldbus_timeout_ms=10_000, telegram_downtime_s=-0.1)
    rig.run()
    rig.ask(Action.STOP)
    outcomes = rig.submit(Action.START)
    rig.node(NodeState.LOST)
    rig.node(NodeState.OPERATIONAL)
    assert codes(outcomes) == [Code.CANCELLED]
    rig.wait(1)
    assert not rig.enables


def test_of_a_drive_that_has_just_begun_its_quick_stop_leads_it_out_of_it(running: Rig):
    running.ask(Action.QUICK_STOP)
    outcomes = running.submit(Action.START)
    running.drive_says(QUICK_STOPPING)
    running.wait(0.9)
    assert running.sent & 0x0002, "the ramp of the quick stop is let run"
    running.wait(0.1)
    assert running.sent & 0x0002 == 0, "disable voltage"
    is_led_from_inhibited(running, outcomes)


def test_of_an_unheard_drive_in_its_quick_stop_lets_the_ramp_run(running: Rig):
    """It was running when its node restarted, and says only after the start that it is braking."""
    restart_the_node(running)
    outcomes = running.submit(Action.START)
    running.wait(0.5)
    running.drive_says(QUICK_STOPPING)
    running.wait(0.4)
    assert running.sent & 0x0002, "the ramp of the quick stop is let run"
    running.wait(0.1)
    assert running.sent & 0x0002 == 0, "disable voltage, 1 s after the start"
    is_led_from_inhibited(running, outcomes)


@pytest.mark.parametrize("direction", [2, -2])
def test_knows_two_directions(rig: Rig, direction: int):
    assert codes(rig.submit(Action.START, direction=direction)) == [Code.OUT_OF_RANGE]
    assert rig.channel.owner is None


def test_of_a_drive_in_fault_is_refused(rig: Rig):
    rig.drive_says(FAULT)
    assert codes(rig.submit(Action.START)) == [Code.ACKNOWLEDGE_FIRST]


def test_without_the_node_is_refused(rig: Rig):
    rig.node(NodeState.LOST)
    outcomes = rig.submit(Action.START)
    assert codes(outcomes) == [Code.NOT_READY]
    assert "node lost" in outcomes[0].message


def test_times_out_when_the_drive_does_not_follow(rig: Rig):
    outcomes = rig.submit(Action.START)
    rig.wait(2.999)
    assert outcomes == []
    rig.wait(0.001)
    assert codes(outcomes) == [Code.TIMED_OUT]
    assert "switch on inhibited" in outcomes[0].message
    rig.drive_says(READY)
    assert not rig.enables


@pytest.mark.parametrize("word", [FAULT, FAULT_REACTION])
def test_ends_when_the_drive_goes_into_fault(rig: Rig, word: int):
    outcomes = rig.submit(Action.START)
    rig.drive_says(READY)
    rig.channel.on_emcy(emergency(0x2310), rig.now)
    rig.drive_says(word)
    assert codes(outcomes) == [Code.NOT_READY]
    assert "overcurrent" in outcomes[0].message
    assert not rig.enables


@pytest.mark.parametrize("action", [Action.STOP, Action.QUICK_STOP, Action.DISABLE_VOLTAGE])
def test_is_cancelled_by_a_stop(rig: Rig, action: Action):
    outcomes = rig.submit(Action.START)
    rig.ask(action, OPERATOR)
    assert codes(outcomes) == [Code.CANCELLED]
    rig.drive_says(READY)
    assert not rig.enables


def test_is_cancelled_by_a_trip():
    rig = Rig()
    rig.node(NodeState.OPERATIONAL)
    rig.drive_says(INHIBITED)
    outcomes = rig.submit(Action.START)
    rig.wait(0.2)
    assert codes(outcomes) == [Code.CANCELLED]


def test_is_cancelled_by_a_release(rig: Rig):
    outcomes = rig.submit(Action.START)
    rig.ask(Action.RELEASE_CONTROL)
    assert codes(outcomes) == [Code.CANCELLED]


def test_is_cancelled_by_a_control_word_and_not_by_a_setpoint(rig: Rig):
    outcomes = rig.submit(Action.START)
    rig.write(None, 0x1000)
    assert outcomes == []
    rig.write(SHUT_DOWN)
    assert codes(outcomes) == [Code.CANCELLED]


def test_is_not_cancelled_by_a_refused_request(rig: Rig):
    outcomes = rig.submit(Action.START)
    rig.write(SHUT_DOWN, identity=OTHER_PLC)
    rig.write(0x0000)
    assert outcomes == []


def test_is_cancelled_by_another_start(rig: Rig):
    first = rig.submit(Action.START)
    second = rig.submit(Action.START, direction=1)
    assert codes(first) == [Code.CANCELLED]
    rig.drive_says(READY)
    rig.drive_says(ENABLED)
    assert codes(second) == [Code.OK]
    assert len(first) == 1


def test_is_cancelled_by_a_gap_of_the_bridge(rig: Rig):
    outcomes = rig.submit(Action.START)
    rig.channel.on_bridge_gap(rig.now)
    assert codes(outcomes) == [Code.CANCELLED]


@pytest.mark.parametrize("state", [NodeState.LOST, NodeState.BOOTING, NodeState.DISABLED])
def test_does_not_survive_the_node(rig: Rig, state: NodeState):
    outcomes = rig.submit(Action.START)
    rig.node(state)
    assert codes(outcomes) == [Code.NOT_READY]
    rig.node(NodeState.OPERATIONAL)
    rig.drive_says(READY)
    assert not rig.enables


def test_ends_when_process_data_are_missing(rig: Rig):
    rig.channel.link.pdo_deadline_s = 0.1
    outcomes = rig.submit(Action.START)
    rig.wait(0.6)
    assert codes(outcomes) == [Code.NOT_READY]


def test_who_asks_on_on_the_outcome_finds_everything_settled(rig: Rig):
    """An outcome is told last: a request made from it meets no half-done change."""
    seen: list[tuple[int, int]] = []

    def on_outcome(outcome: Outcome) -> None:
        seen.append((rig.sent, len(rig.submit(Action.KEEP_ALIVE))))

    rig.channel.handle(Request(PLC, "conveyor/fu1", Start()), rig.now, on_outcome)
    rig.drive_says(READY)
    rig.ask(Action.DISABLE_VOLTAGE, OPERATOR)
    assert seen == [(0x0474, 1)]


def test_a_drive_that_stays_in_quick_stop_is_led_out_of_it(rig: Rig):
    """605Ah = 5 … 8: the word to become ready leads out of *quick stop active* nowhere."""
    rig.drive_says(QUICK_STOPPING)
    before = rig.sent
    outcomes = rig.submit(Action.START)
    rig.wait(0.9)
    assert rig.sent == before, "the ramp of the quick stop is let run"
    rig.wait(0.2)
    assert rig.sent & 0x0002 == 0, "disable voltage"
    is_led_from_inhibited(rig, outcomes)


def test_a_quick_stop_that_ends_by_itself_is_not_cut_short(rig: Rig):
    rig.drive_says(QUICK_STOPPING)
    rig.submit(Action.START)
    rig.wait(0.5)
    rig.drive_says(INHIBITED)
    rig.wait(1.0)
    assert rig.sent == SHUT_DOWN
    rig.drive_says(READY)
    assert rig.enables


def test_a_drive_that_does_not_leave_the_quick_stop_is_told(rig: Rig):
    rig.drive_says(QUICK_STOPPING)
    outcomes = rig.submit(Action.START)
    rig.wait(3.0)
    assert codes(outcomes) == [Code.TIMED_OUT]
    assert "quick stop active" in outcomes[0].message


@pytest.mark.parametrize("how", ["the node has restarted", "the drive has to be enabled anew"])
def test_is_not_led_across_a_restart(how: str):
    """What the drive says afterwards is no answer to a start from before."""
    rig = Rig(telegram_downtime_s=-0.1, fieldbus_timeout_ms=0)
    rig.node(NodeState.OPERATIONAL)
    rig.drive_says(INHIBITED)
    outcomes = rig.submit(Action.START, direction=1)
    assert not outcomes
    if how == "the node has restarted":
        rig.node(NodeState.LOST)
        rig.node(NodeState.OPERATIONAL)
    else:
        rig.channel.start_anew(rig.now)
    (outcome,) = outcomes
    assert (outcome.code, outcome.message) == (Code.CANCELLED, how)
    for _ in range(3):
        for word in (INHIBITED, READY, READY):
            rig.drive_says(word)
            rig.wait(0.6)
            assert not rig.enables
    assert len(outcomes) == 1
