"""What the plant makes of requests and refusals: events, counts, and when the bus has to be told."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from bridge.catalogue import Catalogue
from bridge.command import (
    Action,
    Code,
    Do,
    Event,
    EventKind,
    Identity,
    Outcome,
    Plant,
    ReadParameter,
    Rejection,
    Reply,
    Request,
    SetTimeout,
    Start,
    Write,
)
from bridge.command.drive_link import NodeState
from bridge.config import Site
from bridge.image import Quality, Reading
from tests.support import sites
from tests.support.node_states import hand_over, node_goes
from tests.support.outcomes import in_english
from tests.support.rig import ENABLE, ENABLED, OPERATOR, PLC, READY, SHUT_DOWN
from tests.unit.command.test_plant import SITE, Hall

FU1, INFEED = "conveyor/fu1", "conveyor/infeed"
BOTH = SITE.replace(
    'control = "lease"\nfieldbus_timeout_ms = 0', 'control = "modbus"\nfieldbus_timeout_ms = 125'
)
"""Both drives have a controller on Modbus, and a time-out."""


@pytest.fixture
def hall() -> Hall:
    return Hall()


@pytest.fixture
def running(hall: Hall) -> Hall:
    hall.run()
    return hall


def refused(hall: Hall) -> list[tuple[str, str]]:
    return [(event.source, event.message) for event in hall.events if event.kind is EventKind.REFUSED]


def test_what_a_node_has_reported_is_told_before_what_comes_after_it(hall: Hall) -> None:
    first, second, third = (
        Event(1.0, EventKind.BUS, "can0", 300, text) for text in ("first", "second", "third")
    )
    hall.events.clear()
    hall.plant.events.report(first)
    assert hall.events == []
    hall.plant.report(second)
    hall.plant.events.report(third)
    assert [event.message for event in hall.events] == ["first", "second"]
    hall.plant.tell_events()
    assert [event.message for event in hall.events] == ["first", "second", "third"]


def test_what_a_listener_reports_is_told_too(hall: Hall) -> None:
    """And nothing is told twice."""
    hall.events.clear()

    def answer(event: Event) -> None:
        if event.message == "first":
            hall.plant.events.report(Event(1.0, EventKind.BUS, "can0", 300, "second"))

    hall.plant.on_event(answer)
    hall.plant.events.report(Event(1.0, EventKind.BUS, "can0", 300, "first"))
    hall.plant.tell_events()
    assert [event.message for event in hall.events] == ["first", "second"]


def counted(hall: Hall) -> object:
    hall.plant.refresh(hall.now)
    return hall.plant.image.read("bridge/refused_writes").value


# from the start


def test_what_is_known_from_the_start_is_good_from_then_on() -> None:
    site = Site.model_validate(sites.parsed(SITE))
    plant = Plant(Catalogue.of(site, {sites.FAMILY: sites.family(sites.FAMILY)}), "1.2", 5.0)
    for name, value in {
        "bridge/version": "1.2",
        "bridge/drives_configured": 2,
        "bridge/modbus_refused_connections": 0,
        "bridge/zenoh_broken_connections": 0,
        "conveyor/node/last_fault": 0.0,
        f"{FU1}/supervision/sdo_abort_code": 0,
        f"{FU1}/supervision/owner": "",
        f"{FU1}/command/setpoint_1": 0,
    }.items():
        reading = plant.image.read(name)
        assert reading.value == value, name
        assert reading.quality is Quality.GOOD, name
    assert plant.image.read("bridge/version") == Reading("1.2", Quality.GOOD, 5.0, "")
    assert plant.image.read("conveyor/node/last_fault").time == 5.0
    plant.refresh(6.0)
    for name in ("bridge/refused_writes", "bridge/drives_good"):
        assert plant.image.read(name) == Reading(0, Quality.GOOD, 6.0, "")


# the end


def test_a_bridge_that_is_stopped_stops_its_drives_and_takes_stops_alone(running: Hall) -> None:
    running.plant.close(running.now)
    assert running.drive.channel.output.words[:2] == (SHUT_DOWN, 0)
    running.flushed.clear()
    outcomes: list[Outcome] = []
    for command in (Start(), Do(Action.RESET), Write({"control_word": ENABLE})):
        running.view.submit(Request(PLC, FU1, command), outcomes.append)
    assert [in_english(one) for one in outcomes] == [
        Outcome(Code.NOT_READY, "the bridge is being stopped", forwarded=False)
    ] * 3
    assert running.flushed == []
    assert running.submit(Action.DISABLE_VOLTAGE, identity=OPERATOR).ok
    assert len(running.flushed) == 1


# when the bus has to know


def test_of_a_refusal_the_bus_is_told_nothing(running: Hall) -> None:
    running.flushed.clear()
    assert running.submit(Action.STOP, "conveyor/fu9").code is Code.UNKNOWN_TARGET
    assert running.submit(Action.RESET, "conveyor").code is Code.UNKNOWN_TARGET
    assert running.submit(Action.START, identity=OPERATOR).code is Code.NOT_ALLOWED
    assert running.flushed == []


def test_what_may_end_sooner_than_before_is_told_to_the_bus() -> None:
    hall = Hall(
        SITE.replace(
            "fieldbus_timeout_ms = 200", "fieldbus_timeout_ms = 2000\nfieldbus_timeout_writable = true"
        )
    )
    hall.run()
    hall.flushed.clear()
    assert hall.submit(Action.KEEP_ALIVE).ok
    assert hall.flushed == []
    outcomes: list[Outcome] = []
    hall.view.submit(Request(PLC, FU1, SetTimeout(1000)), outcomes.append)
    assert len(hall.flushed) == 1


def test_a_sign_of_life_late_enough_takes_back_the_stop_that_the_bus_was_told_of(running: Hall) -> None:
    """The bus sends by itself for as long as the bridge may hang, and one period more."""
    ahead_s = running.drive.burst_s
    for left_s, is_told in ((ahead_s + 0.01, False), (ahead_s - 0.01, True)):
        running.submit(Action.KEEP_ALIVE)
        running.now += 0.2 - left_s
        running.flushed.clear()
        running.submit(Action.KEEP_ALIVE)
        assert bool(running.flushed) is is_told


def test_a_drive_without_a_time_out_has_no_stop_to_be_taken_back() -> None:
    hall = Hall(SITE.replace("fieldbus_timeout_ms = 200", "fieldbus_timeout_ms = 0"))
    hall.run()
    hall.flushed.clear()
    hall.submit(Action.KEEP_ALIVE)
    assert hall.flushed == []


def test_the_bus_is_told_even_if_who_carries_it_out_fails(running: Hall) -> None:
    def fail(request: Request, reply: Reply) -> bool:
        raise RuntimeError(request.target)

    running.carry_out = fail
    running.flushed.clear()
    with pytest.raises(RuntimeError):
        running.view.submit(Request(PLC, "conveyor", Do(Action.RESET)), lambda outcome: None)
    assert len(running.flushed) == 1


def test_a_stop_is_unsent_until_it_has_been_handed_over(running: Hall) -> None:
    plant = running.plant
    for drive in plant.drives.values():
        hand_over(plant, drive, running.now)
    assert plant.unsent_stops == set()
    running.submit(Action.STOP)
    assert plant.unsent_stops == {running.drive}
    hand_over(plant, running.drive, running.now)
    assert plant.unsent_stops == set()


def test_a_drive_trips_at_its_deadline_and_not_a_moment_later() -> None:
    hall = Hall(SITE.replace("fieldbus_timeout_ms = 200", "fieldbus_timeout_ms = 250"))
    hall.run()
    hall.drive.channel.link.pdo_deadline_s = None
    assert hall.plant.next_deadline(hall.now) == 100.25
    hall.at(100.25)
    assert hall.value("supervision/trips") == 1


@pytest.mark.parametrize("first", [FU1, INFEED])
def test_how_late_stops_are_counts_from_the_first_that_was_due(first: str) -> None:
    hall = Hall(BOTH)
    node_goes(hall.plant, hall.node, NodeState.OPERATIONAL, hall.now)
    for drive in (FU1, INFEED):
        hall.plant.drives[drive].on_process_data((READY, 0, 0, 0), hall.now)
        hall.view.submit(Request(PLC, drive, Write({"control_word": SHUT_DOWN})), lambda outcome: None)
    assert hall.plant.take_stop_due() is None
    hall.at(100.5)
    assert hall.plant.take_stop_due() == 100.125
    assert hall.plant.take_stop_due() is None
    hall.now = 101.0
    hall.view.submit(Request(PLC, first, Do(Action.RESET_FAULT)), lambda outcome: None)
    hall.at(102.0)
    due = hall.plant.take_stop_due()
    assert due == 101.0 + hall.plant.drives[first].channel.timeout_ms / 1000


# refusals


@pytest.mark.parametrize(
    ("target", "source", "what"),
    [
        (FU1, FU1, "write"),
        ("conveyor", "conveyor", "write"),
        ("bus/can0", "can0", "write"),
        ("bus/can7", "bridge", "write on 'bus/can7'"),
        ("attic/fu9", "bridge", "write on 'attic/fu9'"),
    ],
)
def test_an_event_is_from_what_it_is_about_or_else_from_the_bridge(
    hall: Hall, target: str, source: str, what: str
) -> None:
    hall.view.rejected(Rejection(OPERATOR, target, "write", Code.READ_ONLY, "no"))
    assert refused(hall) == [(source, f"{what} by {OPERATOR} refused: no")]
    assert [event.severity for event in hall.events] == [300]
    assert counted(hall) == 1


def test_however_long_a_name_somebody_makes_up_the_event_is_short(hall: Hall) -> None:
    hall.view.rejected(Rejection(OPERATOR, "x" * 5000, "write", Code.UNKNOWN_TARGET, "no"))
    (event,) = hall.events
    assert "x" * 80 in event.message
    assert len(event.message) < 150


def test_a_refusal_has_the_time_of_the_last_of_its_kind(hall: Hall) -> None:
    rejection = Rejection(OPERATOR, FU1, "write", Code.READ_ONLY, "no")
    hall.view.rejected(rejection, 99.5, 3)
    hall.view.rejected(rejection)
    assert [event.time for event in hall.events] == [99.5, 100.0]
    assert counted(hall) == 4


def carry_out(code: Code) -> Callable[[Request, float, Reply], bool]:
    def done(request: Request, now: float, reply: Reply) -> bool:
        reply(Outcome(code, "as it is"))
        return True

    return done


@pytest.mark.parametrize(
    ("command", "target", "code", "is_told"),
    [
        (Do(Action.RESET), "conveyor", Code.OK, False),
        (Do(Action.RESET), "conveyor", Code.NOT_ALLOWED, True),
        (Do(Action.STOP), "attic/fu9", Code.UNKNOWN_TARGET, True),
        (ReadParameter("P102"), "attic/fu9", Code.UNKNOWN_TARGET, False),
        (ReadParameter("P102"), FU1, Code.OK, False),
    ],
)
def test_refused_commands_are_events_and_refused_reads_are_not(
    hall: Hall, command: Do | ReadParameter, target: str, code: Code, is_told: bool
) -> None:
    outcomes: list[Outcome] = []
    hall.plant.submit(Request(PLC, target, command), hall.now, outcomes.append, carry_out(code))
    assert [outcome.code for outcome in outcomes] == [code]
    assert len(refused(hall)) == is_told
    assert counted(hall) == is_told


def test_without_a_bus_nobody_looks_after_parameters_and_nodes() -> None:
    plant = sites.plant_of(SITE)
    outcomes: list[Outcome] = []
    for target, command in ((FU1, ReadParameter("P102")), ("conveyor", Do(Action.RESET))):
        assert not plant.submit(Request(PLC, target, command), 1.0, outcomes.append)
    assert [in_english(one) for one in outcomes] == [
        Outcome(Code.NOT_READY, f"{FU1} is on no bus", forwarded=False),
        Outcome(Code.UNKNOWN_TARGET, "there is no node 'conveyor'"),
    ]


def test_a_client_that_goes_is_told_to_every_drive() -> None:
    """Without a time-out an owner is gone 10 s after its last connection."""
    hall = Hall(SITE.replace("fieldbus_timeout_ms = 200", "fieldbus_timeout_ms = 0"))
    hall.run()
    hall.view.on_connection(PLC, is_there=False)
    hall.now += 10.5
    hall.pdo(ENABLED)
    other = Identity(PLC.source, "192.168.1.99")
    assert hall.write(identity=other, control_word=SHUT_DOWN).ok
    assert hall.value("supervision/owner") == str(other)


# who listens


def test_who_has_gone_is_told_no_more_and_may_go_twice(hall: Hall) -> None:
    gone: list[Event] = []
    hall.view.on_event(gone.append)
    node_goes(hall.plant, hall.node, NodeState.OPERATIONAL, 1.0)
    hall.view.forget(gone.append)
    hall.view.forget(gone.append)
    node_goes(hall.plant, hall.node, NodeState.LOST, 2.0)
    assert [(event.kind, event.severity) for event in gone] == [(EventKind.NODE_BACK, 200)]
    told = [(event.kind, event.severity) for event in hall.events if event.source == "conveyor"]
    assert told == [(EventKind.NODE_BACK, 200), (EventKind.NODE_LOST, 800)]


def test_a_state_that_is_not_told_is_shown_all_the_same(hall: Hall) -> None:
    node_goes(hall.plant, hall.node, NodeState.OPERATIONAL, 1.0, tell=False)
    assert hall.events == []
    assert hall.plant.image.read("conveyor/node/state").value == 2


def test_a_count_goes_up_by_one_where_nothing_else_is_said(hall: Hall) -> None:
    hall.view.count("modbus_refused_connections")
    hall.view.count("modbus_refused_connections", 3)
    assert hall.plant.image.read("bridge/modbus_refused_connections") == Reading(4, Quality.GOOD, 100.0, "")
