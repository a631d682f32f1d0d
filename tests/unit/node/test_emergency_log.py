"""Emergencies of a node that babbles: the last of them to read, each told or counted."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.canopen.emcy import Emergency
from bridge.canopen.frame import Frame
from bridge.command import EventKind
from bridge.node.emergency_log import EmergencyLog
from tests.support.bench import Bench, write_site

EMCY = 0x085


def emergencies(bench: Bench) -> list[str]:
    return [event.message for event in bench.events if event.kind is EventKind.EMERGENCY]


def test_the_last_eight_emergencies_can_be_read(tmp_path: Path) -> None:
    bench = Bench(write_site(tmp_path))
    bench.run(1.0)
    assert bench.value("conveyor/node/emcy_history") == "[]"
    for number in range(10):
        bench.receive(Frame(EMCY, bytes((number, 0x10, 0x11, 0, 0, 0, 0, 0))))
        bench.run(0.2)
    history = json.loads(str(bench.value("conveyor/node/emcy_history")))
    assert [entry["code"] for entry in history] == [f"10{number:02X}h" for number in range(9, 1, -1)]
    assert history[0]["register"] == "11h"
    assert history[0]["vendor"] == "0000000000"
    assert history[0]["text"]


@pytest.mark.landing
def test_a_babbling_node_is_told_ten_times_a_second_and_its_last_word_arrives(tmp_path: Path) -> None:
    bench = Bench(write_site(tmp_path))
    bench.run(1.0)
    bench.events.clear()
    for number in range(5000):
        bench.receive(Frame(EMCY, bytes((number & 0xFF, 0x10, 0x11, 0, 0, 0, 0, 0))))
        bench.run(0.001)
    assert 16 <= len(emergencies(bench)) <= 16 + 52
    bench.receive(Frame(EMCY, bytes(8)))
    bench.run(0.5)
    assert bench.value("conveyor/fu1/status/emcy_code") == 0
    assert bench.number("conveyor/node/emcy_suppressed") > 4900


@given(st.integers(1, 40), st.integers(0, 120), st.floats(0, 0.05))
def test_every_emergency_is_told_or_counted(drives: int, number: int, pause_s: float) -> None:
    """A node may name drives that there are not: what waits is bounded, what is left out is counted."""
    log, now, told = EmergencyLog(), 0.0, 0
    arrivals = [place % drives for place in range(number)]
    for drive in arrivals:
        now += pause_s
        told += len(log.on_time(now))
        told += log.add(Emergency(0x1000, 0, b""), drive, now)
    while (due := log.next_deadline()) is not None:
        told += len(log.on_time(due))
    assert told + log.suppressed == len(arrivals)


@given(st.lists(st.tuples(st.floats(0, 0.3), st.sampled_from([None, 0, 1, 2, 99]), st.integers(0, 9))))
def test_the_newest_of_every_drive_is_told_in_the_end(arrivals: list[tuple[float, int | None, int]]) -> None:
    log, now = EmergencyLog(), 0.0
    told: dict[int | None, int] = {}
    for pause, number, code in arrivals:
        now += pause
        for emergency, about, _ in log.on_time(now):
            told[about] = emergency.code
        if log.add(Emergency(code, 0, b""), number, now):
            told[number] = code
    while (due := log.next_deadline()) is not None:
        now = max(now, due)
        for emergency, about, _ in log.on_time(now):
            told[about] = emergency.code
    assert told == {number: code for _, number, code in arrivals}
