"""One drive's channel: what counts as a report of the drive, what it tells, and when others may look."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from bridge.command import Action, EventKind, EventQueue, Outcome
from bridge.command.drive_channel import DriveChannel
from bridge.command.drive_link import NodeState
from bridge.command.effects import Effects
from bridge.config import DriveTable
from bridge.text import render
from tests.support.leg_words import ALL
from tests.support.rig import (
    ACKNOWLEDGE,
    ENABLE,
    ENABLED,
    INHIBITED,
    NORD,
    OTHER_PLC,
    PLC,
    READY,
    SHUT_DOWN,
    Rig,
    emergency,
)

POSITION = next(words for words in ALL if words.mapping == "cia402/profile-position")


def repeated(rig: Rig) -> None:
    """By a TPDO that is told as any other."""
    rig.drive_says(rig.channel.drive_status_word)


def unchanged(rig: Rig) -> None:
    """By a TPDO of which only this is told."""
    rig.channel.on_unchanged(rig.now)


repeats = pytest.mark.parametrize("repeats", [repeated, unchanged])


# what the drive says


@repeats
def test_what_a_drive_says_again_after_its_node_restarted_counts(repeats: Callable[[Rig], None]) -> None:
    rig = Rig(fieldbus_timeout_ms=0)
    rig.node(NodeState.OPERATIONAL)
    rig.drive_says(READY)
    rig.wait(0.5)
    rig.node(NodeState.BOOTING)
    rig.node(NodeState.OPERATIONAL)
    rig.wait(0.01)
    repeats(rig)
    rig.submit(Action.START)
    assert rig.enables, "it is ready: nothing has to be waited for"


@repeats
def test_a_start_during_a_ramp_goes_by_what_the_drive_says_again(repeats: Callable[[Rig], None]) -> None:
    rig = Rig(fieldbus_timeout_ms=0)
    rig.run()
    rig.write(SHUT_DOWN)
    outcomes = rig.submit(Action.START)
    rig.wait(0.2)
    assert (outcomes, rig.enables) == ([], False)
    repeats(rig)
    assert [outcome.ok for outcome in outcomes] == [True]
    assert rig.enables


def with_a_position() -> Rig:
    """A drive that is enabled, and is handed over a position."""
    rig = Rig(words=POSITION, fieldbus_timeout_ms=0)
    rig.node(NodeState.OPERATIONAL)
    rig.drive_says(POSITION.ready)
    rig.write(POSITION.shut_down)
    rig.write(POSITION.enable)
    rig.drive_says(POSITION.enabled)
    rig.write(**POSITION.setpoint)
    return rig


def test_a_position_is_handed_over_until_the_drive_has_taken_it() -> None:
    """Bit 4 of the control word, answered by bit 12 of the status word (CiA 402-2, profile position mode)."""
    rig = with_a_position()
    assert rig.sent & POSITION.handshake
    rig.drive_says(POSITION.enabled)
    assert rig.sent & POSITION.handshake
    rig.drive_says(POSITION.enabled | POSITION.taken)
    assert not rig.sent & POSITION.handshake
    rig.write(**POSITION.more)
    assert not rig.sent & POSITION.handshake, "its answer to the last one is still there"
    rig.drive_says(POSITION.enabled)
    assert rig.sent & POSITION.handshake


def test_an_answer_that_the_bridge_reads_late_is_an_answer() -> None:
    """A second has passed; the TPDO before it said what the drive had said all the time."""
    rig = with_a_position()
    rig.now += 1.2
    rig.drive_says(POSITION.enabled)
    rig.drive_says(POSITION.enabled | POSITION.taken)
    rig.channel.on_time(rig.now)
    assert [event.message for event in rig.events if event.kind is not EventKind.OWNER] == []


@pytest.mark.parametrize("state", [NodeState.OPERATIONAL, NodeState.DISABLED])
def test_the_fault_of_a_lost_node_is_over_when_it_is_back_or_switched_off(state: NodeState) -> None:
    rig = Rig(fieldbus_timeout_ms=0)
    rig.run()
    rig.node(NodeState.LOST)
    assert (rig.channel.current_fault, rig.channel.last_fault) == (10.9, 10.9)
    rig.node(NodeState.BOOTING)
    assert rig.channel.current_fault == 10.9
    rig.node(state)
    assert (rig.channel.current_fault, rig.channel.last_fault) == (0.0, 10.9)


def test_why_nothing_is_enabled_is_said_of_the_node_or_of_the_data() -> None:
    rig = Rig(fieldbus_timeout_ms=0, telegram_downtime_s=0.3, pdo_deadline_s=0.1)
    rig.run()
    rig.wait(0.3)
    assert rig.write(ENABLE).message == "no process data from the drive"
    rig.node(NodeState.LOST)
    assert rig.write(ENABLE).message == "node lost"
    rig.node(NodeState.BOOTING)
    assert rig.write(ENABLE).message == "node booting"
    rig = Rig(fieldbus_timeout_ms=0)
    rig.node(NodeState.BOOTING)
    assert rig.write(ENABLE).message == "the drive's node is booting"


# what it tells


def severities(rig: Rig) -> list[tuple[EventKind, int]]:
    return [(event.kind, event.severity) for event in rig.events if event.kind is not EventKind.OWNER]


def test_how_much_an_event_matters() -> None:
    """The worst first: 1000 is the drive that does not stop."""
    rig = Rig(telegram_downtime_s=0.3, pdo_deadline_s=10.0)
    rig.run()
    rig.wait(0.2)
    rig.node(NodeState.LOST)
    rig.channel.on_emcy(emergency(0x2310), rig.now)
    rig.channel.on_emcy(emergency(0), rig.now)
    assert severities(rig) == [
        (EventKind.WATCHDOG, 900),
        (EventKind.WATCHDOG, 700),
        (EventKind.EMERGENCY, 700),
        (EventKind.EMERGENCY, 100),
    ]


def test_a_silent_controller_that_is_ignored_matters_less() -> None:
    rig = Rig(telegram_downtime_s=-0.1)
    rig.run()
    rig.wait(0.2)
    assert severities(rig) == [(EventKind.WATCHDOG, 500)]


@pytest.mark.parametrize(
    ("settings", "is_told"),
    [({"on_expiry": "silence"}, True), ({"then_silence_ms": 100}, True), ({"on_expiry": "stop"}, False)],
)
def test_that_silence_would_not_stop_the_drive_is_told_where_it_is_to(
    settings: dict[str, object], is_told: bool
) -> None:
    rig = Rig(**settings)
    rig.channel.on_own_watch("", rig.now)
    rig.channel.on_own_watch("P151 is 0", rig.now)
    rig.channel.on_own_watch("P151 is 0", rig.now)
    assert [event.severity for event in rig.events] == [700] * is_told
    assert not rig.channel.silence_stops
    rig.channel.on_own_watch("", rig.now)
    assert rig.channel.silence_stops
    assert len(rig.events) == is_told


@pytest.mark.parametrize(
    ("why_not", "silent", "reaction"),
    [("", True, "silence, at which the drive stops by itself"), ("P151 is 0", False, "disable voltage")],
)
def test_a_trip_names_what_is_done(why_not: str, silent: bool, reaction: str) -> None:
    rig = Rig(on_expiry="silence")
    rig.run()
    rig.channel.on_own_watch(why_not, rig.now)
    rig.wait(0.2)
    assert rig.silent is silent
    trip = rig.told(EventKind.WATCHDOG)[-1]
    assert trip.startswith(f"modbus:192.168.1.10 was silent for 200 ms: {reaction}, E010/10.3")


# what others read


def test_before_the_first_telegram_nothing_has_been_counted() -> None:
    channel = Rig().channel
    assert (channel.trips, channel.refused_writes, channel.telegrams) == (0, 0, 0)


def test_the_number_of_a_telegram_begins_again_after_65535() -> None:
    rig = Rig()
    rig.write(SHUT_DOWN)
    assert rig.channel.telegrams == 1
    rig.channel.telegrams = 65_534
    rig.ask(Action.KEEP_ALIVE)
    assert rig.channel.telegrams == 65_535
    rig.ask(Action.KEEP_ALIVE)
    assert rig.channel.telegrams == 0


def test_the_time_that_is_left_is_that_until_the_trip() -> None:
    rig = Rig(fieldbus_timeout_ms=30_000)
    assert rig.channel.left_ms(rig.now) == 0
    rig.run()
    assert rig.channel.left_ms(rig.now) == 30_000
    assert rig.channel.left_ms(rig.now + 10) == 20_000
    assert rig.channel.left_ms(rig.now + 30) == 0
    assert rig.channel.left_ms(rig.now + 31) == 0, "the bridge is late"


def test_no_time_is_left_where_the_timer_trips_nothing() -> None:
    ignored = Rig(telegram_downtime_s=-0.1)
    ignored.run()
    assert (ignored.watchdog, ignored.channel.left_ms(ignored.now)) == ("off", 0)
    tripped = Rig()
    tripped.run()
    tripped.wait(0.2)
    tripped.write(SHUT_DOWN)
    assert (tripped.watchdog, tripped.channel.left_ms(tripped.now)) == ("tripped", 0)
    tripped.write(ACKNOWLEDGE)
    assert tripped.channel.left_ms(tripped.now) == 200


def test_who_may_set_parameters_is_not_changed_by_a_silent_owner() -> None:
    rig = Rig()
    rig.run()
    rig.wait(0.3)
    assert render(rig.channel.refusal(OTHER_PLC) or "") == f"the drive is controlled by {PLC}"
    assert rig.channel.refusal(PLC) is None


class Watched:
    """A channel, and what can be read of it whenever it says that it has settled."""

    def __init__(self) -> None:
        self.seen: list[tuple[object, ...]] = []
        table = DriveTable.model_validate({"slot": "fu1", "control": "modbus", "fieldbus_timeout_ms": 200})
        self.effects = Effects(EventQueue())
        self.channel = DriveChannel("conveyor/fu1", NORD, table, 2000, self.effects, self.on_settled)

    def on_settled(self, now: float) -> None:
        channel = self.channel
        self.seen.append((channel.current_fault, channel.last_fault, channel.refused_writes))

    def last(self) -> tuple[object, ...]:
        """What was to be read last, in all that has settled since the last call."""
        seen = self.seen[-1]
        self.seen.clear()
        return seen


def test_faults_and_refusals_are_there_to_be_read_when_it_has_settled() -> None:
    watched = Watched()
    channel = watched.channel
    channel.on_node(NodeState.OPERATIONAL, 1.0)
    channel.on_drive_fault(3.0, 4.0, 1.0)
    assert watched.last() == (3.0, 4.0, 0)
    channel.on_drive_fault(3.0, 4.0, 2.0)
    assert watched.seen == [], "nothing new"
    channel.on_refused(3.0)
    assert watched.last() == (3.0, 4.0, 1)
    channel.on_drive_fault(0.0, None, 4.0)
    assert watched.last() == (0.0, 4.0, 1)


def test_a_trip_gives_the_moment_at_which_it_was_due() -> None:
    watched = Watched()
    rig = Rig()
    rig.channel = watched.channel
    rig.run()
    assert watched.effects.stop_due is None
    watched.channel.on_time(rig.now + 0.5)
    assert watched.effects.stop_due == pytest.approx(rig.now + 0.2)
    watched.effects.stop_due = None
    outcomes: list[Outcome] = rig.submit(Action.KEEP_ALIVE)
    assert [outcome.ok for outcome in outcomes] == [True]
    rig.drive_says(INHIBITED)
    rig.drive_says(ENABLED)
    assert watched.effects.stop_due is None
