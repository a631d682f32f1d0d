"""Monitored items: what is sampled and reported, and what becomes of a full queue; no server, no clock."""

from __future__ import annotations

import math
from collections import deque

import pytest
from asyncua import ua
from hypothesis import given
from hypothesis import strategies as st

from bridge.uaserver.filters.changefilter import ChangeFilter
from bridge.uaserver.filters.eventfilter import EventFilter, Occurrence
from bridge.uaserver.filters.where import Where
from bridge.uaserver.reading import window_of
from bridge.uaserver.subscriptions.items import (
    EventItem,
    ItemSettings,
    ValueItem,
    event_settings,
    value_settings,
)

Codes, Kind, Mode = ua.StatusCodes, ua.VariantType, ua.MonitoringMode
OVERFLOW = 0x480
VALUE = ua.AttributeIds.Value
PASSES_ALL = EventFilter(["Message", "EventType"], Where([]), None)
NODE = ua.NodeId("conveyor", 2)


def value(number: float | None, status: int = Codes.Good) -> ua.DataValue:
    held = ua.Variant(None, Kind.Null) if number is None else ua.Variant(number, Kind.Double)
    return ua.DataValue(held, ua.StatusCode(status))


# which changes are reported


def reported(last: ua.DataValue | None, now: ua.DataValue, deadband: float | None = None) -> bool:
    return ChangeFilter(deadband=deadband).reports(last, now)


def test_the_first_value_and_every_status_is_reported() -> None:
    dead = value(None, Codes.BadNoCommunication)
    assert reported(None, value(1.0), 5)
    assert reported(value(1.0), dead, 5)
    assert reported(dead, value(1.0), 5)
    assert reported(dead, value(None, Codes.BadDeviceFailure), 5)


def test_a_change_is_reported_beyond_the_deadband_only() -> None:
    assert not reported(value(1.0), value(1.0))
    assert reported(value(1.0), value(1.1))
    assert not reported(value(1.0), value(1.5), 0.5)
    assert reported(value(1.0), value(1.6), 0.5)
    assert reported(value(1.0), value(math.nan), 0.5)
    assert not reported(value(math.nan), value(math.nan), 0.5)


def test_one_element_beyond_the_deadband_is_enough() -> None:
    """Part 8 §7.2."""

    def values(*numbers: float) -> ua.DataValue:
        return ua.DataValue(ua.Variant(list(numbers), Kind.Double))

    assert not reported(values(1.0, 2.0), values(1.5, 1.5), 0.5)
    assert reported(values(1.0, 2.0), values(1.0, 2.6), 0.5)
    assert reported(values(1.0, 2.0), values(1.0), 0.5)
    assert reported(values(1.0), values(math.nan), 0.5)
    assert not reported(values(math.nan, 1.0), values(math.nan, 1.2), 0.5)


def test_who_asks_for_the_status_alone_gets_no_values() -> None:
    wanted = ChangeFilter(ua.DataChangeTrigger.Status)
    assert not wanted.reports(value(1.0), value(2.0))
    assert wanted.reports(value(1.0), value(1.0, Codes.UncertainLastUsableValue))


# queues


def make_item(
    size: int = 1, discard_oldest: bool = True, sampling_ms: float = 50, mode: Mode = Mode.Reporting
) -> ValueItem:
    settings = ItemSettings(77, sampling_ms, size, discard_oldest)
    looked_at = window_of((), VALUE, ua.TimestampsToReturn.Both)
    return ValueItem(1, NODE, VALUE, looked_at, settings, ChangeFilter(), mode)


def told(item: ValueItem) -> list[tuple[float, bool]]:
    """Values in the queue, each with whether it reports that others were lost."""
    found: list[tuple[float, bool]] = []
    while item.has_something:
        one = item.take()
        found.append((one.Value.Value, bool(one.StatusCode.value & OVERFLOW)))
    return found


