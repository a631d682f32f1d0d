"""Triggering links: what an item that triggers has reported of others; no server, no clock."""

from __future__ import annotations

from typing import Any

import pytest
from asyncua import ua
from hypothesis import given
from hypothesis import strategies as st

from bridge.uaserver.filters.changefilter import ChangeFilter
from bridge.uaserver.filters.eventfilter import EventFilter, Occurrence
from bridge.uaserver.filters.where import Where
from bridge.uaserver.library import ServiceError
from bridge.uaserver.reading import window_of
from bridge.uaserver.subscriptions import triggering
from bridge.uaserver.subscriptions.items import EventItem, ItemSettings, ValueItem
from bridge.uaserver.subscriptions.publishing import PublishRequest
from bridge.uaserver.subscriptions.subscription import Subscription, Terms
from bridge.uaserver.subscriptions.triggering import TriggeringLinks
from tests.support.opcua_sessions import Session, decoded_changes

Codes, Mode = ua.StatusCodes, ua.MonitoringMode
VALUE = ua.AttributeIds.Value
NODE = ua.NodeId("conveyor", 2)
TRIGGER, LINKED, EVENTS = 0, 1, 2


def value_item(number: int, mode: Mode, queue: int = 10, discard_oldest: bool = True) -> ValueItem:
    looked_at = window_of((), VALUE, ua.TimestampsToReturn.Both)
    settings = ItemSettings(number, 50, queue, discard_oldest)
    return ValueItem(number, NODE, VALUE, looked_at, settings, ChangeFilter(), mode)


class Rig:
    """A triggering item, a linked one and one for events on a subscription, and what the client got."""

    def __init__(
        self, trigger: Mode = Mode.Reporting, linked: Mode = Mode.Sampling, most: int = 1000
    ) -> None:
        self.session = Session()
        self.subscription = Subscription(1, self.session, Terms(100, 3000, 1000, most, 0), enabled=True)
        self.got: list[ua.PublishResult] = []
        self.now = 0.0
        events = EventFilter(["Message"], Where([]), None)
        self.items: list[ValueItem | EventItem] = [
            value_item(TRIGGER, trigger),
            value_item(LINKED, linked),
            EventItem(EVENTS, NODE, ItemSettings(EVENTS, 0, 2, True), events, Mode.Sampling),
        ]
        for item in self.items:
            self.subscription.add(item)

    def link(self, trigger: int = TRIGGER, linked: int = LINKED) -> None:
        self.subscription.links.add(trigger, self.items[linked])

    def change(self, which: int, number: int) -> None:
        item = self.items[which]
        assert isinstance(item, ValueItem)
        is_queued = item.change(ua.DataValue(ua.Variant(number, ua.VariantType.Int32)), self.now)
        self.subscription.noticed(item, is_queued=is_queued)

    def event(self, number: int) -> None:
        self.subscription.hear(Occurrence(NODE, {"Message": ua.Variant(number, ua.VariantType.Int32)}))

    def told(self) -> list[tuple[int, Any]]:
        """(item, value) of what came with this publishing interval."""
        before = len(self.got)
        for _ in range(5):
            self.session.publishing.put(
                PublishRequest(float("inf"), lambda: True, self.got.append, lambda code: None), 1, self.now
            )
        self.now += 0.1
        self.subscription.on_cycle(self.now)
        found: list[tuple[int, Any]] = []
        for result in self.got[before:]:
            for data in result.NotificationMessage.NotificationData:
                if isinstance(data, ua.EventNotificationList):
                    found += [(one.ClientHandle, one.EventFields[0].Value) for one in data.Events]
                else:
                    found += [(one.ClientHandle, one.Value.Value.Value) for one in decoded_changes(data)]
        return found


def test_a_linked_item_is_told_when_the_other_has_something_and_only_then() -> None:
    rig = Rig()
    rig.link()
    rig.change(LINKED, 7)
    rig.told()
    assert rig.told() == [], "nothing has triggered"
    rig.change(LINKED, 8)
    rig.change(TRIGGER, 1)
    assert sorted(rig.told()) == [(TRIGGER, 1), (LINKED, 7), (LINKED, 8)]
    rig.change(LINKED, 9)
    assert rig.told() == [], "once"


def test_an_item_that_only_samples_triggers_and_is_not_told() -> None:
    rig = Rig(Mode.Sampling)
    rig.link()
    rig.change(LINKED, 7)
    rig.change(TRIGGER, 1)
    assert rig.told() == [(LINKED, 7)]


def test_a_disabled_item_neither_triggers_nor_is_told() -> None:
    rig = Rig(Mode.Disabled)
    rig.link()
    rig.change(LINKED, 7)
    rig.change(TRIGGER, 1)
    assert rig.told() == []
    rig = Rig(linked=Mode.Disabled)
    rig.link()
    rig.change(LINKED, 7)
    rig.change(TRIGGER, 1)
    assert rig.told() == [(TRIGGER, 1)]


