"""One subscription and the Publish requests of its session; no server, no clock."""

from __future__ import annotations

import math

import pytest
from asyncua import ua
from hypothesis import given
from hypothesis import strategies as st

from bridge.uaserver.filters.changefilter import ChangeFilter
from bridge.uaserver.library import ServiceError
from bridge.uaserver.reading import window_of
from bridge.uaserver.subscriptions.items import ItemSettings, ValueItem
from bridge.uaserver.subscriptions.publishing import PublishRequest
from bridge.uaserver.subscriptions.subscription import RETRANSMISSIONS, Subscription, Terms, terms
from tests.support.opcua_sessions import Session, decoded_changes

Codes, Mode = ua.StatusCodes, ua.MonitoringMode
NODE, VALUE = ua.NodeId("conveyor", 2), ua.AttributeIds.Value


class Rig:
    """A subscription with some items, its session, and what the client got."""

    def __init__(self, items: int = 1, queue: int = 100, **agreed: int) -> None:
        self.session = Session()
        self.terms = Terms(
            **(
                {
                    "interval_ms": 100,
                    "lifetime": 30,
                    "keep_alive": 10,
                    "most_per_message": 1000,
                    "priority": 0,
                }
                | agreed
            )
        )
        self.subscription = Subscription(1, self.session, self.terms, enabled=True)
        self.now = 0.0
        self.got: list[ua.PublishResult] = []
        self.refused: list[int] = []
        self.items: list[ValueItem] = []
        looked_at = window_of((), VALUE, ua.TimestampsToReturn.Both)
        for number in range(items):
            item = ValueItem(
                number,
                NODE,
                VALUE,
                looked_at,
                ItemSettings(number, 50, queue, True),
                ChangeFilter(),
                Mode.Reporting,
            )
            self.items.append(item)
            self.subscription.add(item)

    def change(self, number: int, which: int = 0) -> None:
        self.items[which].change(ua.DataValue(ua.Variant(number, ua.VariantType.Int32)), self.now)
        self.subscription.noticed(self.items[which])

    def cycle(self, times: int = 1) -> bool:
        for _ in range(times):
            self.now += 0.1
            if not self.subscription.on_cycle(self.now):
                return False
        return True

    def publish(self, expires_at: float = math.inf, open_: bool = True) -> None:
        request = PublishRequest(expires_at, lambda: open_, self.got.append, self.refused.append)
        self.session.publishing.put(request, 1, self.now)

    def numbers(self) -> list[int]:
        """Every value that was told, in its order."""
        return [
            item.Value.Value.Value
            for result in self.got
            for data in result.NotificationMessage.NotificationData
            for item in decoded_changes(data)
        ]


def sequence(result: ua.PublishResult) -> int:
    return result.NotificationMessage.SequenceNumber


def code(result: ua.PublishResult) -> int:
    (data,) = result.NotificationMessage.NotificationData
    return data.Status.value


# what is agreed


@pytest.mark.parametrize("asked", [-1.0, 0.0, 1.0, 49.9, math.nan, -math.inf])
def test_no_publishing_interval_is_shorter_than_the_floor(asked: float) -> None:
    assert terms(ua.CreateSubscriptionParameters(RequestedPublishingInterval=asked)).interval_ms == 50


@given(
    st.floats(),
    st.integers(0, 0xFFFF_FFFF),
    st.integers(0, 0xFFFF_FFFF),
    st.integers(0, 0xFFFF_FFFF),
)
def test_whatever_is_asked_the_terms_are_sound(
    interval: float, lifetime: int, keep_alive: int, most: int
) -> None:
    for params in (ua.CreateSubscriptionParameters, ua.ModifySubscriptionParameters):
        agreed = terms(
            params(
                RequestedPublishingInterval=interval,
                RequestedLifetimeCount=lifetime,
                RequestedMaxKeepAliveCount=keep_alive,
                MaxNotificationsPerPublish=most,
            )
        )
        assert 50 <= agreed.interval_ms <= 3_600_000
        assert agreed.keep_alive >= 1
        assert agreed.lifetime >= 3 * agreed.keep_alive
        # What nobody asks about any more is gone within half an hour, or three intervals.
        assert agreed.lifetime * agreed.interval_ms <= max(1_800_000, 3 * agreed.interval_ms)
        assert 1 <= agreed.most_per_message <= max(1, min(most or 1000, 1000))


# messages


@given(
    st.lists(st.sampled_from(["change", "cycle", "publish", "again", "lost"]), max_size=60), st.integers(1, 5)
)
def test_every_change_is_told_once_and_in_its_order(steps: list[str], most: int) -> None:
    rig = Rig(most_per_message=most, keep_alive=3, lifetime=1000)
    changes = 0
    for step in steps:
        if step == "change":
            changes += 1
            rig.change(changes)
        elif step == "cycle":
            rig.cycle()
        elif step == "publish":
            rig.publish()
        elif step == "lost":
            rig.publish(open_=False)
        elif rig.got:
            # What was sent can be had again, the same, as long as it is not acknowledged.
            last = rig.got[-1]
            if last.NotificationMessage.NotificationData:
                assert rig.subscription.republish(sequence(last)) is last.NotificationMessage
    for _ in range(changes + 3):
        rig.cycle()
        rig.publish()
    assert rig.numbers() == list(range(1, changes + 1))
    data = [result for result in rig.got if result.NotificationMessage.NotificationData]
    assert [sequence(result) for result in data] == list(range(1, len(data) + 1))
    for result in rig.got:
        assert sum(len(decoded_changes(d)) for d in result.NotificationMessage.NotificationData) <= most