@given(st.integers(1, 6), st.integers(0, 20), st.booleans())
def test_a_full_queue_loses_what_the_client_chose_and_says_so(size: int, changes: int, oldest: bool) -> None:
    item = make_item(size, oldest)
    for number in range(changes):
        item.change(value(float(number)), float(number))
    numbers = [float(number) for number in range(changes)]
    if changes <= size:
        assert told(item) == [(number, False) for number in numbers]
    elif size == 1:
        # A buffer of the newest value; nothing is marked.
        assert told(item) == [(numbers[-1], False)]
    elif oldest:
        kept = numbers[-size:]
        assert told(item) == [(kept[0], True)] + [(number, False) for number in kept[1:]]
    else:
        kept = [*numbers[: size - 1], numbers[-1]]
        assert told(item) == [(number, False) for number in kept[:-1]] + [(kept[-1], True)]


def test_a_value_that_others_have_too_is_not_marked() -> None:
    item, shared = make_item(2), [value(float(number)) for number in range(3)]
    for number, one in enumerate(shared):
        item.change(one, float(number))
    assert all(one.StatusCode.value == Codes.Good for one in shared)
    # What comes back to the last value is a change, although the queue has a mark on it.
    item.change(value(2.0), 9.0)
    assert [number for number, _ in told(item)] == [1.0, 2.0]


@pytest.mark.parametrize("oldest", [True, False])
def test_a_shorter_queue_keeps_what_the_client_chose(oldest: bool) -> None:
    item = make_item(5, oldest)
    for number in range(5):
        item.change(value(float(number)), float(number))
    item.modify(ItemSettings(77, 50, 2, oldest), ChangeFilter(), item.window)
    assert told(item) == ([(3.0, True), (4.0, False)] if oldest else [(0.0, False), (1.0, True)])


# sampling


def test_between_two_samples_the_newest_value_waits() -> None:
    item = make_item(size=10, sampling_ms=1000)
    for tenth in range(26):
        item.change(value(float(tenth)), tenth / 10)
    item.sample(2.95)
    assert item.is_holding
    item.sample(3.0)
    assert [number for number, _ in told(item)] == [0.0, 10.0, 20.0, 25.0]
    assert not item.is_holding


@given(
    st.lists(st.integers(1, 60), min_size=1, max_size=15),
    st.sampled_from((50, 100, 250, 500, 1000)),
    st.integers(1, 250),
)
def test_what_stands_for_a_sampling_interval_is_told(gaps: list[int], sampling_ms: int, every: int) -> None:
    """However seldom anybody looks: ``gaps`` and ``every`` publishing cycle are in ticks of 50 ms."""
    item, changes = make_item(size=100, sampling_ms=sampling_ms), {0: 0.0}
    for number, gap in enumerate(gaps, 1):
        changes[max(changes) + gap] = float(number)
    last = max(changes) + every + sampling_ms // 50
    for tick in range(last + 1):
        if tick in changes:
            item.change(value(changes[tick]), tick / 20)
        if tick % every == 0:
            item.sample(tick / 20)
    item.sample((last + every) / 20)
    came = [number for number, _ in told(item)]
    assert came == sorted(set(came)), "in their order, and each once"
    ends = [*list(changes)[1:], last + every]
    stood = [
        number
        for (begin, number), end in zip(changes.items(), ends, strict=True)
        if (end - begin) * 50 > sampling_ms
    ]
    assert set(stood) <= set(came)
    assert len(came) <= 1 + (last + every) * 50 / (sampling_ms - 25)


def test_a_change_after_a_quiet_time_is_told_at_once() -> None:
    item = make_item(sampling_ms=1000)
    item.change(value(1.0), 0.0)
    told(item)
    item.change(value(2.0), 7.3)
    assert told(item) == [(2.0, False)]


