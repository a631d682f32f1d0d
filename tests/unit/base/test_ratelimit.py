"""Limits of repeated reports."""

from __future__ import annotations

from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from bridge.base.ratelimit import Pauses, PerSecond, RateLimit

times = st.lists(st.floats(0.0, 1000.0), min_size=1, max_size=200).map(sorted)


def test_a_limit_lets_through_a_burst_and_then_a_steady_rate() -> None:
    limit = RateLimit(3, 0.5)
    assert [limit.allows(0.0) for _ in range(5)] == [True, True, True, False, False]
    told = sum(limit.allows(number / 100) for number in range(1, 1001))
    assert told == 20


@given(times, st.integers(1, 5))
def test_no_second_has_more_than_its_number(moments: list[float], most: int) -> None:
    limit = PerSecond(most)
    told = [now for now in moments if limit.allows(now)]
    assert told[0] == moments[0]
    # Two seconds that touch may have each its own.
    for now in told:
        assert sum(now <= other < now + 1.0 for other in told) <= 2 * most
    assert len(told) >= min(most, len(moments))


def test_a_second_begins_with_the_first_of_it() -> None:
    limit = PerSecond(2)
    assert [limit.allows(now) for now in (5.0, 5.5, 5.99, 6.0, 6.5, 6.9)] == [True, True, False] * 2


@given(times)
def test_between_two_of_a_key_there_is_a_pause_and_none_is_lost(moments: list[float]) -> None:
    pauses = Pauses(10.0)
    results = [pauses.take(now, "one") for now in moments]
    told = [place for place, left_out in enumerate(results) if left_out is not None]
    assert all(moments[after] - moments[before] >= 10.0 for before, after in pairwise(told))
    assert sum(filter(None, results)) == results[: told[-1]].count(None)


def test_one_key_does_not_hide_another() -> None:
    pauses = Pauses(10.0)
    assert [pauses.take(now, "a") for now in (0.0, 1.0, 9.0, 10.0, 19.9, 20.0)] == [0, None, None, 2, None, 1]
    assert pauses.take(1.0, "b") == 0


def test_one_that_was_left_out_may_be_told_after_all() -> None:
    """It counts as told, and the pause goes on."""
    pauses = Pauses(10.0)
    assert pauses.take(0.0) == 0
    assert [pauses.take(now) for now in (1.0, 2.0, 3.0)] == [None] * 3
    assert pauses.end() == 2
    assert pauses.take(9.0) is None
    assert pauses.take(10.0) == 1
