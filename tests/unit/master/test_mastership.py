"""Who is in charge of a bus: what is told when this bridge gives way, and when it takes over."""

from __future__ import annotations

from typing import Any, cast

import pytest

from bridge.command import Event
from bridge.master.mastership import BusMastership
from bridge.master.standby import Standby
from bridge.node.node_core import NodeCore
from bridge.text import Text, render
from tests.support import sites


class Channel:
    def __init__(self) -> None:
        self.gaps: list[float] = []

    def on_bridge_gap(self, now: float) -> None:
        self.gaps.append(now)

    def refresh(self, now: float) -> None: ...


class Node:
    """Node as mastership needs it: who is told, and its drives."""

    def __init__(self, *, is_out_of_service: bool = False) -> None:
        self.is_out_of_service = is_out_of_service
        self.said: list[str] = []
        self.drive: Any = Channel()
        self.drive.channel = self.drive
        self.node: Any = self
        self.commanded = [self.drive]

    def say(self, said: Text, now: float) -> None:
        self.said.append(render(said))


class Case:
    def __init__(self, *, begins_acting: bool = False) -> None:
        plant = sites.plant_of(sites.site(sites.bus(sites.node(sites.drive("fu1", "none", 0)))))
        self.events = plant.events
        self.nodes = [Node(), Node(is_out_of_service=True)]
        self.listening = Standby(0.0 if begins_acting else 1.0, lambda: 0.0)
        nodes = cast("list[NodeCore]", self.nodes)
        self.mastership = BusMastership(plant.site.bus[0], nodes, plant.events, self.listening)

    @property
    def told(self) -> list[Event]:
        return self.events.waiting


@pytest.fixture
def case() -> Case:
    """It has listened since 10 s, for a second."""
    case = Case()
    case.mastership.on_time(10.0)
    return case


def test_it_listens_before_it_acts(case: Case) -> None:
    assert not case.mastership.acts()
    assert render(case.mastership.why_not) == "on can0 the bridge listens before it begins"
    case.mastership.on_time(11.0)
    assert case.mastership.acts()
    assert case.mastership.why_not == ""
    assert case.told == []


def test_it_gives_way_to_one_that_is_there_and_says_so_once(case: Case) -> None:
    why = case.mastership.heard("SYNC", 10.5)
    assert why is not None and render(why) == "another bridge is in charge of can0"
    assert case.mastership.heard("SYNC", 10.6) is None
    assert case.mastership.is_passive
    case.mastership.say_passive(10.5)
    (event,) = case.told
    assert event.message == (
        "passive: another bridge is in charge of this bus: it sent SYNC. Nothing is sent until that has been "
        "silent for 3000 ms"
    )
    assert case.nodes[0].said == ["passive: another bridge is in charge of can0"]
    assert case.nodes[1].said == [], "nobody waits for it"


def test_it_takes_over_when_the_other_has_been_silent_and_begins_with_all_stopped(case: Case) -> None:
    case.mastership.heard("SYNC", 10.5)
    case.mastership.on_time(13.4)
    assert case.mastership.is_passive
    case.mastership.on_time(13.5)
    assert case.mastership.acts()
    assert case.told[-1].message == "the other bridge has been silent for 3000 ms: this one takes over"
    assert case.nodes[0].said[-1] == "waiting"
    assert [node.drive.gaps for node in case.nodes] == [[13.5], [13.5]]


def test_one_that_has_acted_for_longer_than_it_listens_stays(case: Case) -> None:
    case.mastership.on_time(11.0)
    assert case.mastership.heard("SYNC", 13.0) is None
    assert case.mastership.acts()


def test_a_bus_that_is_back_is_still_the_others() -> None:
    case = Case()
    case.mastership.on_time(10.0)
    case.mastership.heard("SYNC", 10.5)
    case.nodes[0].said.clear()
    case.mastership.bus_is_gone()
    case.mastership.bus_is_back(20.0)
    assert case.mastership.is_passive
    assert case.nodes[0].said == ["passive: another bridge is in charge of can0"]
