"""Conditions of a server: what is told of them, what their methods answer; no server, no clock."""

from __future__ import annotations

import asyncio

import pytest
from asyncua import ua
from hypothesis import given, settings
from hypothesis import strategies as st

from bridge.uaserver.conditions import conditions as module
from bridge.uaserver.conditions.condition import ConditionState
from bridge.uaserver.conditions.condition_fields import AlarmContent
from bridge.uaserver.library import text
from tests.support.conditions import (
    ACKNOWLEDGE,
    CONFIRM,
    DISABLE,
    REFRESH,
    SERVER,
    ConditionBench,
    Ids,
    about,
)

Codes = ua.StatusCodes
START, END = ua.NodeId(Ids.RefreshStartEventType), ua.NodeId(Ids.RefreshEndEventType)


async def test_an_alarm_is_told_at_the_server_and_at_its_source() -> None:
    bench = ConditionBench()
    one, other = bench.add("one"), bench.add("other")
    at_source = bench.listen(ua.NodeId("one", 2), 2)
    bench.raise_(one)
    bench.raise_(other)
    at_server = await bench.told()
    assert [event[""].Identifier for event in at_server] == ["one/Alarm", "other/Alarm"]
    assert [event[""].Identifier for event in await bench.told(at_source)] == ["one/Alarm"]
    assert at_server[0]["Message"].Text == "hot"
    assert (at_server[0]["ActiveState/Id"], at_server[0]["AckedState/Id"]) == (True, False)


async def test_what_says_the_same_is_not_told_again() -> None:
    bench = ConditionBench()
    one = bench.add()
    bench.raise_(one)
    assert len(await bench.told()) == 1
    same = AlarmContent(text("hot"), 700)
    bench.conditions.raised(one, same, anew=False)
    assert await bench.told() == []
    bench.conditions.raised(one, AlarmContent(text("hotter"), 700), anew=False)
    (told,) = await bench.told()
    assert told["Message"].Text == "hotter"


async def test_an_acknowledgement_is_told_and_counts_once() -> None:
    bench = ConditionBench()
    one = bench.add()
    bench.raise_(one)
    (raised,) = await bench.told()
    assert await bench.call(one.place.node, ACKNOWLEDGE, *about(raised["EventId"])) == Codes.Good
    (acked,) = await bench.told()
    assert (acked["AckedState/Id"], acked["EventId"] != raised["EventId"]) == (True, True)
    again = await bench.call(one.place.node, ACKNOWLEDGE, *about(raised["EventId"]))
    assert again == Codes.BadConditionBranchAlreadyAcked
    assert bench.owner.calls == [
        ("anna", "Acknowledge", Codes.Good),
        ("anna", "Acknowledge", Codes.BadConditionBranchAlreadyAcked),
    ]


async def test_what_the_application_refuses_is_not_acknowledged() -> None:
    bench = ConditionBench()
    one = bench.add()
    bench.raise_(one)
    bench.owner.answer = Codes.BadDeviceFailure
    given_ = about(one.event_id)
    assert await bench.call(one.place.node, ACKNOWLEDGE, *given_) == Codes.BadDeviceFailure
    assert not one.state.acked


async def test_an_alarm_that_comes_again_meanwhile_is_not_acknowledged() -> None:
    """While the application resets the fault."""
    bench = ConditionBench()
    one = bench.add()
    bench.raise_(one)
    began, event_id = asyncio.Event(), one.event_id

    async def acknowledging(*_: object) -> int:
        began.set()
        await asyncio.sleep(0)
        bench.raise_(one, "another")
        return Codes.Good

    bench.owner.acknowledging = acknowledging
    code = await bench.call(one.place.node, ACKNOWLEDGE, *about(event_id))
    assert (code, one.state.acked) == (Codes.BadEventIdUnknown, False)


async def test_a_method_needs_a_condition_and_a_right() -> None:
    bench = ConditionBench()
    one = bench.add()
    nowhere = ua.NodeId("nowhere", 2)
    assert await bench.call(nowhere, DISABLE) == Codes.BadNodeIdUnknown
    bench.owner.forbidden.add("Disable")
    assert await bench.call(one.place.node, DISABLE) == Codes.BadUserAccessDenied
    assert one.state.enabled


