"""Share of one address in the monitored items; no server."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest
from asyncua import ua

from bridge.uaserver.filters.eventfilter import EventFilter
from bridge.uaserver.filters.where import Where
from bridge.uaserver.library import ServiceError
from bridge.uaserver.subscriptions import quotas
from bridge.uaserver.subscriptions.items import EventItem, ItemSettings
from bridge.uaserver.subscriptions.quotas import (
    EventItemQuota,
    make_room,
    make_room_for_session,
    room_for_items,
)
from bridge.uaserver.subscriptions.subscription import Subscription, terms

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
        "MOST_SESSIONS": 6,
        "MOST_SESSIONS_OF_ADDRESS": 4,
        "MOST_SUBSCRIPTIONS": 6,
        "MOST_OF_ADDRESS": 4,
        "MOST_OF_SESSION": 3,
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


class Sessions:
    """Sessions of a server, and who was ended for others."""

    def __init__(self) -> None:
        self.all: list[Any] = []
        self.ended: list[str] = []
        self.subscriptions: dict[int, Any] = {}

    def add(self, name: str, rank: int, address: str = HERE, *, left_at: float | None = None) -> Any:
        async def end(**_: object) -> None:
            self.ended.append(name)
            self.all.remove(made)
            for number in [number for number, one in self.subscriptions.items() if one.owner is made]:
                del self.subscriptions[number]

        identity = SimpleNamespace(name=name, rank=rank, is_anonymous=False)
        made: Any = SimpleNamespace(
            session_id=name,
            address=address,
            identity=identity,
            holder=None if left_at is not None else object(),
            left_at=left_at or 0.0,
            is_gone=False,
            abort=end,
            evict=end,
        )
        self.all.append(made)
        return made

    def subscribe(self, session: Any, count: int = 1) -> None:
        for _ in range(count):
            number = max(self.subscriptions, default=0) + 1
            self.subscriptions[number] = SimpleNamespace(owner=session, session_id=session.session_id)


class TestRolesAndSessions:
    async def room(self, sessions: Sessions, top_rank: int = 2) -> None:
        await make_room_for_session(ELSEWHERE, sessions.all, top_rank)

    async def test_where_there_is_room_nobody_ends(self) -> None:
        sessions = Sessions()
        sessions.add("anna", 0, left_at=1.0)
        await self.room(sessions)
        assert sessions.ended == []

    async def test_the_lowest_role_yields_and_of_it_first_what_was_left_behind(self) -> None:
        sessions = Sessions()
        for name, rank in (("eva", 2), ("anna", 1), ("otto", 0)):
            sessions.add(f"left {name}", rank, left_at=1.0)
            sessions.add(name, rank, address=f"10.0.0.{rank + 10}")
        for expected in ("left otto", "otto", "left anna", "anna", "left eva"):
            sessions.add("operator", 2, address="10.0.0.99")
            await self.room(sessions)
            assert sessions.ended[-1] == expected
        with pytest.raises(ServiceError) as refused:
            sessions.add("engineer", 2, address="10.0.0.98")
            await self.room(sessions)
        assert refused.value.code == ua.StatusCodes.BadTooManySessions

    async def test_of_an_address_only_its_own_yield(self) -> None:
        sessions = Sessions()
        sessions.add("observer elsewhere", 0, address="10.0.0.9")
        for number in range(4):
            sessions.add(f"operator {number}", 1)
        await make_room_for_session(HERE, sessions.all, 2)
        assert sessions.ended == ["operator 3"]


class TestRolesAndSubscriptions:
    async def test_a_higher_role_takes_the_place_of_a_lower_one_and_never_the_other_way(self) -> None:
        sessions = Sessions()
        otto, anna = sessions.add("otto", 0, "10.0.0.2"), sessions.add("anna", 1, "10.0.0.3")
        eva = sessions.add("eva", 2, "10.0.0.4")
        for one in (otto, anna):
            sessions.subscribe(one, 3)
        with pytest.raises(ServiceError):
            await make_room(sessions.add("olga", 0, "10.0.0.5"), sessions.all, sessions.subscriptions)
        await make_room(eva, sessions.all, sessions.subscriptions)
        assert sessions.ended == ["otto"]
        sessions.subscribe(eva, 3)
        bert = sessions.add("bert", 1, "10.0.0.6")
        with pytest.raises(ServiceError):
            await make_room(bert, sessions.all, sessions.subscriptions)
        assert sessions.ended == ["otto"]

    async def test_what_a_higher_role_has_left_behind_is_not_for_a_lower_one(self) -> None:
        sessions = Sessions()
        sessions.subscribe(sessions.add("anna", 1, left_at=1.0), 3)
        sessions.subscribe(sessions.add("eva", 2, left_at=2.0), 1)
        otto, bert = sessions.add("otto", 0), sessions.add("bert", 1)
        with pytest.raises(ServiceError):
            await make_room(otto, sessions.all, sessions.subscriptions)
        await make_room(bert, sessions.all, sessions.subscriptions)
        assert sessions.ended == ["anna"]

    async def test_of_one_role_the_user_with_the_most_yields(self) -> None:
        sessions = Sessions()
        few, many = sessions.add("few", 0, "10.0.0.2"), sessions.add("many", 0, "10.0.0.3")
        sessions.subscribe(many, 3)
        sessions.subscribe(sessions.add("many", 0, "10.0.0.7"), 1)
        sessions.subscribe(few, 2)
        await make_room(sessions.add("anna", 1, "10.0.0.5"), sessions.all, sessions.subscriptions)
        assert sessions.ended == ["many"]
