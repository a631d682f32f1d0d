"""One controller commands a drive, everybody else is refused (docs/adr/0009)."""

from __future__ import annotations

import pytest

from bridge.command import Action, Code, EventKind, Identity, Role, Source, Start
from bridge.command.drive_link import NodeState
from bridge.command.leg import owners
from bridge.command.leg.effect import StartEnded, Tell
from bridge.drive import DriveState
from bridge.text import render
from tests.support.leg import Leg, draft_of, running_nord, settings_of
from tests.support.rig import (
    ENABLE,
    ENGINEER,
    HALF_SPEED,
    OBSERVER,
    OPERATOR,
    OTHER_PLC,
    PLC,
    SHUT_DOWN,
    Rig,
)

BOB = Identity(Source.ZENOH, "bob")


class TestFixedSource:
    def test_the_first_valid_telegram_makes_its_sender_the_owner(self, rig: Rig):
        rig.write(SHUT_DOWN)
        assert rig.channel.owner == PLC
        assert rig.told(EventKind.OWNER) == ["controlled by modbus:192.168.1.10"]

    def test_another_connection_of_the_same_address_is_the_same_owner(self, running: Rig):
        again = Identity(Source.MODBUS, PLC.user, address="192.168.1.10:50123")
        assert running.write(ENABLE, 0x1000, identity=again).forwarded
        assert running.enables

    @pytest.mark.parametrize("stranger", [OTHER_PLC, OPERATOR, ENGINEER, BOB])
    def test_others_are_refused_and_counted(self, running: Rig, stranger: Identity):
        outcome = running.write(SHUT_DOWN, identity=stranger)
        assert outcome.code is Code.NOT_ALLOWED
        assert not outcome.forwarded
        assert running.enables
        assert running.channel.refused_writes == 1
        assert len(running.told(EventKind.REFUSED)) == 1

    def test_a_silent_owner_is_replaced_by_the_same_protocol_alone(self, running: Rig):
        running.wait(0.2)
        assert running.write(SHUT_DOWN, identity=OPERATOR).code is Code.NOT_ALLOWED
        assert running.write(SHUT_DOWN, identity=OTHER_PLC).ok
        assert running.channel.owner == OTHER_PLC

    def test_who_took_control_and_says_nothing_holds_nobody_up(self, rig: Rig):
        assert rig.ask(Action.TAKE_CONTROL).ok
        rig.wait(3600)
        assert rig.write(SHUT_DOWN, identity=OTHER_PLC).ok

    def test_a_released_drive_is_free(self, running: Rig):
        running.ask(Action.RELEASE_CONTROL)
        assert running.told(EventKind.OWNER)[-1] == "released by modbus:192.168.1.10"
        assert running.write(SHUT_DOWN, identity=OTHER_PLC).forwarded

    def test_a_reader_commands_nothing(self, rig: Rig):
        reader = Identity(Source.MODBUS, "192.168.1.99", Role.OBSERVER)
        assert rig.write(SHUT_DOWN, identity=reader).code is Code.NOT_ALLOWED

    def test_without_a_control_source_nobody_commands(self):
        rig = Rig(control="none")
        assert rig.write(SHUT_DOWN).code is Code.NOT_ALLOWED
        assert rig.ask(Action.TAKE_CONTROL, ENGINEER).code is Code.NOT_ALLOWED

    def test_a_new_owner_finds_the_drive_stopped_and_inherits_no_setpoints(self):
        """With the watchdog reporting only, the drive still moves when its silent owner is replaced."""
        rig = Rig(telegram_downtime_s=-0.1)
        rig.run()
        rig.wait(1)
        assert rig.enables
        assert not rig.write(ENABLE, identity=OTHER_PLC).forwarded
        assert not rig.enables
        rig.write(SHUT_DOWN, identity=OTHER_PLC)
        rig.write(ENABLE, identity=OTHER_PLC)
        assert rig.enables
        assert rig.sent_setpoints == (0, 0, 0, 0)


