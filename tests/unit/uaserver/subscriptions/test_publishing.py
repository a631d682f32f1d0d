"""Publish requests of a session, and the subscriptions that wait for one; no server, no clock."""

from __future__ import annotations

import math

from asyncua import ua

from bridge.uaserver.subscriptions.publishing import PublishQueue, PublishRequest

Codes = ua.StatusCodes


class Late:
    """A subscription that has something to tell so many times."""

    def __init__(self, told: list[str], name: str, priority: int, times: int = 1) -> None:
        self.name = name
        self.priority = priority
        self._told = told
        self._left = times

    def publish(self, request: PublishRequest) -> bool:
        self._told.append(self.name)
        self._left -= 1
        return self._left > 0


class Rig:
    """The requests of one session, and what became of them."""

    def __init__(self) -> None:
        self.queue = PublishQueue()
        self.told: list[str] = []
        self.got: list[ua.PublishResult] = []
        self.refused: list[int] = []

    def request(
        self, expires_at: float = math.inf, open_: bool = True, now: float = 0.0, handle: int = 0
    ) -> PublishRequest:
        made = PublishRequest(expires_at, lambda: open_, self.got.append, self.refused.append, handle=handle)
        self.queue.put(made, 1, now)
        return made

    def ask(self, name: str, priority: int = 0, times: int = 1) -> Late:
        made = Late(self.told, name, priority, times)
        self.queue.ask(made, 0.0)
        return made


def test_the_highest_priority_is_told_first_and_equals_take_turns() -> None:
    rig = Rig()
    for name, priority, times in (("a", 1, 1), ("b", 1, 3), ("c", 9, 1)):
        rig.ask(name, priority, times)
    for _ in range(5):
        rig.request()
    assert rig.told == ["c", "a", "b", "b", "b"]


def test_a_request_waits_for_who_comes_and_is_used_once() -> None:
    rig = Rig()
    rig.request()
    rig.ask("a")
    rig.ask("b")
    assert rig.told == ["a"]
    rig.request()
    assert rig.told == ["a", "b"]


def test_who_is_forgotten_tells_nothing() -> None:
    rig = Rig()
    rig.queue.forget(rig.ask("a"))
    rig.request()
    assert rig.told == []


def test_what_is_too_old_or_too_many_or_of_a_lost_connection_is_not_used() -> None:
    rig = Rig()
    rig.request(expires_at=1.0)
    rig.request(open_=False)
    rig.queue.ask(Late(rig.told, "a", 0), 2.0)
    assert (rig.told, rig.refused) == ([], [Codes.BadTimeout])
    rig.request(now=3.0)
    assert rig.told == ["a"]
    for _ in range(15):
        rig.request()
    assert rig.refused == [Codes.BadTimeout] + 4 * [Codes.BadTooManyPublishRequests]


def test_last_words_come_before_all_else_with_the_acknowledgements_of_the_request() -> None:
    rig = Rig()
    rig.ask("a")
    rig.queue.say_last(ua.PublishResult(SubscriptionId=7), 0.0)
    assert rig.queue.has_last_words
    rig.request().results.append(ua.StatusCode())
    assert ([one.SubscriptionId for one in rig.got], rig.told) == ([7], [])
    assert not rig.queue.has_last_words
    rig.request()
    assert rig.told == ["a"]


def test_closing_answers_what_waits_and_leaves_nothing() -> None:
    rig = Rig()
    rig.request()
    rig.request()
    rig.queue.close(0.0)
    assert rig.refused == 2 * [Codes.BadSessionClosed]
    rig.ask("a")
    rig.queue.close(0.0)
    rig.request()
    assert rig.told == []


def test_what_is_cancelled_is_answered_and_the_others_wait_on() -> None:
    rig = Rig()
    for handle, open_ in ((1, True), (2, True), (1, True), (1, False)):
        rig.request(handle=handle, open_=open_)
    assert rig.queue.cancel(1) == 2, "one has lost its connection"
    assert rig.refused == 2 * [Codes.BadRequestCancelledByClient]
    assert rig.queue.cancel(1) == 0
    rig.ask("a")
    assert rig.told == ["a"]
