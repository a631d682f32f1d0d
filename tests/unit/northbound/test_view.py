"""The view of the plant and that of a front: a server cannot tell them apart by who listens."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from bridge.command import Event, EventKind
from bridge.mirror import MirrorClient, protocol
from bridge.northbound.view import View
from bridge.text import Text
from bridge.zenohlink import Sample
from tests.support import sites
from tests.support.views import view_of

SITE = sites.site(sites.bus(sites.node(sites.drive("fu1", "modbus", 0))))
TRIP = Event(10.0, EventKind.WATCHDOG, "conveyor/fu1", 900, Text.plain("tripped"))

Tell = Callable[[Event], None]


def of_the_plant() -> tuple[View, Tell]:
    plant = sites.plant_of(SITE)
    return view_of(plant), plant.report


def of_a_front() -> tuple[View, Tell]:
    client = MirrorClient("unixsock-stream/none")
    return client, lambda event: client._on_event(Sample(protocol.EVENT, protocol.encode(event)))


@pytest.fixture(params=[of_the_plant, of_a_front])
def told(request: pytest.FixtureRequest) -> tuple[View, Tell]:
    return request.param()


def test_who_is_forgotten_hears_nothing_more(told: tuple[View, Tell]) -> None:
    view, tell = told
    heard: list[Event] = []
    view.on_event(heard.append)
    tell(TRIP)
    view.forget(heard.append)
    tell(TRIP)
    assert heard == [TRIP]


def test_who_has_never_listened_can_be_forgotten(told: tuple[View, Tell]) -> None:
    view, tell = told
    heard: list[Event] = []
    view.on_event(heard.append)
    view.forget(print)
    tell(TRIP)
    assert heard == [TRIP]


def test_who_has_heard_enough_takes_the_event_from_nobody(told: tuple[View, Tell]) -> None:
    view, tell = told
    heard: list[Event] = []

    def once(event: Event) -> None:
        view.forget(once)

    view.on_event(once)
    view.on_event(heard.append)
    tell(TRIP)
    assert heard == [TRIP]
