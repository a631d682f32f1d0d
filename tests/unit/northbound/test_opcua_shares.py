"""What one address may have of the monitored items that all share; no server."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest
from asyncua import ua

from bridge.northbound.opcua import shares
from bridge.northbound.opcua.eventfilter import EventFilter
from bridge.northbound.opcua.items import EventItem, Settings
from bridge.northbound.opcua.shares import Share, room_for_items
from bridge.northbound.opcua.subscription import Subscription, terms
from bridge.northbound.opcua.where import Where

HERE, NEIGHBOUR, ELSEWHERE = "2001:db8::1", "2001:db8::2", "10.0.0.1"


def listening(address: str, items: int, filter_: EventFilter) -> Subscription:
    owner: Any = SimpleNamespace(address=address)
    made = Subscription(1, owner, terms(ua.CreateSubscriptionParameters()), enabled=True)
    for number in range(items):
        settings = Settings(number, 0, 5, True)
        made.add(EventItem(number, ua.NodeId("conveyor", 2), settings, filter_, ua.MonitoringMode.Reporting))
    return made


def simple(fields: int = 5, operands: int = 0) -> EventFilter:
    elements: Any = [SimpleNamespace(operands=[None] * operands)]
    return EventFilter(["Message"] * fields, Where(elements), None)


@pytest.fixture(autouse=True)
def limits(monkeypatch: pytest.MonkeyPatch) -> None:
    for name, limit in {
        "MOST_ITEMS": 1000,
        "MOST_ITEMS_OF_ADDRESS": 500,
        "MOST_LISTENERS": 100,
        "MOST_LISTENERS_OF_ADDRESS": 60,
    }.items():
        monkeypatch.setattr(shares, name, limit)


def test_one_address_takes_no_more_than_its_share() -> None:
    there = [listening(HERE, 40, simple()), listening(NEIGHBOUR, 20, simple())]
    assert room_for_items(HERE, there) == Share(440, 0), "one network of 64 bits is one address"
    assert room_for_items(ELSEWHERE, there) == Share(500, 40)
    there.append(listening(ELSEWHERE, 30, simple()))
    assert room_for_items("10.0.0.2", there) == Share(500, 10)


@pytest.mark.parametrize(
    ("filter_", "weight"),
    [(simple(1), 1), (simple(9), 1), (simple(10), 2), (simple(30), 4), (simple(5, 500), 51)],
)
def test_a_filter_that_takes_its_time_counts_as_several(filter_: EventFilter, weight: int) -> None:
    one = listening(HERE, 1, simple())
    (item,) = one.items.values()
    assert isinstance(item, EventItem)
    item.modify(item.settings, filter_)
    assert room_for_items(HERE, [one]) == Share(499, 60 - weight)
