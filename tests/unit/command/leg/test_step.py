"""The state table of the controller leg (shared design, watchdog; BU 2500 §7.1.1), row by row."""

from __future__ import annotations

import pytest

from bridge.command import Action, Code, EventKind
from bridge.command.drive_link import NodeState
from bridge.drive import DriveState
from tests.support.rig import (
    ACKNOWLEDGE,
    ENABLE,
    ENABLED,
    FAULT,
    HALF_SPEED,
    INHIBITED,
    OPERATOR,
    OTHER_PLC,
    READY,
    SHUT_DOWN,
    Rig,
)


def tripped(**settings: object) -> Rig:
    rig = Rig(**settings)
    rig.run()
    rig.wait(0.2)
    assert rig.watchdog == "tripped"
    return rig


class TestOff:
    def test_without_a_time_the_drive_is_never_tripped(self):
        rig = Rig(fieldbus_timeout_ms=0)
        rig.run()
        rig.wait(3600)
        assert rig.watchdog == "off"
        assert rig.enables

    def test_a_telegram_leaves_it_off(self):
        rig = Rig(fieldbus_timeout_ms=0)
        rig.write(SHUT_DOWN)
        assert rig.watchdog == "off"


class TestIdle:
    def test_a_configured_time_begins_idle_and_stopped(self, rig: Rig):
        assert rig.watchdog == "idle"
        assert rig.sent == 0x0400
        assert rig.sent_setpoints == (0, 0, 0, 0)

    def test_before_the_first_telegram_nothing_expires(self, rig: Rig):
        rig.wait(3600)
        assert rig.watchdog == "idle"

    def test_the_first_valid_telegram_starts_the_timer_even_if_it_enables_nothing(self, rig: Rig):
        rig.node(NodeState.OPERATIONAL)
        rig.write(SHUT_DOWN)
        assert rig.watchdog == "running"
        assert rig.channel.left_ms(rig.now) == 200
        rig.wait(0.2)
        assert rig.watchdog == "tripped"

    def test_the_first_valid_telegram_is_forwarded(self, rig: Rig):
        rig.node(NodeState.OPERATIONAL)
        assert rig.write(SHUT_DOWN).forwarded
        assert rig.sent == SHUT_DOWN

    def test_an_invalid_telegram_starts_nothing_and_makes_nobody_owner(self, rig: Rig):
        rig.write(0x007E)
        assert rig.watchdog == "idle"
        assert rig.channel.owner is None

    def test_taking_control_is_no_telegram(self, rig: Rig):
        rig.ask(Action.TAKE_CONTROL)
        assert rig.watchdog == "idle"


