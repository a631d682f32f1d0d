"""One owner is one connection: two programs that call themselves the same do not move a drive in turns
(docs/adr/0009)."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.command import Action, Code, Command, Identity, Role, SetTimeout, Source, TakeControl, Write
from bridge.command.leg.event import Connection
from bridge.command.leg.owners import GONE_S
from bridge.drive import DriveState
from tests.support.leg import Leg, settings_of, told

SHUT_DOWN, RUN = 0x047E, 0x047F
"""NORD's (BU 2500 §6.8)."""
ACKNOWLEDGE = SHUT_DOWN | 0x80
ADDRESS = "192.168.0.7"
ONE = Identity(Source.MODBUS, ADDRESS, connection="port 51234")
OTHER = replace(ONE, connection="port 51235")
STRANGER = Identity(Source.MODBUS, "192.168.0.8", connection="port 40000")
ANN = Identity(Source.OPCUA, "ann", connection="session 0a1b2c3d")
ANN_TWICE = replace(ANN, connection="session 4e5f6071")
A_MOMENT_S = 1e-6


class Drive(Leg):
    """A NORD drive with a time-out of one second. Its clock begins at 100 s."""

    def __init__(self, **given: object) -> None:
        super().__init__(settings_of("nord/sk-tu4-cao", **{"fieldbus_timeout_ms": 1000, **given}))

    def takes(
        self, command: Command | Action | int, who: Identity = ONE, *, pressed: bool | None = None
    ) -> bool:
        asked = Write({"control_word": command}) if isinstance(command, int) else command
        self.asks(asked, who, pressed=pressed)
        return self.outcome.ok

    def runs(self, who: Identity = ONE) -> None:
        assert self.takes(SHUT_DOWN, who)
        assert self.takes(RUN, who)
        self.says(DriveState.OPERATION_ENABLED)
        assert self.enables

    def connection(self, who: Identity, *, is_there: bool, has_others: bool = False) -> None:
        self.happens(Connection(who, is_there, has_others))

    def closes(self, who: Identity = ONE, *, has_others: bool = False) -> None:
        self.connection(who, is_there=False, has_others=has_others)

    def refuses(self, command: Command | Action | int, who: Identity = OTHER) -> None:
        before = self.state
        assert not self.takes(command, who)
        assert self.outcome.code is Code.NOT_ALLOWED
        assert self.state == before, "what is refused changes nothing"


class TestASecondConnectionOfTheOwner:
    def test_is_refused_and_both_are_named(self):
        drive = Drive()
        drive.runs()
        drive.refuses(SHUT_DOWN)
        assert drive.outcome.message == "the drive is controlled by modbus:192.168.0.7 port 51234"
        why = f"write by modbus:192.168.0.7 port 51235 refused: {drive.outcome.message}"
        assert told(drive.effects) == [why]

    def test_of_another_user_needs_no_connections_to_be_told_apart(self):
        drive = Drive()
        drive.runs()
        drive.refuses(SHUT_DOWN, STRANGER)
        assert drive.outcome.message == "the drive is controlled by modbus:192.168.0.7"

    @pytest.mark.parametrize("command", [Action.KEEP_ALIVE, Action.RESET_FAULT, Action.RELEASE_CONTROL])
    def test_keeps_nothing_alive_acknowledges_nothing_and_releases_nothing(self, command: Action):
        drive = Drive()
        drive.runs()
        drive.refuses(command)

    def test_sets_no_time(self):
        drive = Drive(fieldbus_timeout_writable=True, fieldbus_timeout_range_ms=[100, 3000])
        drive.runs()
        drive.refuses(SetTimeout(2000))
        assert drive.takes(SetTimeout(2000))

    @pytest.mark.parametrize("action", [Action.STOP, Action.QUICK_STOP, Action.DISABLE_VOLTAGE])
    def test_may_stop_the_drive_and_is_no_sign_of_the_owner(self, action: Action):
        drive = Drive()
        drive.runs()
        before = drive.state.timer
        assert drive.takes(action, OTHER)
        assert not drive.enables
        assert drive.state.timer == before
        assert drive.state.owner.identity == ONE
        assert f"{action} by modbus:192.168.0.7 port 51235" in told(drive.effects)

    def test_stops_nothing_where_the_site_file_has_the_owner_alone_stop_it(self):
        drive = Drive(stop_by_anyone=False)
        drive.runs()
        drive.refuses(Action.STOP)

    def test_only_reads_and_changes_nothing_by_coming_or_going(self):
        drive = Drive()
        drive.runs()
        before = drive.state
        drive.connection(OTHER, is_there=True)
        drive.closes(OTHER, has_others=True)
        assert drive.state == before
        drive.refuses(SHUT_DOWN, replace(ONE, connection="port 51236"))

    def test_alternates_run_and_stop_with_nobody(self):
        """Two programs behind one address write 199 times, run the one and stop the other."""
        drive = Drive()
        drive.runs()
        stops = 0
        for turn in range(199):
            drive.now += 0.01
            drive.takes(SHUT_DOWN if turn % 2 else RUN, OTHER if turn % 2 else ONE)
            stops += not drive.enables
        assert not stops
        assert not drive.state.timer.is_overdue


