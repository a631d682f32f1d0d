"""What a drive's settings make of the controller leg: no reaction at all, a time set while it runs."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from bridge.command import Action, Code, EventKind, Identity, Role, Source
from bridge.command.drive_link import NodeState
from tests.support.rig import (
    ACKNOWLEDGE,
    ENABLE,
    ENGINEER,
    HALF_SPEED,
    OPERATOR,
    OTHER_PLC,
    PLC,
    SHUT_DOWN,
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
        assert len(rig.told(EventKind.WATCHDOG)) == 1

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
        assert running.channel.timeout_ms == 200

    @pytest.fixture
    def writable(self) -> Rig:
        rig = Rig(fieldbus_timeout_writable=True, fieldbus_timeout_range_ms=[0, 1000])
        rig.run()
        return rig

    @pytest.mark.parametrize("timeout_ms", [-1, 1001, 32768])
    def test_takes_the_range_of_the_site_file(self, writable: Rig, timeout_ms: int):
        assert writable.ask(Action.SET_TIMEOUT, timeout_ms=timeout_ms).code is Code.OUT_OF_RANGE
        assert writable.channel.timeout_ms == 200

    @pytest.mark.parametrize(
        ("site_ms", "taken", "refused"),
        [(200, (1, 2000), (0, 2001)), (10_000, (1, 32767), (0, 32768)), (0, (1, 32767), (0, 32768))],
    )
    def test_without_a_range_it_is_never_off_and_ten_times_as_long_at_most(
        self, site_ms: int, taken: tuple[int, int], refused: tuple[int, int]
    ):
        rig = Rig(fieldbus_timeout_writable=True, fieldbus_timeout_ms=site_ms)
        rig.run()
        for timeout_ms in taken:
            assert rig.ask(Action.SET_TIMEOUT, timeout_ms=timeout_ms).ok
        for timeout_ms in refused:
            assert rig.ask(Action.SET_TIMEOUT, timeout_ms=timeout_ms).code is Code.OUT_OF_RANGE

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

    @pytest.mark.parametrize("downtime_s", [0.5, -0.1])
    def test_after_silence_no_second_timer_begins(self, downtime_s: float):
        """Neither trips nor tells again: the owner has sent nothing since."""
        rig = Rig(
            fieldbus_timeout_writable=True,
            fieldbus_timeout_range_ms=[0, 1000],
            telegram_downtime_s=downtime_s,
        )
        rig.run()
        rig.wait(0.2)
        told = len(rig.told(EventKind.WATCHDOG))
        assert told == 1
        for timeout_ms in (400, 0, 300):
            assert rig.ask(Action.SET_TIMEOUT, timeout_ms=timeout_ms).ok
            assert rig.channel.leg.timer.deadline is None
        assert rig.channel.controller_is_overdue
        rig.wait(10)
        assert len(rig.told(EventKind.WATCHDOG)) == told
        assert rig.channel.trips == (downtime_s > 0)

    @pytest.mark.parametrize("who", [OTHER_PLC, OPERATOR, ENGINEER])
    @pytest.mark.parametrize("when", ["owned", "silent", "free", "not yet owned"])
    def test_only_the_owner_may(self, writable: Rig, who: Identity, when: str):
        rig = Rig(fieldbus_timeout_writable=True) if when == "not yet owned" else writable
        if when == "silent":
            rig.wait(0.3)
        elif when == "free":
            rig.ask(Action.RELEASE_CONTROL)
        owner = rig.channel.owner
        assert rig.ask(Action.SET_TIMEOUT, who, timeout_ms=300).code is Code.NOT_ALLOWED
        assert rig.channel.timeout_ms == 200
        assert rig.channel.owner == owner


def _released(rig: Rig) -> None:
    rig.ask(Action.RELEASE_CONTROL)


def _displaced(rig: Rig) -> None:
    rig.wait(0.9)
    rig.write(SHUT_DOWN, identity=OTHER_PLC)


def _displaced_by_taking(rig: Rig) -> None:
    rig.wait(0.9)
    rig.ask(Action.TAKE_CONTROL, OTHER_PLC)


def _taken_away(rig: Rig) -> None:
    rig.ask(Action.TAKE_CONTROL, Identity(Source.MODBUS, "192.168.1.12", Role.ENGINEER))


def _bridge_hung(rig: Rig) -> None:
    rig.channel.on_bridge_gap(rig.now)


class TestTheSitesTimeoutIsBack:
    """When the owner goes, whatever made it go."""

    def rig(self, **settings: object) -> Rig:
        rig = Rig(fieldbus_timeout_writable=True, fieldbus_timeout_range_ms=[0, 1000], **settings)
        rig.node(NodeState.OPERATIONAL)
        rig.ask(Action.TAKE_CONTROL, ttl_ms=600)
        rig.run()
        return rig

    @pytest.mark.parametrize("goes", [_released, _displaced, _displaced_by_taking, _taken_away, _bridge_hung])
    def test_with_a_fixed_source(self, goes: Callable[[Rig], None]):
        rig = self.rig()
        assert rig.ask(Action.SET_TIMEOUT, timeout_ms=800).ok
        goes(rig)
        assert rig.channel.owner != PLC
        assert rig.channel.timeout_ms == 200
        assert "fieldbus_timeout_ms = 200 again, as in the site file" in rig.told(EventKind.CONFIGURATION)

    def test_when_a_lease_runs_out_and_the_next_owner_is_watched(self):
        rig = self.rig(control="lease")
        assert rig.ask(Action.SET_TIMEOUT, timeout_ms=0).ok
        rig.wait(1.0)
        assert rig.channel.owner is None
        assert rig.ask(Action.TAKE_CONTROL, OTHER_PLC, ttl_ms=10_000).ok
        rig.write(SHUT_DOWN, identity=OTHER_PLC)
        rig.write(ENABLE, identity=OTHER_PLC)
        rig.wait(0.2)
        assert rig.watchdog == "tripped"

    def test_who_takes_over_is_watched_by_it_at_once(self):
        rig = self.rig()
        assert rig.ask(Action.SET_TIMEOUT, timeout_ms=900).ok
        rig.wait(1.0)
        assert rig.watchdog == "tripped"
        rig.write(SHUT_DOWN, identity=OTHER_PLC)
        assert rig.watchdog == "tripped", "a trip stays a trip"
        rig.write(ACKNOWLEDGE, identity=OTHER_PLC)
        assert rig.channel.left_ms(rig.now) == 200

    def test_a_trip_and_a_bus_that_was_gone_leave_it_with_its_owner(self):
        rig = self.rig()
        rig.ask(Action.SET_TIMEOUT, timeout_ms=300)
        rig.channel.start_anew(rig.now)
        rig.wait(0.3)
        rig.write(SHUT_DOWN)
        assert rig.watchdog == "tripped"
        assert rig.channel.timeout_ms == 300
