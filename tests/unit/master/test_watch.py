"""What is on a bus and should not be there: told once a minute, shown for a minute."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import pytest

from bridge.canopen.duplicate import AnsweredTwice, StateChanges, TooManyHeartbeats
from bridge.canopen.frame import Frame
from bridge.command import Event
from bridge.master.mastership import BusMastership
from bridge.master.watch import BusWatch
from tests.support import sites


class Case:
    def __init__(self, own_id: int | None = 127) -> None:
        text = sites.site(sites.bus(sites.node(sites.drive("fu1", "none", 0))))
        self.plant = sites.plant_of(text)
        self.acts = True
        mastership = cast(BusMastership, SimpleNamespace(acts=lambda: self.acts))
        side = self.plant.side_of(self.plant.site.bus[0])
        self.watch = BusWatch("can0", own_id, mastership, {5: "conveyor"}, side)
        self.routes = self.watch.routes()

    def comes(self, can_id: int, data: bytes, time: float) -> None:
        self.routes[can_id](Frame(can_id, data, time))

    @property
    def told(self) -> list[Event]:
        return self.plant.events.waiting

    def point(self, leaf: str, now: float) -> object:
        self.watch.refresh(now)
        return self.plant.image.read(f"bus/can0/{leaf}").value


def test_it_listens_to_nmt_and_to_nodes_that_nobody_has_configured() -> None:
    routes = Case().routes
    assert set(routes) == {0x000, *range(0x701, 0x77F)} - {0x705}
    assert 0x77F in Case(own_id=None).routes


def test_another_master_is_told_in_words_and_once_a_minute() -> None:
    case = Case()
    for time in (10.0, 11.0, 69.9, 70.0):
        case.comes(0x000, b"\x01\x05", time)
    assert len(case.told) == 2
    message = case.told[0].message
    assert message.startswith("another NMT master is on the bus: it sent start for node 5")
    assert case.told[0].severity == 700
    assert case.point("second_master", 129.9) is True
    assert case.point("second_master", 130.0) is False


def test_where_this_bridge_does_not_act_another_one_is_the_master() -> None:
    case = Case()
    case.acts = False
    case.comes(0x000, b"\x01\x05", 10.0)
    assert case.told == []
    assert case.point("second_master", 10.0) is False


@pytest.mark.parametrize(("data", "does"), [(b"\0", "starts"), (b"\x05", "is on the bus")])
def test_a_stranger_is_told_with_what_it_does(data: bytes, does: str) -> None:
    case = Case()
    case.comes(0x70A, data, 10.0)
    assert case.told[0].message.startswith(f"A: node 10 {does} and is not in the site file")


def test_strangers_are_listed_by_number_for_a_minute() -> None:
    case = Case()
    case.comes(0x714, b"\x05", 10.0)
    case.comes(0x70A, b"\x05", 20.0)
    assert case.point("unexpected_nodes", 30.0) == "10, 20"
    assert case.point("unexpected_nodes", 70.0) == "10"
    assert case.point("unexpected_nodes", 80.0) == ""


def test_a_number_that_is_used_twice_is_told_with_its_sign() -> None:
    case = Case()
    case.watch.on_duplicate(5, AnsweredTwice(3), 10.0)
    case.watch.on_duplicate(5, AnsweredTwice(3), 11.0)
    case.watch.on_duplicate(6, TooManyHeartbeats(20, 0.5, 1.0), 11.0)
    case.watch.on_duplicate(7, StateChanges(8, 20), 11.0)
    assert [event.message for event in case.told] == [
        "node id 5 (conveyor) seems to be used twice: 3 SDO requests were answered twice",
        "node id 6 (unknown) seems to be used twice: 20 heartbeats came within 0.50 s, 1.00 s were expected",
        "node id 7 (unknown) seems to be used twice: its heartbeat changed state 8 times within 20 messages",
    ]
    assert case.point("duplicate_ids", 11.0) == "5, 6, 7"


@pytest.mark.parametrize(("own_id", "shown"), [(127, "127"), (None, "")])
def test_its_own_number_is_shown_where_it_has_one(own_id: int | None, shown: str) -> None:
    case = Case(own_id)
    case.watch.on_own_id(10.0)
    assert case.point("duplicate_ids", 10.0) == shown
    assert case.told == []
