"""Events: all that matter, and no flood."""

from __future__ import annotations

from dataclasses import replace

import pytest

from bridge.command import Event, EventKind
from bridge.command.messages.event import EventGate, EventQueue


def event(kind: EventKind, time: float, source: str = "conveyor/fu1") -> Event:
    return Event(time, kind, source, 300, "")


def test_a_client_that_is_refused_a_thousand_times_is_told_of_ten_times_a_second():
    gate = EventGate()
    told = [gate.admits(event(EventKind.REFUSED, n / 500)) for n in range(1000)]
    assert sum(told) == 20


def test_who_floods_hides_nobody_else():
    gate = EventGate()
    for _ in range(100):
        gate.admits(event(EventKind.REFUSED, 5.0))
    assert gate.admits(event(EventKind.REFUSED, 5.0, "conveyor/fu2"))
    assert gate.admits(event(EventKind.EMERGENCY, 5.0))


def test_events_wait_in_order_until_they_are_taken():
    queue = EventQueue()
    first, second = event(EventKind.BUS, 1.0), event(EventKind.BUS, 0.5)
    queue.report(first)
    queue.report(second)
    assert queue.take() == [first, second]
    assert queue.take() == queue.waiting == []


REPEATING = (EventKind.REFUSED, EventKind.EMERGENCY, EventKind.CONFIGURATION, EventKind.INTRUDER)
"""What somebody on the network or on the bus can bring about at will."""


@pytest.mark.parametrize("kind", REPEATING)
def test_what_anybody_can_repeat_is_told_ten_times_a_second(kind: EventKind):
    gate = EventGate()
    assert [gate.admits(event(kind, 5.0)) for _ in range(11)] == [True] * 10 + [False]
    assert not gate.admits(event(kind, 5.99))
    assert gate.admits(event(kind, 6.0)), "another second"


@pytest.mark.parametrize("kind", [kind for kind in EventKind if kind not in REPEATING])
def test_what_happens_to_a_drive_is_always_told(kind: EventKind):
    gate = EventGate()
    assert all(gate.admits(event(kind, 5.0)) for _ in range(100))


def test_the_text_has_the_cause_behind_the_message_where_one_is_known():
    lost = Event(5.0, EventKind.NODE_LOST, "conveyor", 700, "node lost")
    assert lost.text == "node lost"
    assert replace(lost, because="can0 is silent").text == "node lost (because: can0 is silent)"
