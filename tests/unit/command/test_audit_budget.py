"""Refusals are anybody's to bring about: what is told of them is bounded by where they come from, whatever is
asked for and whatever the client calls itself; what is done is told as if there were none."""

from __future__ import annotations

import struct
from collections import Counter
from collections.abc import Callable
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bridge.command import Action, Code, Do, Identity, Rejection, Request, Source, Write
from bridge.command.audit import AT_ONCE, DONE_EVERY_S, REFUSED_EVERY_S, SUMMARY_S, AuditEntry, client_of
from bridge.command.drive_link import NodeState
from bridge.image import Value
from tests.support import sites
from tests.support.nightly import examples
from tests.support.node_states import node_goes
from tests.support.rig import ENABLE, SHUT_DOWN
from tests.support.views import dispatcher_of

FU1 = "conveyor/fu1"
SITE = sites.site(sites.bus(sites.node(sites.drive("fu1", "modbus", 0))), sites.modbus())
PLC = Identity(Source.MODBUS, "10.0.0.1", address="10.0.0.1:40000")


def stranger(port: int) -> Identity:
    return Identity(Source.MODBUS, "10.0.0.66", address=f"10.0.0.66:{port}")


class Hall:
    def __init__(self) -> None:
        self.plant = sites.plant_of(SITE)
        self.entries: list[AuditEntry] = []
        self.plant.audit.tell_to(self.entries.append)
        self.now = 100.0
        node_goes(self.plant, self.plant.nodes["conveyor"], NodeState.OPERATIONAL, self.now)
        self.plant.audit.on_time(self.now)
        self.dispatcher = dispatcher_of(self.plant, lambda: self.now)

    def pass_time(self, seconds: float) -> None:
        self.now += seconds
        self.plant.audit.on_time(self.now)

    def write(self, word: int, who: Identity = PLC) -> None:
        request = Request(who, FU1, Write({"control_word": word}))
        self.plant.submit(request, self.now, lambda outcome: None)

    def refused(self, who: Identity) -> list[AuditEntry]:
        return [
            entry
            for entry in self.entries
            if entry.is_refused and client_of(entry.identity) == client_of(who)
        ]

    def done(self) -> list[tuple[str, str, object]]:
        return [
            (entry.action, entry.ending.code, entry.new.get("control_word"))
            for entry in self.entries
            if not entry.is_refused
        ]


def made_up_units(hall: Hall, number: int) -> None:
    pdu = struct.pack(">BHH", 6, number % 1000, 1)
    hall.dispatcher.handle(10 + number % 240, pdu, stranger(number), lambda answer: None)


def made_up_registers(hall: Hall, number: int) -> None:
    pdu = struct.pack(">BHH", 6, 100 + number % 800, 1)
    hall.dispatcher.handle(1, pdu, stranger(number), lambda answer: None)


def made_up_targets(hall: Hall, number: int) -> None:
    request = Request(stranger(number), f"attic/fu{number}", Do(Action.STOP))
    hall.plant.submit(request, hall.now, lambda outcome: None)


def made_up_names(hall: Hall, number: int) -> None:
    who = Identity(Source.ZENOH, f"nobody{number}")
    hall.plant.rejected(Rejection(who, f"attic/{number}", "write", "malformed", "no"), hall.now)


def made_up_actions(hall: Hall, number: int) -> None:
    who = stranger(number)
    hall.plant.rejected(Rejection(who, FU1, f"Method{number}", Code.UNKNOWN_POINT, "no"), hall.now)


@pytest.mark.landing(5)
@pytest.mark.parametrize(
    "refuse", [made_up_units, made_up_registers, made_up_targets, made_up_names, made_up_actions]
)
def test_who_makes_things_up_has_one_budget(refuse: Callable[[Hall, int], None]) -> None:
    hall = Hall()
    times, minutes = 6000, 3
    for number in range(times):
        refuse(hall, number)
        hall.pass_time(60 * minutes / times)
    lines = [entry for entry in hall.entries if entry.is_refused]
    assert len(lines) <= AT_ONCE + 60 * minutes / REFUSED_EVERY_S + 2 * (minutes + 1)
    hall.plant.audit.sum_up(hall.now)
    assert sum(entry.count for entry in hall.entries if entry.is_refused) == times, "none is forgotten"


def write_and_release(hall: Hall, number: int) -> None:
    hall.write(SHUT_DOWN, stranger(number))
    request = Request(stranger(number), FU1, Do(Action.RELEASE_CONTROL))
    hall.plant.submit(request, hall.now, lambda outcome: None)