class TestLease:
    @pytest.fixture
    def rig(self) -> Rig:
        rig = Rig(control="lease", fieldbus_timeout_ms=0)
        rig.node(NodeState.OPERATIONAL)
        return rig

    @pytest.fixture
    def leased(self, rig: Rig) -> Rig:
        assert rig.ask(Action.TAKE_CONTROL, OPERATOR, ttl_ms=1000).ok
        rig.write(SHUT_DOWN, identity=OPERATOR)
        rig.write(ENABLE, HALF_SPEED, identity=OPERATOR)
        assert rig.enables
        return rig

    def test_nobody_writes_without_one(self, rig: Rig):
        outcome = rig.write(SHUT_DOWN, identity=OPERATOR)
        assert outcome.code is Code.NOT_ALLOWED
        assert "take control" in outcome.message

    @pytest.mark.parametrize("ttl_ms", [0, 99, 600_001, -1])
    def test_a_ttl_has_limits(self, rig: Rig, ttl_ms: int):
        assert rig.ask(Action.TAKE_CONTROL, OPERATOR, ttl_ms=ttl_ms).code is Code.OUT_OF_RANGE
        assert rig.channel.owner is None

    def test_any_protocol_may_take_it(self, rig: Rig):
        assert rig.ask(Action.TAKE_CONTROL, BOB, ttl_ms=1000).ok
        assert rig.channel.owner == BOB

    def test_it_runs_out_and_the_drive_is_stopped(self, leased: Rig):
        leased.wait(0.999)
        assert leased.enables
        leased.wait(0.001)
        assert not leased.enables
        assert leased.channel.owner is None
        assert leased.channel.trips == 0
        assert "the lease of opcua:ann ran out" in leased.told(EventKind.OWNER)

    @pytest.mark.parametrize("action", [Action.KEEP_ALIVE, Action.RESET_FAULT])
    def test_it_is_kept_by_going_on(self, leased: Rig, action: Action):
        for _ in range(5):
            leased.wait(0.9)
            assert leased.ask(action, OPERATOR).ok
        assert leased.channel.owner == OPERATOR

    def test_a_request_after_its_end_is_refused(self, leased: Rig):
        leased.now += 1.0
        assert leased.write(ENABLE, identity=OPERATOR).code is Code.NOT_ALLOWED
        assert not leased.enables

    def test_taken_again_it_gets_the_new_length_and_the_drive_goes_on(self, leased: Rig):
        assert leased.ask(Action.TAKE_CONTROL, OPERATOR, ttl_ms=5000).ok
        leased.wait(4)
        assert leased.enables

    def test_another_operator_waits(self, leased: Rig):
        assert leased.ask(Action.TAKE_CONTROL, BOB, ttl_ms=1000).code is Code.NOT_ALLOWED
        assert leased.enables

    def test_an_engineer_breaks_it_and_the_drive_is_stopped_first(self, leased: Rig):
        assert leased.ask(Action.TAKE_CONTROL, ENGINEER, ttl_ms=1000).ok
        assert leased.channel.owner == ENGINEER
        assert not leased.enables
        assert leased.write(SHUT_DOWN, identity=OPERATOR).code is Code.NOT_ALLOWED
        leased.write(SHUT_DOWN, identity=ENGINEER)
        assert leased.sent_setpoints == (0, 0, 0, 0)

    def test_that_it_was_broken_is_an_event(self, leased: Rig):
        leased.ask(Action.TAKE_CONTROL, ENGINEER, ttl_ms=1000)
        assert leased.told(EventKind.OWNER)[-2:] == [
            "opcua:eve takes control away from opcua:ann",
            "controlled by opcua:eve",
        ]

    def test_one_that_nobody_has_is_not_broken(self, rig: Rig):
        rig.ask(Action.TAKE_CONTROL, ENGINEER, ttl_ms=1000)
        rig.ask(Action.TAKE_CONTROL, ENGINEER, ttl_ms=1000)
        assert rig.told(EventKind.OWNER) == ["controlled by opcua:eve"]

    def test_a_reader_gets_none(self, rig: Rig):
        assert rig.ask(Action.TAKE_CONTROL, OBSERVER, ttl_ms=1000).code is Code.NOT_ALLOWED

    def test_a_release_ends_it(self, leased: Rig):
        leased.ask(Action.RELEASE_CONTROL, OPERATOR)
        assert leased.channel.owner is None
        assert not leased.enables
        leased.wait(10)
        assert not [message for message in leased.told(EventKind.OWNER) if "ran out" in message]