class TestRunning:
    def test_a_valid_telegram_is_forwarded_and_restarts_the_timer(self, running: Rig):
        for _ in range(20):
            running.wait(0.19)
            assert running.write(ENABLE, 0x1000).forwarded
        assert running.watchdog == "running"
        assert running.sent_setpoints[0] == 0x1000

    @pytest.mark.parametrize("action", [Action.KEEP_ALIVE, Action.RESET_FAULT])
    def test_keep_alive_and_acknowledge_are_telegrams(self, running: Rig, action: Action):
        running.wait(0.15)
        running.ask(action)
        running.wait(0.15)
        assert running.watchdog == "running"

    def test_a_setpoint_alone_is_a_telegram(self, running: Rig):
        running.wait(0.15)
        running.write(None, 0x0800)
        running.wait(0.15)
        assert running.watchdog == "running"
        assert running.sent == ENABLE

    def test_a_telegram_leaves_what_it_does_not_name_as_it_was(self, running: Rig):
        running.write(ENABLE, 0x1000, 0x0200)
        running.write(None, 0x0800)
        assert running.sent_setpoints == (0x0800, 0x0200, 0, 0)
        running.write(ENABLE)
        assert running.sent_setpoints == (0x0800, 0x0200, 0, 0)

    def test_an_invalid_telegram_is_refused_and_the_timer_goes_on(self, running: Rig):
        running.wait(0.15)
        outcome = running.write(0x007F)
        assert outcome.code is Code.NOT_VALID
        assert not outcome.forwarded
        assert running.channel.left_ms(running.now) == 50
        running.wait(0.05)
        assert running.watchdog == "tripped"

    def test_the_owners_valid_telegrams_are_counted_and_nothing_else(self, running: Rig):
        before = running.channel.telegrams
        running.write(ENABLE)
        running.write(None, HALF_SPEED)
        running.ask(Action.KEEP_ALIVE)
        running.ask(Action.RESET_FAULT)
        running.ask(Action.STOP)
        assert running.channel.telegrams == before + 5
        running.write(0x007F)
        running.write(SHUT_DOWN, identity=OTHER_PLC)
        running.ask(Action.STOP, OPERATOR)
        running.ask(Action.TAKE_CONTROL)
        running.wait(0.1)
        assert running.channel.telegrams == before + 5

    def test_the_timer_expires_at_its_time_and_not_before(self, running: Rig):
        running.wait(0.1999)
        assert running.enables
        running.wait(0.0001)
        assert running.watchdog == "tripped"
        assert not running.enables

    def test_an_expiry_is_an_event_and_a_fault(self, running: Rig):
        running.wait(0.2)
        assert running.channel.trips == 1
        assert running.channel.current_fault == 10.3
        assert running.channel.fault_text.startswith("E010/10.3 ")
        (message,) = running.told(EventKind.WATCHDOG)
        assert "modbus:192.168.1.10 was silent for 200 ms" in message

    def test_a_lost_node_does_not_stop_the_timer(self, running: Rig):
        running.wait(0.1)
        running.node(NodeState.LOST)
        assert running.watchdog == "running"
        running.wait(0.1)
        assert running.watchdog == "tripped"

    def test_a_telegram_that_waited_while_the_process_hung_does_not_save_the_drive(self, running: Rig):
        running.now += 0.5  # nobody called on_time
        outcome = running.write(ENABLE, HALF_SPEED)
        assert running.watchdog == "tripped"
        assert not outcome.forwarded
        assert not running.enables

    def test_even_an_acknowledge_that_waited_finds_the_drive_stopped(self, running: Rig):
        running.now += 0.5
        running.write(ACKNOWLEDGE)
        assert running.channel.trips == 1
        assert not running.enables