def test_more_is_said_and_follows_with_the_next_request() -> None:
    rig = Rig(items=3, most_per_message=2)
    for which in range(3):
        for number in range(2):
            rig.change(10 * which + number, which)
    rig.publish()
    assert rig.got == []
    rig.cycle()
    assert [result.MoreNotifications for result in rig.got] == [True]
    rig.publish()
    rig.publish()
    assert [result.MoreNotifications for result in rig.got] == [True, True, False]
    assert rig.numbers() == [0, 1, 10, 11, 20, 21]


def test_the_first_cycle_has_a_message_and_then_each_keep_alive() -> None:
    rig = Rig(items=0, keep_alive=10)
    for _ in range(5):
        rig.publish()
    came = []
    for cycle in range(1, 32):
        before = len(rig.got)
        rig.cycle()
        if len(rig.got) > before:
            came.append(cycle)
    assert came == [1, 11, 21, 31]
    # A keep-alive names the number that comes next and uses it not.
    assert {sequence(result) for result in rig.got} == {1}
    assert all(result.AvailableSequenceNumbers == [] for result in rig.got)


def test_a_message_is_kept_until_it_is_acknowledged() -> None:
    rig = Rig()
    for number in range(3):
        rig.change(number)
        rig.cycle()
        rig.publish()
    assert [list(result.AvailableSequenceNumbers) for result in rig.got] == [[1], [1, 2], [1, 2, 3]]
    assert rig.subscription.acknowledge(2).value == Codes.Good
    assert rig.subscription.acknowledge(2).value == Codes.BadSequenceNumberUnknown
    assert rig.subscription.acknowledge(9).value == Codes.BadSequenceNumberUnknown
    for number in (0, 2, 4, 0xFFFF_FFFF):
        with pytest.raises(ServiceError) as refused:
            rig.subscription.republish(number)
        assert refused.value.code == Codes.BadMessageNotAvailable
    for _ in range(2):
        assert rig.subscription.republish(1) is rig.got[0].NotificationMessage
    assert rig.subscription.available == [1, 3]


def test_what_nobody_acknowledges_is_not_kept_for_ever() -> None:
    rig = Rig()
    for number in range(RETRANSMISSIONS + 5):
        rig.change(number)
        rig.cycle()
        rig.publish()
    assert rig.subscription.available == list(range(6, RETRANSMISSIONS + 6))


def test_disabled_it_keeps_what_is_queued_and_says_that_it_is_there() -> None:
    rig = Rig(keep_alive=2)
    rig.subscription.set_enabled(False)
    rig.change(1)
    for _ in range(3):
        rig.publish()
    rig.cycle(5)
    assert rig.numbers() == []
    assert len(rig.got) == 3
    rig.subscription.set_enabled(True)
    rig.publish()
    rig.cycle()
    assert rig.numbers() == [1]


def test_an_item_that_only_samples_is_not_told() -> None:
    rig = Rig(keep_alive=1000, lifetime=3000)
    rig.cycle()
    rig.items[0].set_mode(Mode.Sampling)
    rig.change(1)
    rig.publish()
    rig.publish()
    rig.cycle(3)
    assert rig.numbers() == []
    rig.items[0].set_mode(Mode.Reporting)
    rig.cycle()
    assert rig.numbers() == [1]


# life


def test_without_requests_it_ends_after_its_lifetime() -> None:
    rig = Rig(lifetime=30)
    assert rig.cycle(29)
    assert not rig.cycle()


@pytest.mark.parametrize("sign", ["touch", "publish"])
def test_a_sign_of_its_client_keeps_it(sign: str) -> None:
    rig = Rig(lifetime=30)
    for _ in range(10):
        assert rig.cycle(20)
        if sign == "touch":
            rig.subscription.touch()
        else:
            rig.publish()


# requests


def test_a_request_that_is_too_old_or_too_many_is_refused() -> None:
    rig = Rig(keep_alive=1000, lifetime=3000)
    rig.cycle()
    rig.publish()
    rig.publish(expires_at=0.15)
    rig.cycle()
    rig.change(1)
    rig.cycle()
    assert rig.refused == [Codes.BadTimeout]
    for _ in range(20):
        rig.publish()
    assert rig.refused == [Codes.BadTimeout] + 8 * [Codes.BadTooManyPublishRequests]


def test_a_last_word_reaches_the_session_that_has_lost_it() -> None:
    rig = Rig()
    last = rig.subscription.last_word(Codes.GoodSubscriptionTransferred)
    rig.session.publishing.say_last(last, 0.0)
    assert rig.session.publishing.has_last_words
    rig.publish()
    assert code(rig.got[0]) == Codes.GoodSubscriptionTransferred
    assert not rig.session.publishing.has_last_words


def test_a_session_that_closes_answers_what_waits() -> None:
    rig = Rig(keep_alive=1000, lifetime=3000)
    rig.cycle()
    rig.publish()
    rig.publish()
    rig.publish(open_=False)
    rig.session.publishing.close(0.0)
    assert rig.refused == [Codes.BadSessionClosed]