class TestStops:
    STOPS = (Action.STOP, Action.QUICK_STOP, Action.DISABLE_VOLTAGE)

    @pytest.mark.parametrize("action", STOPS)
    def test_they_are_taken_from_every_operator(self, running: Rig, action: Action):
        assert running.ask(action, BOB).ok
        assert not running.enables

    @pytest.mark.parametrize("action", STOPS)
    def test_where_the_site_file_forbids_it_from_the_owner_alone(self, action: Action):
        rig = Rig(stop_by_anyone=False)
        rig.run()
        for stranger in (BOB, OTHER_PLC, ENGINEER):
            assert rig.ask(action, stranger).code is Code.NOT_ALLOWED
        assert rig.enables
        assert rig.ask(action).ok
        assert not rig.enables

    def test_a_reader_stops_nothing(self, running: Rig):
        assert running.ask(Action.STOP, OBSERVER).code is Code.NOT_ALLOWED
        assert running.enables


@pytest.mark.parametrize("given", [{}, {"telegram_downtime_s": -0.1}])
@pytest.mark.parametrize("has_tripped", [True, False])
def test_who_takes_control_and_never_sends_holds_nobody_up(given: dict[str, object], has_tripped: bool):
    rig = Rig(**given)
    rig.run()
    if has_tripped:
        rig.wait(1.0)
    engineer = Identity(Source.MODBUS, "192.168.1.99", Role.ENGINEER)
    assert rig.ask(Action.TAKE_CONTROL, engineer).ok
    rig.wait(60.0)
    assert rig.ask(Action.RESET_FAULT, OTHER_PLC).ok
    assert rig.channel.owner == OTHER_PLC