class TestTripped:
    def test_telegrams_are_taken_and_not_forwarded(self):
        rig = tripped()
        before = rig.channel.output
        outcome = rig.write(ENABLE, HALF_SPEED)
        assert outcome.ok
        assert not outcome.forwarded
        assert "acknowledge first" in outcome.message
        assert rig.channel.output == before
        assert rig.channel.control_word == ENABLE  # what the owner wrote can be read back

    def test_start_is_refused_until_the_acknowledge(self):
        assert tripped().ask(Action.START).code is Code.ACKNOWLEDGE_FIRST

    def test_the_served_status_word_is_a_fault_and_the_drives_own_stands_beside_it(self):
        rig = tripped()
        for word, served in (
            (ENABLED, 0x0B38 & ~0x30 | ENABLED & 0x30),
            (READY, 0x0B38),
            (INHIBITED, 0x0B08),
        ):
            rig.drive_says(word)
            assert rig.channel.drive_status_word == word
            assert rig.channel.status_word == served
            assert rig.channel.status_word & 0b1001111 == 0b0001000  # 0XX1000
            assert rig.channel.served_state is DriveState.FAULT

    def test_the_trip_outlasts_the_telegrams_return(self):
        rig = tripped()
        for _ in range(10):
            rig.write(SHUT_DOWN)
            rig.wait(0.1)
        assert rig.watchdog == "tripped"

    def test_the_manuals_way_back(self):
        """Acknowledge edge, 047E, 047F: as a control program for NORD's own interface does it."""
        rig = tripped()
        rig.drive_says(FAULT)
        assert not rig.write(ACKNOWLEDGE).forwarded
        assert rig.watchdog == "running"
        assert rig.sent & 0x0080  # the edge goes on to the drive
        assert not rig.enables
        rig.drive_says(INHIBITED)
        assert rig.channel.status_word == INHIBITED
        assert rig.write(SHUT_DOWN).forwarded
        rig.drive_says(READY)
        assert rig.write(ENABLE, HALF_SPEED).forwarded
        assert rig.enables
        assert rig.sent_setpoints[0] == HALF_SPEED

    def test_an_acknowledge_that_enables_at_once_leaves_the_drive_stopped(self):
        rig = tripped()
        assert not rig.write(0x04FF, HALF_SPEED).forwarded
        assert rig.watchdog == "running"
        assert not rig.enables
        assert rig.sent_setpoints == (0, 0, 0, 0)
        assert not rig.write(ENABLE, HALF_SPEED).forwarded
        assert not rig.enables

    def test_a_bit_that_was_high_all_the_time_is_no_edge(self):
        rig = Rig()
        rig.node(NodeState.OPERATIONAL)
        rig.write(ACKNOWLEDGE)
        rig.wait(0.2)
        rig.write(ACKNOWLEDGE)
        assert rig.watchdog == "tripped"
        rig.write(SHUT_DOWN)
        rig.write(ACKNOWLEDGE)
        assert rig.watchdog == "running"

    def test_reset_fault_acknowledges_with_an_edge_of_its_own(self):
        rig = tripped()
        assert rig.ask(Action.RESET_FAULT).ok
        assert rig.watchdog == "running"
        assert rig.sent & 0x0080
        rig.wait(0.1)
        assert not rig.sent & 0x0080
        assert not rig.enables

    def test_an_edge_of_the_owners_word_lasts_as_long_as_its_bit(self):
        rig = tripped()
        rig.write(ACKNOWLEDGE)
        assert rig.sent & 0x0080
        rig.wait(0.15)
        assert rig.sent & 0x0080
        rig.write(SHUT_DOWN)
        assert rig.sent == SHUT_DOWN
        again = tripped()
        again.write(ACKNOWLEDGE)
        again.write(SHUT_DOWN)
        assert again.sent == SHUT_DOWN

    def test_a_telegram_does_not_cut_the_edge_short(self):
        rig = tripped()
        rig.ask(Action.RESET_FAULT)
        rig.wait(0.01)
        rig.write(SHUT_DOWN)
        assert rig.sent == ACKNOWLEDGE
        rig.wait(0.1)
        assert rig.sent == SHUT_DOWN

    def test_the_fault_becomes_the_last_fault_with_the_acknowledge(self):
        rig = tripped()
        rig.ask(Action.RESET_FAULT)
        assert rig.channel.current_fault == 0
        assert rig.channel.last_fault == 10.3
        assert rig.channel.fault_text == ""

    def test_silence_after_the_telegrams_were_back_is_no_second_trip(self):
        rig = tripped()
        rig.write(SHUT_DOWN)
        rig.wait(10)
        assert rig.channel.trips == 1
        assert rig.channel.controller_is_overdue

    def test_silence_after_the_acknowledge_is_a_second_trip(self):
        rig = tripped()
        rig.ask(Action.RESET_FAULT)
        rig.wait(0.2)
        assert rig.channel.trips == 2

    def test_a_release_does_not_take_the_fault_away(self):
        rig = tripped()
        rig.write(SHUT_DOWN)
        assert rig.ask(Action.RELEASE_CONTROL).ok
        assert rig.watchdog == "tripped"
        assert rig.channel.owner is None

    def test_whoever_takes_over_has_to_acknowledge(self):
        rig = tripped()
        assert not rig.write(ENABLE, identity=OTHER_PLC).forwarded
        assert rig.channel.owner == OTHER_PLC
        assert rig.watchdog == "tripped"
        rig.write(ACKNOWLEDGE, identity=OTHER_PLC)
        assert rig.watchdog == "running"

    def test_an_acknowledge_of_somebody_else_is_refused_while_the_owner_is_back(self):
        rig = tripped()
        rig.write(SHUT_DOWN)
        assert rig.ask(Action.RESET_FAULT, OTHER_PLC).code is Code.NOT_ALLOWED
        assert rig.watchdog == "tripped"


