"""Who owns a drive, and until when exactly: leases, owners that are gone, the owner's own time-out
(docs/explanation/dead-man-chain.md, "Who owns a drive")."""

from __future__ import annotations

import pytest

from bridge.command import Action, Code, Command, Identity, Role, SetTimeout, Source, TakeControl
from bridge.command.leg.event import Connection
from bridge.command.leg.outlook import next_deadline, until
from bridge.drive import DriveState
from tests.support.leg import PLC, Leg, settings_of, told
from tests.support.rig import ENGINEER, OPERATOR, OTHER_PLC

SHUT_DOWN, RUN = 0x047E, 0x047F
"""NORD's (BU 2500 §6.8)."""
MODBUS_ENGINEER = Identity(Source.MODBUS, "192.168.1.99", Role.ENGINEER)
A_MOMENT_S = 1e-6


class Drive(Leg):
    """A NORD drive. Its clock begins at 100 s."""

    def __init__(self, **given: object) -> None:
        super().__init__(settings_of("nord/sk-tu4-cao", **given))

    def runs(self) -> None:
        self.writes(SHUT_DOWN)
        self.writes(RUN, setpoint_1=0x2000)
        self.says(DriveState.OPERATION_ENABLED)
        assert self.enables

    def takes(self, command: Command | Action, who: Identity = PLC) -> bool:
        self.asks(command, who)
        return self.outcome.ok

    @property
    def owner(self) -> Identity | None:
        return self.state.owner.identity

    @property
    def may_be_taken_over(self) -> bool:
        return self.takes(Action.KEEP_ALIVE, OTHER_PLC)


class TestLease:
    @pytest.mark.parametrize(("ttl_ms", "end"), [(100, 100.1), (1000, 101.0), (600_000, 700.0)])
    def test_it_runs_from_when_it_is_taken_to_its_end_and_no_longer(self, ttl_ms: int, end: float):
        drive = Drive(control="lease")
        assert drive.takes(TakeControl(ttl_ms), OPERATOR)
        assert next_deadline(drive.state) == end
        drive.at(end - A_MOMENT_S)
        assert drive.owner == OPERATOR
        drive.at(end)
        assert drive.owner is None
        assert told(drive.effects) == ["the lease of opcua:ann ran out"]

    def test_it_runs_anew_from_when_a_telegram_can_have_arrived(self):
        drive = Drive(control="lease")
        drive.takes(TakeControl(1000))
        drive.at(100.5)
        drive.asks(Action.KEEP_ALIVE, received_at=100.25)
        assert next_deadline(drive.state) == 101.25

    @pytest.mark.parametrize(
        ("timeout_ms", "ttl_ms", "on_expiry", "end"),
        [
            (0, 5000, "stop", 105.0),
            (2000, 5000, "stop", 102.0),
            (2000, 1000, "stop", 101.0),
            (2000, 2000, "stop", 102.0),
            (2000, 5000, "hold", 105.0),
        ],
    )
    def test_what_enables_is_on_the_bus_until_the_first_of_both_ends(
        self, timeout_ms: int, ttl_ms: int, on_expiry: str, end: float
    ):
        drive = Drive(control="lease", fieldbus_timeout_ms=timeout_ms, on_expiry=on_expiry)
        drive.takes(TakeControl(ttl_ms))
        drive.runs()
        assert until(drive.settings, drive.state) == end
        drive.at(end - A_MOMENT_S)
        assert drive.enables
        drive.at(end)
        assert not drive.enables

    @pytest.mark.parametrize("given", [{"telegram_downtime_s": -0.1}, {"on_expiry": "hold"}])
    def test_without_one_no_time_ends_it_where_no_reaction_stops_the_drive(self, given: dict[str, object]):
        drive = Drive(fieldbus_timeout_ms=1000, **given)
        drive.runs()
        assert until(drive.settings, drive.state) is None
        drive.at(160.0)
        assert drive.enables

    def test_an_owner_that_has_said_nothing_yet_keeps_it_for_its_time(self):
        drive = Drive(control="lease", fieldbus_timeout_ms=200)
        drive.takes(TakeControl(1000))
        assert not drive.takes(TakeControl(1000), OTHER_PLC)
        assert drive.takes(TakeControl(1000), ENGINEER)

    @pytest.mark.parametrize("who", [ENGINEER, OTHER_PLC])
    def test_who_may_take_over_from_a_silent_owner_takes_nothing_away(self, who: Identity):
        drive = Drive(control="lease", fieldbus_timeout_ms=200)
        drive.takes(TakeControl(60_000))
        drive.runs()
        drive.at(100.2)
        assert drive.takes(TakeControl(1000), who)
        assert told(drive.effects)[-1] == f"controlled by {who}"
        assert not any("takes control away" in message for message in told(drive.effects))


