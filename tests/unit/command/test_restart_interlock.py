"""Nothing starts moving because a cable was plugged back in (shared design, watchdog)."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from bridge.command import Action, Code, EventKind
from bridge.command.drive_link import NodeState
from tests.support.rig import ENABLE, ENABLED, HALF_SPEED, OBSERVER, OPERATOR, PLC, READY, SHUT_DOWN, Rig


def trip(rig: Rig) -> None:
    rig.wait(0.2)
    rig.ask(Action.RESET_FAULT)


def lose_the_node(rig: Rig) -> None:
    rig.node(NodeState.LOST)
    rig.node(NodeState.BOOTING)
    rig.node(NodeState.OPERATIONAL)


def restart_the_node(rig: Rig) -> None:
    rig.node(NodeState.BOOTING)
    rig.node(NodeState.OPERATIONAL)


def switch_the_node_off_and_on(rig: Rig) -> None:
    rig.node(NodeState.DISABLED)
    rig.node(NodeState.ABSENT)
    rig.node(NodeState.BOOTING)
    rig.node(NodeState.OPERATIONAL)


def hang_the_bridge(rig: Rig) -> None:
    rig.channel.on_bridge_gap(rig.now)


def stop_by_an_operator(rig: Rig) -> None:
    rig.ask(Action.STOP, OPERATOR)


def miss_process_data(rig: Rig) -> None:
    rig.channel.link.pdo_deadline_s = 0.05
    for _ in range(10):
        rig.wait(0.1)
        rig.write(ENABLE, HALF_SPEED)
    rig.drive_says(ENABLED)


@pytest.mark.parametrize(
    "happens",
    [
        trip,
        lose_the_node,
        restart_the_node,
        switch_the_node_off_and_on,
        hang_the_bridge,
        stop_by_an_operator,
        miss_process_data,
    ],
)
def test_the_old_enable_does_not_count_any_more(running: Rig, happens: Callable[[Rig], None]):
    happens(running)
    assert not running.enables
    assert running.channel.restart_interlock
    for _ in range(3):  # a control program that goes on as if nothing had been
        outcome = running.write(ENABLE, HALF_SPEED)
        assert outcome.ok
        assert not outcome.forwarded
        assert "restart interlock" in outcome.message
        assert not running.enables
        assert running.sent_setpoints == (0, 0, 0, 0)
    assert running.write(SHUT_DOWN).forwarded
    assert running.write(ENABLE, HALF_SPEED).forwarded
    assert running.enables


def test_the_bridge_starts_with_the_interlock(rig: Rig):
    rig.node(NodeState.OPERATIONAL)
    rig.drive_says(READY)
    assert not rig.write(ENABLE, HALF_SPEED).forwarded
    assert not rig.enables


def test_a_word_that_does_not_enable_opens_nothing_while_the_node_is_away(running: Rig):
    running.node(NodeState.LOST)
    running.write(SHUT_DOWN)
    running.node(NodeState.OPERATIONAL)
    assert not running.write(ENABLE).forwarded
    assert not running.enables


def test_a_setpoint_opens_nothing(rig: Rig):
    rig.node(NodeState.OPERATIONAL)
    assert not rig.write(None, HALF_SPEED).forwarded
    assert rig.channel.restart_interlock


def test_a_lost_node_stops_the_commands_at_once_and_is_reported(running: Rig):
    running.node(NodeState.LOST)
    assert running.sent == SHUT_DOWN
    assert running.channel.current_fault == 10.9
    assert running.channel.fault_text == "E010/10.9 bus interface missing"
    assert running.told(EventKind.WATCHDOG) == ["E010/10.9: the node is lost"]
    running.node(NodeState.OPERATIONAL)
    assert running.channel.current_fault == 0
    assert running.channel.last_fault == 10.9


def test_a_lost_node_keeps_its_fault_through_an_acknowledge(running: Rig):
    running.node(NodeState.LOST)
    running.wait(0.2)
    assert running.channel.current_fault == 10.3
    running.ask(Action.RESET_FAULT)
    assert running.channel.current_fault == 10.9


def test_a_stray_frame_of_a_lost_node_does_not_clear_the_fault(running: Rig):
    running.node(NodeState.LOST)
    running.drive_says(ENABLED)
    assert running.channel.current_fault == 10.9
    assert not running.enables


class TestStopCommands:
    @pytest.mark.parametrize(
        ("action", "word"),
        [(Action.STOP, 0x047E), (Action.QUICK_STOP, 0x047B), (Action.DISABLE_VOLTAGE, 0x0474)],
    )
    @pytest.mark.parametrize("who", [PLC, OPERATOR])
    def test_stop_the_drive_whoever_owns_it(self, running: Rig, action: Action, word: int, who):
        assert running.ask(action, who).ok
        assert running.sent == word
        assert running.sent_setpoints == (0, 0, 0, 0)
        assert running.channel.restart_interlock

    def test_are_not_for_those_who_may_only_read(self, running: Rig):
        outcome = running.ask(Action.STOP, OBSERVER)
        assert outcome.code is Code.NOT_ALLOWED
        assert running.enables

    def test_of_somebody_else_are_no_telegram_of_the_owner(self, running: Rig):
        running.wait(0.15)
        running.ask(Action.STOP, OPERATOR)
        assert running.channel.owner == PLC
        running.wait(0.05)
        assert running.watchdog == "tripped"

    def test_of_somebody_else_are_told(self, running: Rig):
        running.ask(Action.QUICK_STOP)
        before = running.told(EventKind.OWNER)
        running.ask(Action.STOP, OPERATOR)
        assert running.told(EventKind.OWNER) == [*before, "stop by opcua:ann"]

    def test_of_the_owner_are_one(self, running: Rig):
        running.wait(0.15)
        running.ask(Action.STOP)
        running.wait(0.15)
        assert running.watchdog == "running"

    @pytest.mark.parametrize("weaker", [Action.STOP, Action.QUICK_STOP])
    def test_a_weaker_one_does_not_lift_a_stronger_one(self, running: Rig, weaker: Action):
        running.ask(Action.DISABLE_VOLTAGE)
        running.ask(weaker, OPERATOR)
        assert not running.sent & 0x0002

    def test_a_stop_does_not_make_an_inhibited_drive_ready(self, rig: Rig):
        rig.node(NodeState.OPERATIONAL)
        rig.ask(Action.STOP, OPERATOR)
        assert rig.sent == 0x0400

    def test_are_heard_before_anybody_owns_the_drive_and_make_nobody_owner(self, rig: Rig):
        assert rig.ask(Action.QUICK_STOP, OPERATOR).ok
        assert rig.channel.owner is None
        assert rig.watchdog == "idle"