class TestRelease:
    def test_a_released_drive_is_stopped_without_a_fault(self, running: Rig):
        assert running.ask(Action.RELEASE_CONTROL).ok
        assert running.watchdog == "idle"
        assert running.sent == SHUT_DOWN  # bit 0 = 0: ramp down
        assert running.channel.owner is None
        assert running.channel.current_fault == 0
        running.wait(10)
        assert running.channel.trips == 0

    def test_who_does_not_own_the_drive_releases_nothing(self, rig: Rig):
        assert rig.ask(Action.RELEASE_CONTROL).message == "not in control"
        rig.run()
        assert rig.ask(Action.RELEASE_CONTROL, OTHER_PLC).code is Code.NOT_ALLOWED
        assert rig.enables


class TestBridgeStart:
    def test_after_a_gap_the_drive_is_stopped_and_nobody_owns_it(self, running: Rig):
        running.wait(0.1)
        running.channel.on_bridge_gap(running.now)
        assert running.watchdog == "idle"
        assert not running.enables
        assert running.channel.owner is None
        assert not running.write(ENABLE, HALF_SPEED).forwarded
        assert not running.enables

    def test_a_gap_that_was_longer_than_the_watchdog_is_a_trip(self, running: Rig):
        running.now += 0.3
        running.channel.on_bridge_gap(running.now)
        assert running.watchdog == "tripped"
        assert running.channel.current_fault == 10.3

    def test_a_gap_ends_what_is_held_and_the_trip_stays(self):
        rig = tripped(on_expiry="hold")
        rig.channel.on_bridge_gap(rig.now)
        assert rig.watchdog == "tripped"
        assert rig.channel.output.words == (SHUT_DOWN, 0, 0, 0, 0)
        assert (rig.channel.control_word, rig.channel.setpoints) == (SHUT_DOWN, (0, 0, 0, 0))

    def test_a_bus_that_was_gone_leaves_nothing_of_the_old_telegrams(self, running: Rig):
        running.channel.start_anew(running.now)
        assert running.channel.output.words == (SHUT_DOWN, 0, 0, 0, 0)
        assert (running.channel.control_word, running.channel.setpoints) == (SHUT_DOWN, (0, 0, 0, 0))
        running.write(SHUT_DOWN)
        running.write(ENABLE)
        assert running.enables
        assert running.sent_setpoints == (0, 0, 0, 0)

    def test_before_its_node_is_seen_a_drive_is_not_commanded(self, rig: Rig):
        assert rig.channel.output.words == (0x0400, 0, 0, 0, 0)
        for outcome in (rig.write(ENABLE, HALF_SPEED), rig.write(SHUT_DOWN), rig.write(ENABLE)):
            assert outcome.ok
            assert not rig.enables
        (outcome,) = rig.submit(Action.START)
        assert (outcome.code, outcome.forwarded) == (Code.NOT_READY, False)
        assert "node" in outcome.message

    def test_a_gap_does_not_look_like_a_dead_drive(self):
        """Its frames are still waiting in the socket: they are judged when it has been drained."""
        rig = Rig(pdo_deadline_s=0.1, telegram_downtime_s=0.1, fieldbus_timeout_ms=1000)
        rig.run()
        rig.now += 0.5
        rig.channel.on_bridge_gap(rig.now)
        rig.ask(Action.KEEP_ALIVE)
        rig.drive_says(READY)
        rig.channel.on_time(rig.now)
        assert rig.channel.last_fault == 0