class TestAnOwnerThatNobodyWatches:
    """With ``fieldbus_timeout_ms = 0`` nothing says that the owner is silent; a dead one blocks no one for
    ever."""

    def rig(self, **settings: object) -> Rig:
        rig = Rig(fieldbus_timeout_ms=0, **settings)
        rig.run()
        return rig

    def connected(self, rig: Rig, *, is_there: bool) -> None:
        rig.channel.on_connection(PLC, rig.now, is_there=is_there)

    def may_take_over(self, rig: Rig) -> bool:
        taken = rig.write(SHUT_DOWN, identity=OTHER_PLC).ok
        assert (rig.channel.owner == OTHER_PLC) is taken
        return taken

    def test_as_long_as_it_is_connected_it_may_be_quiet(self):
        rig = self.rig()
        rig.wait(3600)
        assert not self.may_take_over(rig)
        assert rig.enables

    @pytest.mark.parametrize("stop_by_anyone", [True, False])
    def test_without_a_connection_it_is_gone_after_10_s(self, stop_by_anyone: bool):
        rig = self.rig(stop_by_anyone=stop_by_anyone)
        self.connected(rig, is_there=False)
        rig.wait(9.9)
        assert not self.may_take_over(rig)
        assert rig.enables
        rig.wait(0.1)
        assert rig.ask(Action.STOP, OPERATOR).ok
        assert not rig.enables
        assert self.may_take_over(rig)
        assert rig.sent == SHUT_DOWN

    def test_taking_over_stops_the_drive_and_does_not_start_it(self):
        rig = self.rig()
        self.connected(rig, is_there=False)
        rig.wait(10)
        assert not rig.write(ENABLE, HALF_SPEED, identity=OTHER_PLC).forwarded
        assert not rig.enables

    @pytest.mark.parametrize("sign", ["telegram", "connection"])
    def test_a_sign_of_it_in_time_keeps_the_drive(self, sign: str):
        rig = self.rig()
        self.connected(rig, is_there=False)
        rig.wait(9)
        if sign == "telegram":
            rig.write(ENABLE, HALF_SPEED)
        else:
            self.connected(rig, is_there=True)
        rig.wait(3600)
        assert not self.may_take_over(rig)
        assert rig.enables

    def test_one_that_does_not_answer_to_a_stop_is_gone_after_10_s(self):
        rig = self.rig()
        assert rig.ask(Action.STOP, OPERATOR).ok
        rig.wait(5)
        assert rig.ask(Action.STOP, OPERATOR).ok  # the first one counts
        rig.wait(4.9)
        assert not self.may_take_over(rig)
        rig.wait(0.1)
        assert self.may_take_over(rig)

    def test_one_that_does_is_not(self):
        rig = self.rig()
        assert rig.ask(Action.STOP, OPERATOR).ok
        rig.write(SHUT_DOWN)
        rig.wait(3600)
        assert not self.may_take_over(rig)

    @pytest.mark.parametrize("stop_by_anyone", [True, False])
    def test_where_a_watchdog_runs_nothing_of_this_counts(self, stop_by_anyone: bool):
        rig = Rig(fieldbus_timeout_ms=30_000, stop_by_anyone=stop_by_anyone)
        rig.run()
        self.connected(rig, is_there=False)
        rig.ask(Action.STOP, OPERATOR)
        rig.wait(20)
        assert not self.may_take_over(rig)
        assert rig.ask(Action.STOP, OPERATOR).ok is stop_by_anyone

    def test_nor_does_it_end_a_lease(self):
        rig = Rig(fieldbus_timeout_ms=0, control="lease")
        rig.ask(Action.TAKE_CONTROL, ttl_ms=600_000)
        self.connected(rig, is_there=False)
        rig.wait(20)
        assert rig.channel.owner == PLC
        assert rig.write(SHUT_DOWN, identity=OTHER_PLC).code is Code.NOT_ALLOWED
        assert rig.ask(Action.TAKE_CONTROL, OTHER_PLC, ttl_ms=1000).ok

    def test_a_stranger_that_goes_says_nothing_of_the_owner(self):
        rig = self.rig()
        rig.channel.on_connection(OTHER_PLC, rig.now, is_there=False)
        rig.wait(20)
        assert not self.may_take_over(rig)


def test_who_leaves_stops_its_drive_and_takes_its_time_out_along() -> None:
    draft = draft_of(running_nord())
    draft.timer = draft.timer._replace(timeout_ms=500)
    owners.leave(draft)
    assert draft.owner.identity is None
    assert draft.timer.timeout_ms == 200
    assert not draft.settings.words.enables(draft.word)
    (told,) = draft.effects
    assert isinstance(told, Tell)
    assert render(told.said) == "fieldbus_timeout_ms = 200 again, as in the site file"


def test_a_start_that_is_going_on_ends_when_its_owner_leaves() -> None:
    leg = Leg(settings_of("nord/sk-tu4-cao", control="modbus"))
    leg.says(DriveState.READY)
    leg.asks(Start())
    assert leg.state.start is not None
    draft = draft_of(leg)
    owners.leave(draft)
    ended = [effect for effect in draft.effects if isinstance(effect, StartEnded)]
    said = [(one.outcome.code, one.outcome.message) for one in ended]
    assert said == [(Code.CANCELLED, "control of the drive has changed")]
    assert draft.start is None
