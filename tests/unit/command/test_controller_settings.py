"""What a drive's settings make of the controller leg: no reaction at all, a time set while it runs."""

from __future__ import annotations

import pytest

from bridge.command import Action, Code, Kind
from bridge.command.link import NodeState
from tests.support.rig import (
    ENABLE,
    HALF_SPEED,
    OTHER_PLC,
    PLC,
    Rig,
)


def tripped(**settings: object) -> Rig:
    rig = Rig(**settings)
    rig.run()
    rig.wait(0.2)
    assert rig.watchdog == "tripped"
    return rig


class TestIgnoreAll:
    """telegram_downtime_s = -0.1, P513's "no error": everything is reported and nothing reacts."""

    def test_a_silent_controller_is_reported_once_and_the_drive_goes_on(self):
        rig = Rig(telegram_downtime_s=-0.1)
        rig.run()
        rig.wait(10)
        assert rig.watchdog == "off"
        assert rig.enables
        assert rig.sent_setpoints[0] == HALF_SPEED
        assert rig.channel.trips == 0
        assert rig.channel.last_fault == 10.3
        assert len(rig.told(Kind.WATCHDOG)) == 1

    def test_a_lost_node_is_reported_and_the_drive_is_commanded_on(self):
        rig = Rig(telegram_downtime_s=-0.1)
        rig.run()
        rig.node(NodeState.LOST)
        assert rig.enables
        assert rig.channel.current_fault == 10.9

    def test_missing_process_data_are_reported_and_ignored(self):
        rig = Rig(telegram_downtime_s=-0.1, pdo_deadline_s=0.05, fieldbus_timeout_ms=0)
        rig.run()
        rig.wait(0.1)
        assert rig.enables
        assert rig.channel.current_fault == 10.2


class TestSetTimeout:
    def test_is_refused_where_the_site_file_does_not_allow_it(self, running: Rig):
        assert running.ask(Action.SET_TIMEOUT, timeout_ms=500).code is Code.NOT_ALLOWED
        assert running.channel.watchdog.timeout_ms == 200

    @pytest.fixture
    def writable(self) -> Rig:
        rig = Rig(fieldbus_timeout_writable=True)
        rig.run()
        return rig

    @pytest.mark.parametrize("timeout_ms", [-1, 32768])
    def test_takes_the_range_of_p151(self, writable: Rig, timeout_ms: int):
        assert writable.ask(Action.SET_TIMEOUT, timeout_ms=timeout_ms).code is Code.OUT_OF_RANGE

    def test_counts_from_the_last_telegram(self, writable: Rig):
        writable.wait(0.1)
        assert writable.ask(Action.SET_TIMEOUT, timeout_ms=400).ok
        writable.wait(0.299)
        assert writable.enables
        writable.wait(0.001)
        assert writable.watchdog == "tripped"

    def test_repeating_it_keeps_no_drive_running(self, writable: Rig):
        for _ in range(4):
            writable.wait(0.05)
            writable.ask(Action.SET_TIMEOUT, timeout_ms=200)
        assert writable.watchdog == "tripped"

    def test_zero_switches_the_watchdog_off_and_back_on(self, writable: Rig):
        writable.ask(Action.SET_TIMEOUT, timeout_ms=0)
        assert writable.watchdog == "off"
        writable.wait(10)
        assert writable.enables
        writable.write(ENABLE)
        writable.ask(Action.SET_TIMEOUT, timeout_ms=100)
        assert writable.watchdog == "running", "the drive runs: it is watched from its last telegram on"
        writable.wait(0.1)
        assert writable.watchdog == "tripped"

    def test_a_trip_stays_a_trip_and_ends_off(self, writable: Rig):
        writable.wait(0.2)
        writable.ask(Action.SET_TIMEOUT, timeout_ms=0)
        assert writable.watchdog == "tripped"
        writable.ask(Action.RESET_FAULT)
        assert writable.watchdog == "off"

    def test_somebody_else_may_not(self, writable: Rig):
        assert writable.ask(Action.SET_TIMEOUT, OTHER_PLC, timeout_ms=0).code is Code.NOT_ALLOWED
        assert writable.channel.owner == PLC