def test_a_linked_item_that_reports_is_told_each_value_once() -> None:
    rig = Rig(linked=Mode.Reporting)
    rig.link()
    rig.change(LINKED, 7)
    rig.change(TRIGGER, 1)
    assert sorted(rig.told()) == [(TRIGGER, 1), (LINKED, 7)]
    assert rig.told() == []


def test_what_was_queued_before_the_link_triggers_nothing() -> None:
    """Part 4 §5.13.1.6, the last rule; with another link that it did trigger."""
    rig = Rig()
    rig.link(TRIGGER, EVENTS)
    rig.event(5)
    rig.change(LINKED, 7)
    rig.change(TRIGGER, 1)
    rig.link()
    assert sorted(rig.told()) == [(TRIGGER, 1), (EVENTS, 5)]


def test_events_trigger_and_are_triggered() -> None:
    rig = Rig()
    rig.link(EVENTS, LINKED)
    rig.change(LINKED, 7)
    rig.event(5)
    assert rig.told() == [(LINKED, 7)], "the events are sampled"
    rig.link(TRIGGER, EVENTS)
    for number in range(3):
        rig.event(number)
    rig.change(TRIGGER, 1)
    # Of four events two are kept; that others were lost is told before them.
    trigger, (_, loss), *kept = rig.told()
    assert (trigger, kept) == ((TRIGGER, 1), [(EVENTS, 1), (EVENTS, 2)])
    assert isinstance(loss, ua.LocalizedText)


def test_links_are_one_level_deep() -> None:
    rig = Rig(Mode.Sampling)
    rig.link(TRIGGER, LINKED)
    rig.link(LINKED, EVENTS)
    rig.change(LINKED, 7)
    rig.told()
    rig.event(5)
    rig.change(TRIGGER, 1)
    assert rig.told() == [(LINKED, 7)]


def test_with_the_item_its_links_go_in_both_directions() -> None:
    rig = Rig()
    for trigger, linked in ((TRIGGER, LINKED), (LINKED, EVENTS), (LINKED, LINKED)):
        rig.link(trigger, linked)
    rig.change(LINKED, 7)
    rig.change(TRIGGER, 1)
    rig.subscription.drop(rig.items[LINKED])
    assert rig.told() == [(TRIGGER, 1)]
    for trigger, linked in ((TRIGGER, LINKED), (LINKED, EVENTS)):
        with pytest.raises(ServiceError) as refused:
            rig.subscription.links.remove(trigger, linked)
        assert refused.value.code == Codes.BadMonitoredItemIdInvalid


def test_a_link_that_was_removed_counts_for_what_it_has_triggered_and_no_more() -> None:
    rig = Rig()
    rig.link()
    rig.change(LINKED, 7)
    rig.change(TRIGGER, 1)
    rig.subscription.links.remove(TRIGGER, LINKED)
    rig.change(TRIGGER, 2)
    rig.change(LINKED, 8)
    assert sorted(rig.told()) == [(TRIGGER, 1), (TRIGGER, 2), (LINKED, 7)]


def test_what_an_item_has_triggered_before_it_was_deleted_is_told() -> None:
    rig = Rig()
    rig.link()
    rig.change(LINKED, 7)
    rig.change(TRIGGER, 1)
    rig.subscription.drop(rig.items[TRIGGER])
    assert rig.told() == [(LINKED, 7)]


def test_a_message_that_is_full_leaves_the_rest_for_the_next() -> None:
    rig = Rig(Mode.Sampling, most=2)
    rig.link()
    for number in range(5):
        rig.change(LINKED, number)
        rig.now += 0.1
    rig.change(TRIGGER, 1)
    assert rig.told() == [(LINKED, number) for number in range(5)]


def test_links_are_not_without_end(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(triggering, "MOST_LINKS", 3)
    links = TriggeringLinks()
    items = [value_item(number, Mode.Sampling) for number in range(5)]
    for item in (*items[:3], items[0]):  # the same again is no other
        links.add(9, item)
    with pytest.raises(ServiceError) as refused:
        links.add(8, items[4])
    assert refused.value.code == Codes.BadResourceUnavailable
    links.drop(1)
    links.add(8, items[4])


@given(
    st.lists(st.tuples(st.sampled_from("clr"), st.integers(0, 3)), max_size=40),
    st.integers(1, 4),
    st.booleans(),
)
def test_what_is_released_is_what_was_queued_then(
    steps: list[tuple[str, int]], size: int, oldest: bool
) -> None:
    """Changes, releases and looks at the queue in any order: nothing is told that came after the release,
    unless it took the place of what was there."""
    item = value_item(1, Mode.Sampling, size, oldest)
    number, released = 0, -1
    for step, times in steps:
        if step == "r":
            item.release()
            released = number
        for _ in range(times if step == "c" else 0):
            number += 1
            item.change(ua.DataValue(ua.Variant(number, ua.VariantType.Int32)), float(number))
        while step == "l" and item.has_report:
            told = item.take().Value.Value
            assert told <= released or size == 1 or not oldest
    item.release()
    left = len(item.queue or ())
    assert sum(1 for _ in iter(lambda: item.has_report and item.take(), False)) == left
    assert not item.has_something
