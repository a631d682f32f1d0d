"""Whoever refuses it, and for whatever reason: a refused write or command counts once, and is one event."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from bridge.command import (
    Action,
    Code,
    Do,
    EventKind,
    Identity,
    Outcome,
    ReadParameter,
    Rejection,
    Request,
    Role,
    SetTimeout,
    Source,
    Write,
    WriteParameter,
)
from bridge.text import Text
from tests.support.bench import PLC, Bench, write_site

FU1 = "conveyor/fu1"
OTHER = Identity(Source.MODBUS, "192.168.1.11", sets_parameters=True)
SETTER = replace(PLC, sets_parameters=True)
GUEST = Identity(Source.OPCUA, "guest", Role.OBSERVER)


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    bench = Bench(write_site(tmp_path))
    bench.run(3.0)
    bench.write(control_word=0x047E)
    return bench


def parameter(name: str, who: Identity = SETTER, value: float = 1.0, drive: str = FU1) -> Request:
    return Request(who, drive, WriteParameter(parameter=name, value=value))


REFUSED = {
    "another controller": Request(OTHER, FU1, Write({"control_word": 0x047E})),
    "a value that does not fit": Request(PLC, FU1, Write({"control_word": 70_000})),
    "a point that is not there": Request(PLC, FU1, Write({"no_such": 1})),
    "an observer": Request(GUEST, FU1, Do(Action.STOP)),
    "a time-out": Request(PLC, FU1, SetTimeout(timeout_ms=100)),
    "no drive": Request(PLC, "attic/fu9", Do(Action.STOP)),
    "no node": Request(PLC, "attic", Do(Action.RESET)),
    "no right on the node": Request(GUEST, "conveyor", Do(Action.RESET)),
    "no right on the bus": Request(GUEST, "bus/can0", Do(Action.STOP_NODE)),
    "no right to set parameters": parameter("P102", PLC),
    "another's parameters": parameter("P102", OTHER),
    "a protected parameter": parameter("P509"),
    "a parameter that is not there": parameter("P9999"),
    "a parameter that commands": parameter("740[1]"),
    "a value out of range": parameter("P102", value=1e9),
    "a parameter to be read": parameter("P700[1]"),
    "a drive that no channel reaches": parameter(
        "P102", replace(SETTER, source=Source.ZENOH), drive="conveyor/fu2"
    ),
    "saving": Request(PLC, FU1, Do(Action.SAVE_PARAMETERS)),
}


@pytest.mark.landing(6)
@pytest.mark.parametrize("what", REFUSED)
def test_it_counts_once_and_is_one_event(bench: Bench, what: str) -> None:
    before = bench.number("bridge/refused_writes")
    bench.events.clear()
    outcomes: list[Outcome] = []
    bench.view.submit(REFUSED[what], outcomes.append)
    bench.run(1.0)
    (outcome,) = outcomes
    assert not outcome.ok
    assert bench.number("bridge/refused_writes") == before + 1, outcome
    assert len([event for event in bench.events if event.kind is EventKind.REFUSED]) == 1
    target = REFUSED[what].target
    if target in bench.plant.drives:
        assert bench.number(f"{target}/supervision/refused_writes") == 1


@pytest.mark.landing
def test_so_does_what_a_protocol_refuses_by_itself(bench: Bench) -> None:
    before = bench.number("bridge/refused_writes")
    bench.plant.rejected(
        Rejection(PLC, "unit 77", "write", Code.UNKNOWN_TARGET, Text.plain("0Ah")), bench.now, 3
    )
    bench.run(0.2)
    assert bench.number("bridge/refused_writes") == before + 3


def test_reading_counts_for_nothing(bench: Bench) -> None:
    before = bench.number("bridge/refused_writes")
    for drive, name in ((FU1, "P9999"), ("attic/fu9", "P102"), ("conveyor/fu2", "P102")):
        request = Request(PLC, drive, ReadParameter(parameter=name))
        bench.view.submit(request, lambda outcome: None)
    bench.run(1.0)
    assert bench.number("bridge/refused_writes") == before