async def test_shelving_ends_with_its_time() -> None:
    bench = ConditionBench()
    one = bench.add()
    bench.raise_(one)
    shelve = ua.NodeId(Ids.AlarmConditionType_ShelvingState_TimedShelve)
    below = ua.NodeId("shelving of c", 2)
    bench.conditions.condition_of = {below: one.place.node}.__getitem__
    assert await bench.call(below, shelve, ua.Variant(5000.0)) == Codes.Good
    bench.now_ms += 4000
    left = bench.conditions.fields(one)["ShelvingState/UnshelveTime"].Value
    bench.conditions.look()
    assert (left, one.state.shelved) == (1000.0, True)
    bench.now_ms += 1000
    bench.conditions.look()
    assert not one.state.shelved


async def test_more_events_than_can_wait_ask_for_a_refresh(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_MOST_WAITING", 5)
    bench = ConditionBench()
    one = bench.add()
    for _ in range(8):
        bench.raise_(one)
    first, *others = await bench.told()
    assert first["EventType"] == ua.NodeId(Ids.RefreshRequiredEventType)
    assert len(others) == 3


class TestRefresh:
    async def test_it_tells_the_item_alone_that_is_asked_for(self) -> None:
        bench = ConditionBench()
        second = bench.listen(SERVER, 2)
        bench.raise_(bench.add())
        await bench.told()
        second.queue.clear()
        assert await bench.refresh(item=2) == Codes.Good
        assert [event["EventType"] for event in await bench.told(second)][::2] == [START, END]
        assert await bench.told() == []

    async def test_it_goes_on_when_the_client_has_fetched_what_filled_its_queue(self) -> None:
        bench = ConditionBench(queue=3)
        for number in range(5):
            bench.raise_(bench.add(f"c{number}"))
        await bench.told()
        got: list[ua.NodeId] = []

        async def fetch() -> None:
            while END not in got:
                await asyncio.sleep(0)
                got.extend(event["EventType"] for event in await bench.told())

        fetching = asyncio.create_task(fetch())
        assert await bench.refresh() == Codes.Good
        await fetching
        assert (len(got), got[0]) == (7, START)

    async def test_a_second_one_at_once_is_refused(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(module, "_LONGEST_REFRESH_S", 0.1)
        bench = ConditionBench(queue=1)
        bench.raise_(bench.add())
        refreshing = asyncio.create_task(bench.refresh())
        await asyncio.sleep(0)
        assert await bench.refresh() == Codes.BadRefreshInProgress
        bench.item.queue.clear()
        assert await refreshing == Codes.Good

    async def test_it_is_a_method_of_the_type(self) -> None:
        bench = ConditionBench()
        number = ua.Variant(7, ua.VariantType.UInt32)
        assert await bench.call(bench.add().place.node, REFRESH, number) == Codes.BadMethodInvalid


STATES = st.builds(
    ConditionState,
    enabled=st.booleans(),
    active=st.booleans(),
    acked=st.booleans(),
    confirmed=st.booleans(),
)


@given(st.lists(STATES, max_size=8))
@settings(deadline=None)
def test_a_refresh_tells_exactly_the_retained(states: list[ConditionState]) -> None:
    async def refreshed() -> list[str]:
        bench = ConditionBench()
        for number, state in enumerate(states):
            bench.add(str(number)).state = state
        assert await bench.refresh() == Codes.Good
        first, *told, last = await bench.told()
        assert (first["EventType"], last["EventType"]) == (START, END)
        return [event[""].Identifier.partition("/")[0] for event in told]

    retained = [number for number, state in enumerate(states) if state.retain]
    assert asyncio.run(refreshed()) == [str(number) for number in retained]


async def test_watchers_of_a_field_are_told_of_its_changes() -> None:
    bench = ConditionBench()
    one = bench.add()
    told: list[object] = []

    class Watching:
        def told(self, value: ua.DataValue, now: float) -> None:
            told.append(value.Value.Value if value.Value else None)

        async def __call__(self, handle: int, value: ua.DataValue) -> None:
            self.told(value, 0.0)

    bench.conditions.watched[one.place.node] = {"AckedState/Id": {1: Watching()}}
    bench.raise_(one)
    await bench.told()
    await bench.call(one.place.node, ACKNOWLEDGE, *about(one.event_id))
    await bench.call(one.place.node, CONFIRM, *about(one.event_id))
    await bench.told()
    assert told == [False, True]
