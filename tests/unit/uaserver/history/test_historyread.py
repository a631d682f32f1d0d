"""HistoryRead with its continuation points, turns and faults; no socket."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from datetime import UTC, datetime
from typing import Any

import pytest
from asyncua import ua
from asyncua.common.utils import Buffer
from asyncua.ua.ua_binary import struct_from_binary
from hypothesis import given, settings
from hypothesis import strategies as st

from bridge.uaserver.encoding import Results, encode
from bridge.uaserver.hierarchy import EventTypes
from bridge.uaserver.history import historyread
from bridge.uaserver.history.history import EventHistory, ValueHistory, date_time
from bridge.uaserver.history.historyread import MOST_CONTINUATION_POINTS, MOST_VALUES, HistoryReader
from bridge.uaserver.library import ServiceError
from tests.support.opcua_filters import MESSAGE, SEVERITY, asked, element
from tests.support.opcua_history import Happened, Samples, sample, told

Codes, Times = ua.StatusCodes, ua.TimestampsToReturn
LOAD, PLAIN, SERVER, NOWHERE = (ua.NodeId(name, 1) for name in ("load", "plain", "server", "nowhere"))
NONE = datetime(1601, 1, 1, tzinfo=UTC)


class Store:
    """Values of one variable and events of one object."""

    def __init__(self, samples: Samples | None = None, happened: Happened | None = None) -> None:
        self.samples = samples or Samples([sample(at, at) for at in range(20)])
        self.happened = happened or told(range(20))

    def value_history(self, where: ua.NodeId) -> ValueHistory | None:
        return self.samples if where == LOAD else None

    def event_history(self, where: ua.NodeId) -> EventHistory | None:
        return self.happened if where == SERVER else None


class Rig:
    def __init__(self, types: EventTypes, store: Store | None = None) -> None:
        space: Any = {LOAD, PLAIN, SERVER}
        self.reader = HistoryReader(space, types)
        self.store = store or Store()
        self.most_bytes = 1_000_000

    async def results(self, details: object, *nodes: ua.HistoryReadValueId, **params: object) -> list[Any]:
        """Results as a client decodes them."""
        wanted = ua.HistoryReadParameters(
            HistoryReadDetails=details, ReleaseContinuationPoints=False, NodesToRead=list(nodes)
        )
        for name, value in params.items():
            setattr(wanted, name, value)
        results = Results(self.most_bytes)
        await self.reader.read(wanted, self.store, results)
        body = encode(ua.HistoryReadResponse(Results=results))
        return struct_from_binary(ua.HistoryReadResponse, Buffer(body)).Results

    async def one(self, details: object, where: ua.NodeId = LOAD, **node: object) -> Any:
        (result,) = await self.results(details, ua.HistoryReadValueId(NodeId=where, **node))
        return result


@pytest.fixture
def rig(types: EventTypes) -> Rig:
    return Rig(types)


def raw(start: int | None = 0, end: int | None = 20, most: int = 0, **more: object) -> Any:
    times = {"StartTime": NONE if start is None else date_time(start)}
    times["EndTime"] = NONE if end is None else date_time(end)
    details = {"IsReadModified": False, "NumValuesPerNode": most, "ReturnBounds": False}
    return ua.ReadRawModifiedDetails(**times, **(details | more))


def events(
    start: int | None = 0, end: int | None = 20, most: int = 0, where: Sequence[Any] = ()
) -> ua.ReadEventDetails:
    return ua.ReadEventDetails(
        NumValuesPerNode=most,
        StartTime=NONE if start is None else date_time(start),
        EndTime=NONE if end is None else date_time(end),
        Filter=asked(*where, select=[MESSAGE, SEVERITY]),
    )


def values(result: Any) -> list[Any]:
    return [one.Value.Value for one in result.HistoryData.DataValues]


def messages(result: Any) -> list[int]:
    return [int(one.EventFields[0].Value.Text) for one in result.HistoryData.Events]


async def all_of(rig: Rig, details: object, where: ua.NodeId, read: Any) -> list[list[Any]]:
    """What each answer has, until there is no continuation point."""
    result = await rig.one(details, where)
    found = [read(result)]
    while result.ContinuationPoint:
        result = await rig.one(details, where, ContinuationPoint=result.ContinuationPoint)
        found.append(read(result))
    return found


@settings(max_examples=25)
@given(span=st.tuples(st.integers(-2, 22), st.integers(-2, 22)), most=st.integers(0, 8))
def test_pieces_are_as_long_as_is_asked_for_and_make_the_whole(
    types: EventTypes, span: tuple[int, int], most: int
) -> None:
    rig = Rig(types)
    start, end = span
    expected = list(range(20))
    if start == end:
        expected = [at for at in expected if at == start]
    elif start < end:
        expected = [at for at in expected if start <= at < end]
    else:
        expected = [at for at in reversed(expected) if end < at <= start]
    for details, where, read in ((raw(*span, most), LOAD, values), (events(*span, most), SERVER, messages)):
        pieces = asyncio.run(all_of(rig, details, where, read))
        assert [one for piece in pieces for one in piece] == expected
        assert all(len(piece) == most for piece in pieces[:-1])
        assert len(pieces) == 1 or pieces[-1], "no continuation point leads to nothing"


async def test_of_the_newest_or_the_oldest_so_many_are_read(rig: Rig) -> None:
    assert values(await rig.one(raw(None, 30, 3))) == [19, 18, 17]
    assert values(await rig.one(raw(5, None, 3))) == [5, 6, 7]
    assert messages(await rig.one(events(None, 30, 3), SERVER)) == [19, 18, 17]
    assert messages(await rig.one(events(5, None, 3), SERVER)) == [5, 6, 7]


@pytest.mark.parametrize("span", [(5, None), (None, 30)])
@pytest.mark.parametrize("bounds", [False, True])
@pytest.mark.parametrize("most", [1, 3, 25])
async def test_from_one_time_on_the_number_is_all_that_is_asked_for(
    rig: Rig, span: tuple[int | None, int | None], bounds: bool, most: int
) -> None:
    """Part 11 §6.5.3.2 and §6.5.2.2: a continuation point is for a range with two ends."""
    found = await rig.one(raw(*span, most, ReturnBounds=bounds))
    assert found.ContinuationPoint is None
    assert len(values(found)) <= most
    found = await rig.one(events(*span, most), SERVER)
    assert found.ContinuationPoint is None
    assert len(messages(found)) <= most


async def test_that_number_goes_on_where_an_answer_cannot_have_it(rig: Rig) -> None:
    rig.store.samples = Samples([sample(at, "x" * 100) for at in range(300)])
    rig.store.happened = told(range(300))
    rig.most_bytes = 2_000
    for details, where, read in (
        (raw(0, None, 100), LOAD, values),
        (events(0, None, 100), SERVER, messages),
        (events(None, 300, 100), SERVER, messages),
    ):
        pieces = await all_of(rig, details, where, read)
        assert len(pieces) > 1
        assert sum(len(piece) for piece in pieces) == 100


async def test_nothing_in_that_time_is_good_and_said(rig: Rig) -> None:
    for details, where in ((raw(30, 40), LOAD), (events(30, 40), SERVER)):
        result = await rig.one(details, where)
        assert result.StatusCode.value == Codes.GoodNoData
        assert result.ContinuationPoint is None
    assert values(await rig.one(raw(30, 40))) == []


async def test_each_node_has_its_own_result(rig: Rig) -> None:
    nodes = [ua.HistoryReadValueId(NodeId=where) for where in (LOAD, PLAIN, NOWHERE, SERVER)]
    found = await rig.results(raw(), *nodes)
    refused = Codes.BadHistoryOperationUnsupported
    assert [one.StatusCode.value for one in found] == [Codes.Good, refused, Codes.BadNodeIdUnknown, refused]
    found = await rig.results(events(), *nodes)
    assert [one.StatusCode.value for one in found] == [refused, refused, Codes.BadNodeIdUnknown, Codes.Good]


@pytest.mark.parametrize(
    "details",
    [
        ua.ReadRawModifiedDetails(IsReadModified=True),
        ua.ReadProcessedDetails(),
        ua.ReadAnnotationDataDetails(),
        ua.ExtensionObject(),
    ],
    ids=lambda details: type(details).__name__,
)
async def test_all_else_is_not_supported(rig: Rig, details: object) -> None:
    for where in (LOAD, SERVER):
        result = await rig.one(details, where)
        assert result.StatusCode.value == Codes.BadHistoryOperationUnsupported


async def test_a_range_that_is_none_and_a_filter_that_is_none(rig: Rig) -> None:
    result = await rig.one(raw(), IndexRange="all")
    assert result.StatusCode.value == Codes.BadIndexRangeInvalid
    result = await rig.one(events(None, None, 0), SERVER)
    assert result.StatusCode.value == Codes.BadHistoryOperationInvalid
    result = await rig.one(ua.ReadEventDetails(), SERVER)
    assert result.StatusCode.value == Codes.BadEventFilterInvalid


async def test_only_source_times_are_kept(rig: Rig) -> None:
    wanted = ua.HistoryReadValueId(NodeId=LOAD)
    (found,) = await rig.results(raw(), wanted, TimestampsToReturn=Times.Both)
    assert found.HistoryData.DataValues[3].SourceTimestamp == date_time(3)
    assert found.HistoryData.DataValues[3].ServerTimestamp is None
    (found,) = await rig.results(raw(), wanted, TimestampsToReturn=Times.Server)
    assert found.StatusCode.value == Codes.BadTimestampNotSupported
    for wrong in (Times.Neither, Times.Invalid):
        with pytest.raises(ServiceError) as error:
            await rig.results(raw(), wanted, TimestampsToReturn=wrong)
        assert error.value.code == Codes.BadTimestampsToReturnInvalid


async def test_a_continuation_point_is_good_once_and_for_its_node(rig: Rig) -> None:
    first = (await rig.one(raw(most=3))).ContinuationPoint
    invalid = Codes.BadContinuationPointInvalid
    assert values(await rig.one(raw(most=3), ContinuationPoint=first)) == [3, 4, 5]
    again = await rig.one(raw(most=3), ContinuationPoint=first)
    assert again.StatusCode.value == invalid
    second = (await rig.one(raw(most=3))).ContinuationPoint
    elsewhere = await rig.one(raw(most=3), PLAIN, ContinuationPoint=second)
    assert elsewhere.StatusCode.value == invalid


async def test_a_continuation_point_that_is_released_is_gone(rig: Rig) -> None:
    point = (await rig.one(raw(most=3))).ContinuationPoint
    wanted = ua.HistoryReadValueId(NodeId=LOAD, ContinuationPoint=point)
    (released,) = await rig.results(raw(), wanted, ReleaseContinuationPoints=True)
    assert released.StatusCode.is_good()
    gone = await rig.one(raw(most=3), ContinuationPoint=point)
    assert gone.StatusCode.value == Codes.BadContinuationPointInvalid


async def test_continuation_points_are_bounded(rig: Rig) -> None:
    codes = [(await rig.one(raw(most=1))).StatusCode.value for _ in range(MOST_CONTINUATION_POINTS + 1)]
    assert codes == [Codes.Good] * MOST_CONTINUATION_POINTS + [Codes.BadNoContinuationPoints]


async def test_what_has_been_forgotten_meanwhile_is_an_invalid_point(rig: Rig) -> None:
    point = (await rig.one(raw(most=3))).ContinuationPoint
    rig.store.samples.forget(5)
    gone = await rig.one(raw(most=3), ContinuationPoint=point)
    assert gone.StatusCode.value == Codes.BadContinuationPointInvalid


async def test_only_events_that_pass_the_filter_of_this_object_are_read(types: EventTypes) -> None:
    happened = told(range(6))
    happened.held[2] = (2, None)
    happened.held += told([6], severity=900).held
    rig = Rig(types, Store(happened=happened))
    assert messages(await rig.one(events(), SERVER)) == [0, 1, 3, 4, 5, 6]
    severe = element(ua.FilterOperator.GreaterThan, SEVERITY, ua.LiteralOperand(ua.Variant(600)))
    assert messages(await rig.one(events(where=[severe]), SERVER)) == [6]


async def test_events_whose_clock_was_set_are_found_by_their_times(types: EventTypes) -> None:
    rig = Rig(types, Store(happened=told([100, 101, 5, 6, 102])))
    assert messages(await rig.one(events(0, 50), SERVER)) == [5, 6]
    assert messages(await rig.one(events(100, 200), SERVER)) == [100, 101, 102]


# how much at once


async def test_an_answer_has_no_more_than_the_client_takes(rig: Rig) -> None:
    rig.store.samples = Samples([sample(at, "x" * 100) for at in range(1000)])
    rig.most_bytes = 20_000
    pieces = await all_of(rig, raw(0, 1000), LOAD, values)
    assert sum(len(piece) for piece in pieces) == 1000
    assert len(pieces) > 10


async def test_all_nodes_share_what_an_answer_has(rig: Rig) -> None:
    rig.store.samples = Samples([sample(at, at) for at in range(MOST_VALUES)])
    nodes = [ua.HistoryReadValueId(NodeId=LOAD)] * 10
    found = await rig.results(raw(0, MOST_VALUES), *nodes)
    assert [len(values(one)) for one in found] == [MOST_VALUES // 10] * 10
    assert all(one.ContinuationPoint for one in found)


async def test_others_have_their_turn_meanwhile(types: EventTypes, monkeypatch: pytest.MonkeyPatch) -> None:
    """No more than one chunk after the time for a turn is over, by a clock that runs with the values."""
    now = 0.0

    def clock() -> float:
        nonlocal now
        now += 0.001
        return now

    monkeypatch.setattr(historyread, "loop_time", clock)
    store = Store(Samples([sample(at, at) for at in range(3000)]), told(range(600)))
    rig = Rig(types, store)
    turns = 0

    async def others() -> None:
        nonlocal turns
        while True:
            turns += 1
            await asyncio.sleep(0)

    task = asyncio.create_task(others())
    await rig.one(raw(0, 3000))
    assert turns >= 50
    turns = 0
    await rig.one(events(0, 600), SERVER)
    assert turns >= 100
    turns = 0
    await rig.results(raw(0, 10), *[ua.HistoryReadValueId(NodeId=LOAD)] * 100)
    assert turns >= 30, "of many nodes with few values, too"
    task.cancel()


# at times


async def test_values_at_times(rig: Rig) -> None:
    rig.store.samples = Samples([sample(10, 1.0), sample(20, 2.0)])
    times = [date_time(at) for at in (20, 15, 5)]
    found = await rig.one(ua.ReadAtTimeDetails(ReqTimes=times))
    assert values(found) == [2.0, 1.0, None]
    codes = [one.StatusCode.value for one in found.HistoryData.DataValues]
    assert codes == [Codes.Good, 0x0402, Codes.BadNoData]
    none = await rig.one(ua.ReadAtTimeDetails(ReqTimes=[]))
    assert none.StatusCode.value == Codes.BadHistoryOperationInvalid
    never = await rig.one(ua.ReadAtTimeDetails(ReqTimes=[NONE]))
    assert never.StatusCode.value == Codes.BadInvalidTimestamp
    nobody = await rig.one(ua.ReadAtTimeDetails(ReqTimes=times), PLAIN)
    assert nobody.StatusCode.value == Codes.BadHistoryOperationUnsupported


async def test_times_of_all_nodes_together_are_bounded(rig: Rig) -> None:
    times = [date_time(1)] * (MOST_VALUES // 2)
    nodes = [ua.HistoryReadValueId(NodeId=LOAD)]
    assert len(await rig.results(ua.ReadAtTimeDetails(ReqTimes=times), *nodes * 2)) == 2
    with pytest.raises(ServiceError) as error:
        await rig.results(ua.ReadAtTimeDetails(ReqTimes=times), *nodes * 3)
    assert error.value.code == Codes.BadTooManyOperations