class TestWhenTheOwnersConnectionEnds:
    def test_the_next_one_of_its_user_goes_on_where_it_was(self):
        drive = Drive()
        drive.runs()
        drive.closes()
        assert drive.takes(RUN, OTHER)
        assert drive.enables
        assert not told(drive.effects)
        assert drive.state.owner.identity == OTHER
        drive.refuses(SHUT_DOWN, ONE)

    def test_one_that_was_open_before_goes_on_as_well(self):
        drive = Drive()
        drive.runs()
        drive.connection(OTHER, is_there=True)
        drive.refuses(RUN)
        drive.closes(has_others=True)
        assert drive.takes(RUN, OTHER)
        assert drive.enables

    def test_another_user_does_not(self):
        drive = Drive()
        drive.runs()
        drive.closes()
        drive.refuses(RUN, STRANGER)

    def test_its_time_still_runs(self):
        drive = Drive()
        drive.runs()
        drive.closes()
        drive.waits(1.0)
        assert drive.state.stage.is_tripped

    def test_an_edge_goes_over_to_the_next_one(self):
        """A PLC that connects anew for each telegram acknowledges as one that does not."""
        drive = Drive()
        drive.runs()
        drive.trips()
        for number, word in enumerate((SHUT_DOWN, ACKNOWLEDGE)):
            who = replace(ONE, connection=f"port {number}")
            drive.closes(drive.state.owner.identity or ONE)
            assert drive.takes(word, who)
        assert not drive.state.stage.is_tripped

    def test_a_register_that_is_held_at_1_acknowledges_nothing_over_the_next_one(self):
        drive = Drive()
        assert drive.takes(Action.RESET_FAULT, pressed=True)
        drive.trips()
        drive.closes()
        assert drive.takes(Action.RESET_FAULT, OTHER, pressed=True)
        assert drive.state.stage.is_tripped
        drive.closes(OTHER)
        assert drive.takes(Action.KEEP_ALIVE, ONE, pressed=False)
        assert drive.takes(Action.RESET_FAULT, ONE, pressed=True)
        assert not drive.state.stage.is_tripped

    def test_a_lease_goes_on(self):
        drive = Drive(control="lease")
        assert drive.takes(TakeControl(5000), ANN)
        drive.runs(ANN)
        drive.closes(ANN)
        assert drive.takes(RUN, ANN_TWICE)
        assert drive.enables


class TestWhenTheOwnersConnectionIsSilent:
    def test_another_one_is_refused_until_its_time_is_up(self):
        drive = Drive()
        drive.runs()
        drive.now += 1.0 - A_MOMENT_S
        drive.refuses(RUN)

    def test_another_one_takes_over_then_and_finds_the_trip(self):
        drive = Drive()
        drive.runs()
        drive.trips()
        assert drive.takes(RUN, OTHER)
        assert drive.state.stage.is_tripped
        assert "controlled by modbus:192.168.0.7 port 51235" in told(drive.effects)
        assert drive.takes(Action.RESET_FAULT, OTHER)
        assert drive.takes(SHUT_DOWN, OTHER)
        assert drive.takes(RUN, OTHER)
        assert drive.enables
        drive.refuses(SHUT_DOWN, ONE)

    def test_its_first_word_is_no_edge(self):
        drive = Drive()
        drive.runs()
        drive.trips()
        assert drive.takes(ACKNOWLEDGE, OTHER)
        assert drive.state.stage.is_tripped

    @pytest.mark.parametrize("given", [{"telegram_downtime_s": -0.1}, {"on_expiry": "hold"}])
    def test_a_drive_that_runs_on_is_stopped_when_another_one_takes_over(self, given: dict[str, object]):
        drive = Drive(**given)
        drive.runs()
        drive.waits(1.0)
        assert drive.enables
        assert drive.takes(RUN, OTHER)
        assert not drive.enables

    def test_a_register_that_one_holds_at_1_is_pressed_anew_by_another(self):
        drive = Drive()
        assert drive.takes(Action.RESET_FAULT, pressed=True)
        drive.trips()
        assert drive.takes(Action.RESET_FAULT, OTHER, pressed=True)
        assert not drive.state.stage.is_tripped