class TestWithoutALease:
    @pytest.mark.parametrize("timeout_ms", [1, 200])
    def test_who_takes_control_and_never_sends_holds_nobody_up(self, timeout_ms: int):
        drive = Drive(fieldbus_timeout_ms=timeout_ms)
        assert drive.takes(TakeControl())
        assert drive.may_be_taken_over

    def test_where_nobody_watches_it_does(self):
        drive = Drive(fieldbus_timeout_ms=0)
        assert drive.takes(TakeControl())
        assert not drive.may_be_taken_over

    def test_only_an_engineer_of_the_drives_own_protocol_takes_it_away(self):
        drive = Drive(fieldbus_timeout_ms=0)
        drive.runs()
        assert not drive.takes(TakeControl(), OTHER_PLC)
        assert not drive.takes(TakeControl(), ENGINEER)
        assert drive.owner == PLC
        assert drive.takes(TakeControl(), MODBUS_ENGINEER)
        assert drive.owner == MODBUS_ENGINEER
        assert not drive.enables


class TestAnOwnerThatIsGone:
    """With ``fieldbus_timeout_ms = 0``: after exactly 10 s."""

    @pytest.mark.parametrize("sign", ["no connection", "no answer to a stop"])
    def test_holds_nobody_up_from_then_on(self, sign: str):
        drive = Drive(fieldbus_timeout_ms=0)
        drive.runs()
        if sign == "no connection":
            drive.happens(Connection(PLC, is_there=False))
        else:
            drive.asks(Action.STOP, OPERATOR)
        drive.now = 110.0 - A_MOMENT_S
        assert not drive.may_be_taken_over
        drive.now = 110.0
        assert drive.may_be_taken_over

    def test_has_not_answered_to_a_stop_that_came_before_it_owned_the_drive(self):
        drive = Drive(fieldbus_timeout_ms=0)
        drive.asks(Action.STOP, OPERATOR)
        drive.takes(TakeControl())
        drive.now = 200.0
        assert not drive.may_be_taken_over

    @pytest.mark.parametrize("timeout_ms", [1, 200])
    def test_a_stop_counts_only_where_nobody_watches(self, timeout_ms: int):
        """Also where the owner switches its time-out off afterwards."""
        drive = Drive(
            fieldbus_timeout_ms=timeout_ms,
            fieldbus_timeout_writable=True,
            fieldbus_timeout_range_ms=[0, 1000],
        )
        drive.runs()
        drive.asks(Action.STOP, OPERATOR)
        assert drive.takes(SetTimeout(0))
        drive.now = 200.0
        assert not drive.may_be_taken_over


class TestTheOwnersTimeout:
    @pytest.fixture
    def drive(self) -> Drive:
        return Drive(
            fieldbus_timeout_ms=1000, fieldbus_timeout_writable=True, fieldbus_timeout_range_ms=[100, 3000]
        )

    @pytest.mark.parametrize(
        ("timeout_ms", "is_taken"), [(99, False), (100, True), (3000, True), (3001, False)]
    )
    def test_its_limits_are_those_of_the_site_file(self, drive: Drive, timeout_ms: int, is_taken: bool):
        drive.runs()
        assert drive.takes(SetTimeout(timeout_ms)) is is_taken
        assert (drive.outcome.code is Code.OUT_OF_RANGE) is not is_taken
        assert drive.state.timer.timeout_ms == (timeout_ms if is_taken else 1000)

    def test_it_runs_from_the_last_telegram(self, drive: Drive):
        drive.runs()
        drive.at(100.5)
        assert drive.takes(SetTimeout(2000))
        assert told(drive.effects) == ["fieldbus_timeout_ms = 2000, by modbus:192.168.1.10"]
        assert until(drive.settings, drive.state) == 102.0
        drive.at(102.0 - A_MOMENT_S)
        assert drive.enables
        drive.at(102.0)
        assert not drive.enables

    def test_before_the_first_telegram_nothing_runs(self, drive: Drive):
        drive.takes(TakeControl())
        assert drive.takes(SetTimeout(2000))
        assert next_deadline(drive.state) is None

    @pytest.mark.parametrize("more", [{}, {"telegram_downtime_s": -0.1}])
    def test_of_an_owner_that_is_overdue_it_ends_nothing_a_second_time(self, more: dict[str, object]):
        drive = Drive(fieldbus_timeout_ms=1000, fieldbus_timeout_writable=True, **more)
        drive.runs()
        drive.at(101.0)
        assert drive.effects
        assert drive.takes(SetTimeout(2000))
        assert next_deadline(drive.state) is None
        drive.at(160.0)
        assert not drive.effects
        assert drive.may_be_taken_over, "it is still overdue"

    def test_nobody_has_another_time_after_it_has_gone(self, drive: Drive):
        drive.runs()
        drive.takes(SetTimeout(2000))
        drive.asks(Action.RELEASE_CONTROL)
        assert "fieldbus_timeout_ms = 1000 again, as in the site file" in told(drive.effects)
        drive.runs()
        assert until(drive.settings, drive.state) == 101.0
        drive.asks(Action.RELEASE_CONTROL)
        assert not any("fieldbus_timeout_ms" in message for message in told(drive.effects))
