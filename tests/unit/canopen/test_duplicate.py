"""Signs of two devices with one node id, to the last heartbeat and answer."""

from __future__ import annotations

import pytest

from bridge.canopen.duplicate import (
    AnsweredTwice,
    DuplicateCheck,
    DuplicateSign,
    StateChanges,
    TooManyHeartbeats,
)

OPERATIONAL, PRE_OPERATIONAL = 5, 127
READ, OTHER_SUB = bytes.fromhex("4300100092010200"), bytes.fromhex("4300100192010200")
OTHER_VALUE = bytes.fromhex("4F00100001000000")


def check(period_s: float | None = 0.05) -> DuplicateCheck:
    one = DuplicateCheck()
    one.period_s = period_s
    return one


def told(one: DuplicateCheck, heartbeats: list[tuple[float, int]]) -> list[tuple[int, DuplicateSign]]:
    """Reports, each with the number of heartbeats, (time, state), before it."""
    said = [one.on_heartbeat(state, time) for time, state in heartbeats]
    return [(number, sign) for number, sign in enumerate(said, 1) if sign]


# heartbeats


def test_two_producers_of_the_same_period_are_too_many() -> None:
    both = sorted((0.05 * n + start, OPERATIONAL) for n in range(30) for start in (0.0, 0.02))
    found = told(check(), both)
    assert [number for number, _ in found] == [21, 42]
    for _, sign in found:
        assert isinstance(sign, TooManyHeartbeats)
        assert (sign.count, sign.expected_s) == (20, 1.0)
        assert sign.took_s == pytest.approx(0.5)


@pytest.mark.parametrize(("pause_s", "is_told"), [(0.69, True), (0.70, False), (1.0, False), (3.0, False)])
def test_a_single_device_may_be_somewhat_quick(pause_s: float, is_told: bool) -> None:
    """Its own clock may be fast, and its frames may wait for the bus."""
    assert bool(told(check(1.0), [(pause_s * n, OPERATIONAL) for n in range(100)])) is is_told


def test_two_that_are_in_different_states_are_found_by_that() -> None:
    """Also where each sends every other heartbeat, so that their number is right."""
    turns = [(0.05 * n, PRE_OPERATIONAL if n % 2 else OPERATIONAL) for n in range(30)]
    assert told(check(), turns) == [(21, StateChanges(20, 20))]


@pytest.mark.parametrize(("changes", "is_told"), [(0, False), (1, False), (7, False), (8, True)])
def test_a_single_device_may_change_its_state_now_and_then(changes: int, is_told: bool) -> None:
    """So many times in each span of 20 heartbeats; they do not add up."""
    span = [PRE_OPERATIONAL if min(n, changes) % 2 else OPERATIONAL for n in range(21)]
    found = told(check(), [(0.05 * n, state) for n, state in enumerate(span * 5)])
    assert bool(found) is is_told
    assert all(sign == StateChanges(8, 20) for _, sign in found)


def test_without_a_period_nothing_is_expected() -> None:
    assert not told(check(None), [(0.0, n % 2) for n in range(100)])


def test_a_restart_of_the_node_begins_anew() -> None:
    one = check()
    assert not told(one, [(0.01 * n, n % 2) for n in range(20)])
    one.restart()
    assert not told(one, [(1.0 + 0.05 * n, OPERATIONAL) for n in range(100)])


# SDO answers


def twice(
    one: DuplicateCheck, at: float, after_s: float = 0.0, first: bytes = READ, second: bytes = READ
) -> str | None:
    """A request of ours is answered, and then there is an answer that belongs to none."""
    assert one.on_reply(first, at, matched=True) is None
    return one.on_reply(second, at + after_s, matched=False)


def test_the_third_request_that_is_answered_twice_is_told_and_then_each_third() -> None:
    one = DuplicateCheck()
    said = [twice(one, 1.0 * n, 0.01) for n in range(9)]
    assert said == [None, None, AnsweredTwice(3)] * 3


@pytest.mark.parametrize(
    ("first", "second", "after_s", "is_told"),
    [
        (READ, READ, 0.05, True),
        (READ, READ, 0.0625, False),  # too late for a twin: an answer that was slow
        (READ, OTHER_VALUE, 0.01, True),  # the twin has another value
        (READ, OTHER_SUB, 0.01, False),
        (READ, READ[:7], 0.01, False),
        (READ, READ[:4], 0.01, False),
    ],
)
def test_a_twin_answers_at_once_for_the_same_object(
    first: bytes, second: bytes, after_s: float, is_told: bool
) -> None:
    one = DuplicateCheck()
    said = [twice(one, 0.0, after_s, first, second) for _ in range(3)]
    assert bool(said[-1]) is is_told


def test_what_is_answered_once_is_no_sign() -> None:
    one = DuplicateCheck()
    assert not any(one.on_reply(READ, 0.01 * n, matched=True) for n in range(20))


@pytest.mark.parametrize(("third_at", "is_told"), [(59.0, True), (60.0, True), (61.0, False)])
def test_what_was_a_minute_ago_does_not_count(third_at: float, is_told: bool) -> None:
    one = DuplicateCheck()
    twice(one, 0.0)
    twice(one, 1.0)
    assert bool(twice(one, third_at)) is is_told
    assert twice(one, third_at + 1) is None
    assert bool(twice(one, third_at + 2)) is not is_told


@pytest.mark.parametrize(("after_s", "is_told"), [(0.0, False), (1.9, False), (2.0, True), (5.0, True)])
def test_soon_after_another_clients_request_the_answer_may_be_its_own(after_s: float, is_told: bool) -> None:
    one = DuplicateCheck()
    one.on_foreign_request(8.0)
    said = [twice(one, 8.0 + after_s) for _ in range(3)]
    assert bool(said[-1]) is is_told