class TestWithoutATimeout:
    def drive(self, **given: object) -> Drive:
        drive = Drive(fieldbus_timeout_ms=0, **given)
        drive.runs()
        return drive

    def test_a_connection_that_says_nothing_keeps_others_of_its_user_out_for_10_s(self):
        drive = self.drive()
        drive.now += GONE_S - A_MOMENT_S
        drive.refuses(RUN)
        drive.now = 100.0 + GONE_S
        assert drive.takes(RUN, OTHER)
        assert not drive.enables, "it may be half open and may be a second program: the drive is stopped"
        assert drive.state.owner.identity == OTHER

    def test_and_others_for_as_long_as_it_is_connected(self):
        drive = self.drive()
        drive.now += 3600
        drive.refuses(RUN, STRANGER)
        assert drive.enables

    def test_each_telegram_counts_anew(self):
        drive = self.drive()
        for _ in range(5):
            drive.now += GONE_S - A_MOMENT_S
            drive.refuses(RUN)
            assert drive.takes(RUN)

    def test_the_owner_is_gone_when_its_user_has_no_connection_at_all(self):
        drive = self.drive()
        drive.closes(has_others=True)
        drive.now += 3600
        drive.refuses(RUN, STRANGER)
        drive.closes(OTHER)
        drive.now += GONE_S
        assert drive.takes(RUN, STRANGER)

    def test_who_switches_the_time_out_off_is_judged_from_its_last_telegram(self):
        drive = Drive(fieldbus_timeout_writable=True, fieldbus_timeout_range_ms=[0, 3000])
        drive.runs()
        drive.now += 0.5
        assert drive.takes(SetTimeout(0))
        drive.now = 100.0 + GONE_S - A_MOMENT_S
        drive.refuses(RUN)
        drive.now = 100.0 + GONE_S
        assert drive.takes(RUN, OTHER)


class TestLease:
    def drive(self, **given: object) -> Drive:
        drive = Drive(control="lease", **given)
        assert drive.takes(TakeControl(5000), ANN)
        drive.runs(ANN)
        return drive

    def test_is_one_sessions(self):
        drive = self.drive()
        for command in (RUN, TakeControl(5000), Action.KEEP_ALIVE, Action.RELEASE_CONTROL):
            drive.refuses(command, ANN_TWICE)
            assert drive.outcome.message == "the drive is controlled by opcua:ann session 0a1b2c3d"
        assert drive.enables

    def test_of_a_silent_session_is_taken_anew(self):
        drive = self.drive()
        drive.trips()
        drive.refuses(RUN, ANN_TWICE)
        assert drive.takes(TakeControl(5000), ANN_TWICE)
        drive.refuses(RUN, ANN)

    @pytest.mark.parametrize("timeout_ms", [0, 1000])
    def test_ends_by_itself_and_not_before(self, timeout_ms: int):
        drive = Drive(control="lease", fieldbus_timeout_ms=timeout_ms)
        assert drive.takes(TakeControl(60_000), ANN)
        drive.now += 59.0
        drive.refuses(TakeControl(5000), ANN_TWICE)
        drive.waits(1.0)
        assert drive.takes(TakeControl(5000), ANN_TWICE)

    def test_is_broken_by_an_engineers_other_session_which_is_an_event(self):
        eve = Identity(Source.OPCUA, "eve", Role.ENGINEER, connection="session 1")
        drive = Drive(control="lease")
        assert drive.takes(TakeControl(5000), eve)
        drive.runs(eve)
        assert drive.takes(TakeControl(5000), replace(eve, connection="session 2"))
        assert not drive.enables
        assert "opcua:eve session 2 takes control away from opcua:eve session 1" in told(drive.effects)


_CONNECTIONS = (ONE, OTHER, replace(ONE, connection="port 51236"), STRANGER)
_ASKS = st.tuples(
    st.sampled_from(_CONNECTIONS),
    st.sampled_from((SHUT_DOWN, RUN, RUN, ACKNOWLEDGE, Action.KEEP_ALIVE, Action.RESET_FAULT)),
)
_COMES_OR_GOES = st.builds(
    Connection, st.sampled_from(_CONNECTIONS), is_there=st.booleans(), has_others=st.just(True)
)
_PASSES_S = st.sampled_from((0.1, 0.9, 1.0, 11.0))


@given(
    events=st.lists(_ASKS | _COMES_OR_GOES | _PASSES_S, max_size=40), timeout_ms=st.sampled_from((0, 1000))
)
def test_between_two_stops_one_connection_moves_the_drive(
    events: list[tuple[Identity, int | Action] | Connection | float], timeout_ms: int
):
    """While the connection that has enabled the drive is open, whoever else is taken finds it stopped."""
    drive = Drive(fieldbus_timeout_ms=timeout_ms)
    drive.says(DriveState.READY)
    mover: Identity | None = None
    for event in events:
        match event:
            case Connection():
                drive.happens(event)
                mover = None if event.identity == mover and not event.is_there else mover
            case float():
                drive.waits(event)
            case who, command:
                was_enabling = drive.enables
                is_taken = drive.takes(command, who)
                if was_enabling and mover not in (None, who):
                    assert not (is_taken and drive.enables), "another connection has moved it on"
                mover = who if is_taken and drive.enables else mover
