"""Rejections of a front: however many there are, few are told."""

from __future__ import annotations

from bridge.command import Action, Code, Identity, Rejection, Source
from bridge.mirror.rejections import Rejections
from bridge.text import Text

GUEST = Identity(Source.OPCUA, "guest")


def rejection(target: str = "conveyor/fu1", value: int = 1) -> Rejection:
    return Rejection(
        GUEST, target, Action.WRITE, Code.READ_ONLY, Text.plain("BadNotWritable"), {"status_word": value}
    )


def test_those_of_one_kind_are_told_once_with_the_last_of_them() -> None:
    waiting = Rejections()
    for value in range(5):
        waiting.add(rejection(value=value), 10.0 + value)
    (told,) = waiting.take()
    assert (told.time_s, told.count) == (14.0, 5)
    assert told.rejection.values == {"status_word": 4}
    assert waiting.take() == []


def test_who_invents_targets_is_told_in_sum() -> None:
    waiting = Rejections()
    for number in range(10_000):
        waiting.add(rejection(f"attic/{number}"), 10.0)
    told = waiting.take()
    assert len(told) <= 21
    assert sum(one.count for one in told) == 10_000


def test_what_is_told_in_sum_names_only_what_is_true_of_all() -> None:
    waiting = Rejections()
    for number in range(100):
        who = Identity(Source.OPCUA, f"user{number}", address=f"10.0.0.9:{number}")
        waiting.add(
            Rejection(who, f"attic/{number}", Action.WRITE, Code.READ_ONLY, Text.plain(f"no {number}")), 10.0
        )
    *named, rest = waiting.take()
    assert {one.count for one in named} == {1}
    told = rest.rejection
    assert rest.count == 100 - len(named)
    assert (told.identity.user, told.identity.address, told.target, told.said) == ("", "10.0.0.9", "", "")
    assert (told.action, told.code, told.values) == (Action.WRITE, Code.READ_ONLY, {})


def test_who_floods_hides_no_other_client() -> None:
    waiting = Rejections()
    for number in range(1000):
        waiting.add(rejection(f"attic/{number}"), 10.0)
    other = Identity(Source.OPCUA, "guest", address="10.0.0.7")
    waiting.add(
        Rejection(other, "conveyor/fu2", Action.WRITE, Code.READ_ONLY, Text.plain("BadNotWritable")), 10.0
    )
    told = waiting.take()
    assert [one.count for one in told if one.rejection.identity == other] == [1]
    for number in range(1000):
        waiting.add(
            Rejection(Identity(Source.OPCUA, "x", address=f"10.0.{number}.1"), "a", "b", "c", ""), 10.0
        )
    told = waiting.take()
    assert len(told) <= 20 + 21
    assert sum(one.count for one in told) == 1000