@pytest.mark.parametrize(
    ("asked", "used"),
    [
        (-1, 500.0),
        (-7.5, 500.0),
        (0, 50.0),
        (1, 50.0),
        (200, 200.0),
        (math.nan, 50.0),
        (math.inf, 3_600_000.0),
    ],
)
def test_the_sampling_interval_is_revised_to_what_is_used(asked: float, used: float) -> None:
    assert value_settings(ua.MonitoringParameters(SamplingInterval=asked), 500.0).sampling_ms == used
    assert event_settings(ua.MonitoringParameters(SamplingInterval=asked)).sampling_ms == 0.0


@pytest.mark.parametrize(
    ("asked", "values", "events"), [(0, 1, 200), (1, 1, 200), (7, 7, 7), (0xFFFF_FFFF, 100, 2000)]
)
def test_the_queue_size_is_revised_to_what_is_used(asked: int, values: int, events: int) -> None:
    wanted = ua.MonitoringParameters(QueueSize=asked)
    assert value_settings(wanted, 500.0).queue_size == values
    assert event_settings(wanted).queue_size == events


# modes


def test_a_disabled_item_has_nothing_and_begins_anew() -> None:
    item = make_item(size=10)
    item.change(value(1.0), 0.0)
    item.set_mode(Mode.Disabled)
    item.change(value(2.0), 1.0)
    item.repeat()
    assert not item.has_something
    item.set_mode(Mode.Reporting)
    item.change(value(1.0), 2.0)
    assert told(item) == [(1.0, False)], "the same value, but it was not told since"


def test_a_sampling_item_keeps_what_it_would_report() -> None:
    item = make_item(size=10, mode=Mode.Sampling)
    item.change(value(1.0), 0.0)
    item.set_mode(Mode.Reporting)
    assert told(item) == [(1.0, False)]


def test_a_value_is_repeated_where_nothing_newer_waits() -> None:
    item = make_item(size=10)
    item.repeat()
    assert not item.has_something
    item.change(value(1.0), 0.0)
    item.repeat()
    assert told(item) == [(1.0, False)]
    item.repeat()
    assert told(item) == [(1.0, False)]


# events


def event(number: int) -> Occurrence:
    kind = ua.Variant(ua.NodeId("EmergencyEventType", 2), Kind.NodeId)
    return Occurrence(NODE, {"Message": ua.Variant(number, Kind.Int32), "EventType": kind})


def heard(item: EventItem) -> list[int | str]:
    found: list[int | str] = []
    while item.has_something:
        message, kind = item.notification().EventFields
        lost = kind.Value == ua.NodeId(ua.ObjectIds.EventQueueOverflowEventType)
        found.append("lost" if lost else message.Value)
    return found


@given(st.integers(1, 5), st.integers(0, 12), st.booleans())
def test_a_full_queue_of_events_says_what_it_lost(size: int, events: int, oldest: bool) -> None:
    item = EventItem(1, NODE, ItemSettings(7, 0, size, oldest), PASSES_ALL, Mode.Reporting)
    kept: deque[int] = deque()
    for number in range(events):
        item.hear(event(number))
        if len(kept) == size:
            kept.popleft() if oldest else kept.pop()
        kept.append(number)
    lost = ["lost"] if events > size else []
    assert heard(item) == ([*lost, *kept] if oldest else [*kept, *lost])
    item.hear(event(99))
    assert heard(item) == [99], "the loss is told once"


def test_an_event_of_another_node_or_without_a_listener_is_not_heard() -> None:
    item = EventItem(1, NODE, ItemSettings(7, 0, 5, True), PASSES_ALL, Mode.Disabled)
    assert not item.hear(event(1))
    item.set_mode(Mode.Reporting)
    assert not item.hear(Occurrence(ua.NodeId("another", 2), {}))
    assert not item.has_something


def test_a_field_that_no_event_has_is_null() -> None:
    item = EventItem(
        1, NODE, ItemSettings(7, 0, 5, True), EventFilter([None, "emitter"], Where([]), None), Mode.Reporting
    )
    item.hear(event(1))
    assert [field.Value for field in item.notification().EventFields] == [None, None]
