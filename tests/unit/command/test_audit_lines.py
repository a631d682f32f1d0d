"""When which line is written, to the moment, as the reference of the audit log promises."""

from __future__ import annotations

import pytest

from bridge.command import (
    Action,
    Code,
    Identity,
    Outcome,
    ReadParameter,
    Rejection,
    Reply,
    Request,
    Role,
    Source,
    WriteParameter,
)
from bridge.command.audit import AuditEntry, AuditOutcome
from bridge.text import Text
from tests.support.node_states import hand_over
from tests.support.rig import ENABLE, OPERATOR, OTHER_PLC, PLC, READY, SHUT_DOWN
from tests.unit.command.test_audit import FU1, SITE, Hall
from tests.unit.command.test_plant import Hall as RunningHall

Line = tuple[str, str, int]
"""Action, outcome, count."""


def done(request: Request, now: float, reply: Reply) -> bool:
    """A bus whose drives carry out everything."""
    reply(Outcome(Code.OK))
    return True


def stranger(number: int) -> Identity:
    return Identity(Source.MODBUS, f"10.1.0.{number}", address=f"10.1.{number // 200}.{number % 200}:40000")


@pytest.fixture
def hall() -> Hall:
    """At 100 s, when a summary has just been written. No controller is ever late, and all times are exact in
    binary."""
    return Hall(SITE.replace("timeout_ms = 200", "timeout_ms = 0"))


def at(hall: Hall, seconds: float) -> None:
    """So long after the hall began, without a summary."""
    hall.now = 100.0 + seconds


def round_at(hall: Hall, seconds: float) -> list[Line]:
    """What the trail's clock brings then."""
    at(hall, seconds)
    hall.plant.audit.on_time(hall.now)
    return hall.told()


def refuse(hall: Hall, times: int, who: Identity = OTHER_PLC, action: str = "write") -> list[Line]:
    for _ in range(times):
        rejection = Rejection(who, FU1, action, Code.NOT_ALLOWED, "no")
        hall.plant.audit.rejected(rejection, hall.now)
    return hall.told()


def acknowledge(hall: Hall, times: int) -> list[Line]:
    for _ in range(times):
        assert hall.ask(Action.RESET_FAULT).ok
    return hall.told()


# what a line has


@pytest.mark.parametrize("every_telegram", [False, True])
def test_reading_leaves_no_trace(every_telegram: bool) -> None:
    hall = Hall(every_telegram=every_telegram)
    outcomes: list[Outcome] = []
    hall.plant.submit(Request(PLC, FU1, ReadParameter("P102")), hall.now, outcomes.append, done)
    assert [outcome.ok for outcome in outcomes] == [True]
    assert hall.told() == []


def test_a_parameter_has_what_was_last_read_of_it(hall: Hall) -> None:
    name = "p102"
    point = f"{FU1}/parameter/{name}"
    for value in (2.5, 3.5):
        hall.plant.submit(Request(PLC, FU1, WriteParameter(name, value)), hall.now, lambda _: None, done)
        hall.plant.set(point, value, hall.now)
    assert [(entry.action, entry.old, entry.new) for entry in hall.entries] == [
        ("write_parameter", {}, {name: 2.5}),
        ("write_parameter", {name: 2.5}, {name: 3.5}),
    ]


def test_what_a_protocol_has_refused_was_not_forwarded(hall: Hall) -> None:
    hall.plant.rejected(Rejection(PLC, FU1, "write", "malformed", "no number", {"value": "x"}), hall.now)
    (entry,) = hall.entries
    assert entry.ending == AuditOutcome("malformed", "no number", forwarded=False)
    assert entry.new == {"value": "x"}
    assert entry.is_refused


def test_the_end_of_a_stop_has_a_line_of_the_bridges_own() -> None:
    hall = RunningHall()
    hall.run()
    entries: list[AuditEntry] = []
    hall.plant.audit.tell_to(entries.append)
    assert hall.submit(Action.STOP, identity=OPERATOR).ok
    hand_over(hall.plant, hall.drive, hall.now)
    hall.now = 100.0625
    hall.pdo(READY)
    hall.at(hall.now)
    assert [entry.action for entry in entries] == ["stop", "stop_ended"]
    bridge = Identity(Source.NONE, "drivebridge", Role.ENGINEER)
    ending = AuditOutcome(Code.OK, Text.of("stop.done_after", took_s=0.0625), forwarded=True)
    assert entries[1] == AuditEntry(100.0625, bridge, FU1, "stop_ended", ending, count=1)


