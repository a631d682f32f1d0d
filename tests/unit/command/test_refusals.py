"""Refusals of what no drive refuses by itself: the source of their events, and their number."""

from __future__ import annotations

import pytest

from bridge.catalogue import Catalogue
from bridge.command import Code, EventQueue, Outcome, ReadParameter, Request, Start
from bridge.command.messages.request import DONE, Command
from bridge.command.refusals import Refusals
from bridge.text import Text
from tests.support.rig import PLC
from tests.unit.command.test_plant import Hall

WHY = Text.of("request.no_outputs", target="conveyor")


class Told:
    """Refusals and the events that come of them."""

    def __init__(self, catalogue: Catalogue) -> None:
        self._events = EventQueue()
        self.refusals = Refusals(catalogue, self._events)

    def sources(self) -> list[tuple[str, bool]]:
        """Sources of the events since the last call; and whether the event names another."""
        return [(one.source, one.said.code.startswith("request.refused_on")) for one in self._events.take()]


@pytest.fixture
def told() -> Told:
    return Told(Hall().plant.catalogue)


@pytest.mark.parametrize(
    ("target", "source"), [("conveyor", "conveyor"), ("conveyor/fu1", "conveyor/fu1"), ("bus/can0", "can0")]
)
def test_an_event_is_of_what_is_there(told: Told, target: str, source: str) -> None:
    told.refusals.report("START", PLC, target, WHY, 1.0)
    assert told.sources() == [(source, False)]


@pytest.mark.parametrize("target", ["", "can0", "conveyor/fu9", "x" * 1000])
def test_an_event_of_what_is_not_there_is_the_bridges(told: Told, target: str) -> None:
    told.refusals.report("START", PLC, target, WHY, 1.0)
    assert told.sources() == [("bridge", target != "")]


def test_refusals_of_one_kind_are_one_event_and_count_each(told: Told) -> None:
    told.refusals.report("START", PLC, "conveyor", WHY, 1.0, 3)
    told.refusals.report("START", PLC, "conveyor", WHY, 2.0)
    assert told.refusals.count == 4
    assert len(told.sources()) == 2


@pytest.mark.parametrize(
    ("command", "outcome", "count"),
    [
        (Start(), Outcome(Code.UNKNOWN_TARGET, WHY), 1),
        (Start(), DONE, 0),
        (ReadParameter("P102"), Outcome(Code.UNKNOWN_TARGET, WHY), 0),
    ],
)
def test_what_is_refused_is_counted_before_it_is_answered(
    told: Told, command: Command, outcome: Outcome, count: int
) -> None:
    answered: list[tuple[Outcome, int]] = []
    request = Request(PLC, "conveyor/fu9", command)
    reply = told.refusals.counted(request, 1.0, lambda one: answered.append((one, told.refusals.count)))
    assert answered == []
    reply(outcome)
    assert answered == [(outcome, count)]