def write_on_and_release(hall: Hall, number: int) -> None:
    """The last setpoint waits to be told, the one before it is counted."""
    for setpoint in (1, 2, 3):
        values: dict[str, Value] = {"control_word": SHUT_DOWN, "setpoint_1": setpoint}
        hall.plant.submit(Request(stranger(1), FU1, Write(values)), hall.now, lambda outcome: None)
    hall.plant.submit(Request(stranger(1), FU1, Do(Action.RELEASE_CONTROL)), hall.now, lambda outcome: None)


def take_turns(hall: Hall, number: int) -> None:
    hall.write((SHUT_DOWN, ENABLE)[number % 2], stranger(1))


def new_names(hall: Hall, number: int) -> None:
    who = Identity(Source.ZENOH, f"c{number}")
    hall.plant.submit(Request(who, FU1, Write({"control_word": SHUT_DOWN})), hall.now, lambda outcome: None)
    hall.plant.submit(Request(who, FU1, Do(Action.RELEASE_CONTROL)), hall.now, lambda outcome: None)


@pytest.mark.landing(2)
@pytest.mark.parametrize(
    ("act", "requests"), [(write_and_release, 2), (write_on_and_release, 4), (take_turns, 1), (new_names, 2)]
)
def test_what_one_client_does_with_one_drive_has_a_budget(
    act: Callable[[Hall, int], None], requests: int
) -> None:
    """Accepted: else who may write washes the log of what was done."""
    hall = Hall()
    times, minutes, kinds = 6000, 3, 3
    for number in range(times):
        act(hall, number)
        hall.pass_time(60 * minutes / times)
    lines = len(hall.entries)
    assert lines <= kinds * (AT_ONCE + 60 * minutes / DONE_EVERY_S + 2 * (minutes + 1))
    hall.plant.audit.sum_up(hall.now)
    told = sum(entry.count for entry in hall.entries)
    assert told == times * requests, "none is forgotten"


def test_another_clients_refusals_are_told_all_the_same() -> None:
    hall = Hall()
    for number in range(5000):
        made_up_units(hall, number)
    other = Identity(Source.MODBUS, "10.0.0.7", address="10.0.0.7:1")
    hall.write(ENABLE | 0x10000, other)
    hall.dispatcher.handle(99, bytes.fromhex("06 0000 0001"), other, lambda answer: None)
    assert len(hall.refused(other)) == 2


def test_the_first_refusal_of_another_kind_is_told_within_a_flood() -> None:
    hall = Hall()
    for number in range(5000):
        made_up_units(hall, number)
    hall.write(0, stranger(1))
    hall.plant.rejected(Rejection(stranger(2), FU1, Action.START, Code.NOT_ALLOWED, "no"), hall.now)
    assert hall.entries[-1].action == Action.START


@pytest.mark.parametrize(
    ("address", "client"),
    [
        ("10.0.0.1:502", "10.0.0.1"),
        ("[fe80::1]:502", "fe80::1"),
        ("fe80::1", "fe80::1"),
        ("10.0.0.1", "10.0.0.1"),
        ("", ""),
    ],
)
def test_a_client_is_its_address_without_the_port(address: str, client: str) -> None:
    assert client_of(replace(PLC, address=address)) == client


REFUSALS = (made_up_units, made_up_registers, made_up_targets, made_up_names, made_up_actions)
STEPS = st.one_of(
    st.tuples(st.just("write"), st.sampled_from((SHUT_DOWN, ENABLE))),
    st.tuples(st.just("refuse"), st.integers(0, len(REFUSALS) - 1)),
    st.tuples(st.just("wait"), st.sampled_from((1, 20, 61))),
)


@settings(max_examples=examples(40))
@given(st.lists(STEPS, max_size=20))
def test_what_is_done_is_told_as_if_nothing_had_been_refused(steps: list[tuple[str, int]]) -> None:
    flooded, calm = Hall(), Hall()
    refused = Counter[str]()
    for hall in (flooded, calm):
        for kind, value in steps:
            if kind == "write":
                hall.write(value)
            elif kind == "wait":
                hall.pass_time(value)
            elif hall is flooded:
                for number in range(60):
                    REFUSALS[value](hall, number)
                refused["all"] += 60
        hall.pass_time(SUMMARY_S)
        hall.plant.audit.sum_up(hall.now)
    assert flooded.done() == calm.done()
    assert sum(entry.count for entry in flooded.entries if entry.is_refused) == refused["all"]