# telegrams


def test_what_was_counted_is_written_each_minute(hall: Hall) -> None:
    for seconds in (0, 0.25, 59.5):
        at(hall, seconds)
        hall.write(control_word=SHUT_DOWN)
    assert hall.told() == [("write", "ok", 1)]
    assert round_at(hall, 59.75) == []
    assert round_at(hall, 60) == [("telegrams", "ok", 2)]
    hall.write(control_word=SHUT_DOWN)
    assert round_at(hall, 119.75) == []
    assert round_at(hall, 120) == [("telegrams", "ok", 1)]
    assert round_at(hall, 180) == []


def test_a_number_of_telegrams_has_the_time_up_to_which_they_were_counted(hall: Hall) -> None:
    """That of the summary, or of what ended them: minutes can be told apart."""
    hall.write(control_word=SHUT_DOWN)
    for seconds in (60, 120):
        at(hall, seconds - 0.5)
        hall.write(control_word=SHUT_DOWN)
        at(hall, seconds)
        hall.plant.audit.on_time(hall.now)
    at(hall, 130)
    hall.write(control_word=SHUT_DOWN)
    at(hall, 130.5)
    assert hall.ask(Action.QUICK_STOP).ok
    counted = [entry.time for entry in hall.entries if entry.action == "telegrams"]
    assert counted == [160.0, 220.0, 230.5]


def test_of_setpoints_one_telegram_a_second_is_written(hall: Hall) -> None:
    hall.write(control_word=ENABLE, setpoint_1=0)
    assert hall.told() == [("write", "ok", 1)]
    for seconds in (0.25, 0.75):
        at(hall, seconds)
        hall.write(setpoint_1=round(100 * seconds))
        assert hall.told() == []
    at(hall, 1)
    hall.write(setpoint_1=100)
    assert hall.entries[0].new == {"setpoint_1": 100}
    assert hall.told() == [("write", "ok", 1), ("telegrams", "ok", 2)]
    at(hall, 1.75)
    hall.write(setpoint_1=175)
    assert hall.told() == []


def test_the_last_setpoint_is_written_a_second_after_the_one_before(hall: Hall) -> None:
    hall.write(control_word=ENABLE, setpoint_1=0)
    at(hall, 0.25)
    hall.write(setpoint_1=1)
    assert hall.told() == [("write", "ok", 1)]
    assert round_at(hall, 0.75) == []
    assert round_at(hall, 1) == [("write", "ok", 1)]
    hall.write(setpoint_1=2)
    assert round_at(hall, 1.75) == []
    assert round_at(hall, 2) == [("write", "ok", 1)]
    assert round_at(hall, 3) == []


def test_a_value_that_comes_in_beside_the_others_is_told_at_once(hall: Hall) -> None:
    hall.write(control_word=ENABLE)
    hall.write(setpoint_1=5)
    hall.write(control_word=ENABLE, setpoint_2=7)
    hall.write(control_word=ENABLE, setpoint_1=5, setpoint_2=7)
    assert [entry.new for entry in hall.entries] == [
        {"control_word": ENABLE},
        {"setpoint_1": 5},
        {"control_word": ENABLE, "setpoint_2": 7},
    ]


def test_the_last_setpoint_of_an_owner_is_told_before_the_next_owner() -> None:
    hall = Hall()
    hall.write(control_word=SHUT_DOWN, setpoint_1=1)
    hall.write(setpoint_1=2)
    hall.write(setpoint_1=3)
    at(hall, 0.5)  # the first one's time-out is over
    hall.write(OTHER_PLC, control_word=SHUT_DOWN)
    assert [(entry.identity, entry.action, entry.count) for entry in hall.entries] == [
        (PLC, "write", 1),
        (PLC, "write", 1),
        (PLC, "telegrams", 1),
        (OTHER_PLC, "write", 1),
    ]
    assert hall.entries[1].new == {"setpoint_1": 3}


