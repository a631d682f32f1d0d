"""Share of one address in the monitored items; no server."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest
from asyncua import ua

from bridge.uaserver import quotas
from bridge.uaserver.eventfilter import EventFilter
from bridge.uaserver.items import EventItem, ItemSettings
from bridge.uaserver.library import ServiceError
from bridge.uaserver.quotas import EventItemQuota, room_for_items
from bridge.uaserver.subscription import Subscription, terms
from bridge.uaserver.where import Where

HERE, NEIGHBOUR, ELSEWHERE = "2001:db8::1", "2001:db8::2", "10.0.0.1"


def subscription(address: str, items: int) -> Subscription:
    owner: Any = SimpleNamespace(address=address)
    made = Subscription(1, owner, terms(ua.CreateSubscriptionParameters()), enabled=True)
    for number in range(items):
        settings = ItemSettings(number, 0, 5, True)
        made.add(EventItem(number, ua.NodeId("conveyor", 2), settings, simple(), ua.MonitoringMode.Reporting))
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
        monkeypatch.setattr(quotas, name, limit)


def test_one_address_takes_no_more_than_its_share_of_items() -> None:
    there = [subscription(HERE, 300), subscription(NEIGHBOUR, 160)]
    assert room_for_items(HERE, there) == 40, "one network of 64 bits is one address"
    assert room_for_items(ELSEWHERE, there) == 500
    there.append(subscription(ELSEWHERE, 400))
    assert room_for_items("10.0.0.2", there) == 140


def test_one_address_takes_no_more_than_its_share_of_items_for_events() -> None:
    all_ = EventItemQuota()
    for _ in range(6):
        all_.change(HERE, 10)
    with pytest.raises(ServiceError) as refused:
        all_.change(HERE, 1)
    assert refused.value.code == ua.StatusCodes.BadTooManyMonitoredItems
    all_.change(ELSEWHERE, 40)
    with pytest.raises(ServiceError):
        all_.change("10.0.0.2", 1)
    all_.change(HERE, 0)
    all_.change(HERE, -10)
    all_.change("10.0.0.2", 51)
    with pytest.raises(ServiceError):
        all_.change(HERE, 1)


@pytest.mark.parametrize(
    ("filter_", "weight"),
    [(simple(1), 1), (simple(9), 1), (simple(10), 2), (simple(30), 4), (simple(5, 500), 51)],
)
def test_a_filter_that_takes_its_time_counts_as_several(filter_: EventFilter, weight: int) -> None:
    assert filter_.weight == weight