def test_what_was_counted_is_told_before_the_next_command(hall: Hall) -> None:
    for setpoint in (1, 2, 2, 3):
        hall.write(control_word=SHUT_DOWN, setpoint_1=setpoint)
    assert hall.ask(Action.QUICK_STOP).ok
    writes = [("write", "ok", 1), ("write", "ok", 1), ("telegrams", "ok", 2)]
    assert hall.told() == [*writes, ("quick_stop", "ok", 1)]


def test_somebody_elses_refusal_ends_no_repetition(hall: Hall) -> None:
    hall.write(control_word=SHUT_DOWN)
    assert hall.ask(Action.START, OTHER_PLC).code is Code.NOT_ALLOWED
    hall.write(control_word=SHUT_DOWN)
    assert hall.told() == [("write", "ok", 1), ("start", "not_allowed", 1)]


# what one client gets


def test_twenty_commands_at_once_and_one_a_second_are_told(hall: Hall) -> None:
    assert acknowledge(hall, 25) == [("reset_fault", "ok", 1)] * 20
    at(hall, 0.75)
    assert acknowledge(hall, 1) == []
    at(hall, 1)
    assert acknowledge(hall, 2) == [("reset_fault", "ok", 1)]
    assert round_at(hall, 60) == [("reset_fault", "ok", 7)]
    assert acknowledge(hall, 23) == [("reset_fault", "ok", 1)] * 20
    assert round_at(hall, 120) == [("reset_fault", "ok", 3)], "what was told of already is not told again"
    assert round_at(hall, 180) == []


def test_twenty_refusals_at_once_and_one_in_three_seconds_are_told(hall: Hall) -> None:
    assert refuse(hall, 25) == [("write", "not_allowed", 1)] * 20
    at(hall, 2.75)
    assert refuse(hall, 1) == []
    at(hall, 3)
    assert refuse(hall, 2) == [("write", "not_allowed", 1)]


def test_what_is_done_is_limited_for_each_drive_and_what_is_refused_for_all(
    hall: Hall,
) -> None:
    for target in (FU1, "conveyor/fu2"):
        for _ in range(25):
            assert hall.ask(Action.STOP, target=target).ok
        assert len(hall.told()) == 20
    for target, told in ((FU1, 20), ("conveyor/fu2", 0)):
        for _ in range(25):
            rejection = Rejection(OTHER_PLC, target, "write", Code.NOT_ALLOWED, "no")
            hall.plant.audit.rejected(rejection, hall.now)
        assert len(hall.told()) == told


def test_the_first_refusal_of_each_action_is_told_whatever_went_before(hall: Hall) -> None:
    refuse(hall, 100)
    for action in (Action.START, "call", Action.STOP):
        assert refuse(hall, 3, action=action) == [(action, "not_allowed", 1)]
    refuse(hall, 1, action="NoSuchMethod")
    assert refuse(hall, 3, action="AnyOtherMethod") == [], "what is made up is of one kind"


def test_a_summary_gives_nobody_another_twenty(hall: Hall) -> None:
    at(hall, 59.5)
    refuse(hall, 100)
    assert round_at(hall, 60) == [("write", "not_allowed", 80)]
    assert refuse(hall, 3, action="start") == [("start", "not_allowed", 1)]


def test_what_was_left_out_is_told_without_its_values(hall: Hall) -> None:
    for number in range(21):
        values = {"control_word": number}
        hall.plant.audit.rejected(Rejection(PLC, FU1, "write", "malformed", "no", values), 100.0)
    hall.told()
    at(hall, 60)
    hall.plant.audit.on_time(hall.now)
    (entry,) = hall.entries
    assert (entry.time, entry.old, entry.new, entry.count) == (160.0, {}, {}, 1)


def test_a_thousand_clients_are_told_apart_and_all_others_are_one(hall: Hall) -> None:
    told = [line for number in range(1100) for line in refuse(hall, 1, stranger(number))]
    assert told == [("write", "not_allowed", 1)] * 1020, "20 at once of the others"


def test_clients_that_are_gone_leave_room_for_others(hall: Hall) -> None:
    for number in range(1100):
        refuse(hall, 1, stranger(number))
    for seconds in (60, 120, 180):
        round_at(hall, seconds)
    for number in (2000, 2001):
        assert len(refuse(hall, 25, stranger(number))) == 20
