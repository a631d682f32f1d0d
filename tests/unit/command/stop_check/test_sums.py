"""Stop time that a drive lets pass: what is counted of it, and what ends the count."""

from __future__ import annotations

from math import inf

import pytest

from bridge.command.stop_check.sums import IgnoredTime, Unfollowed

OFF_S, RAMP_S = 0.5, 32.0
LIMIT_S = RAMP_S / 4


def counted(*telegrams: tuple[float, float | None], begins_at: float = 1.0) -> IgnoredTime:
    time = IgnoredTime().begin(begins_at)
    for at, speed in telegrams:
        time = time.seen(at, speed)
    return time


def test_time_counts_from_when_telegrams_tell_of_the_stop() -> None:
    assert counted((0.5, None), (0.75, None)).time_s == 0.0
    assert counted((0.75, None), (1.25, None)).time_s == 0.25
    assert counted((0.75, None), (1.25, None), (2.0, None)).time_s == 1.0


def test_the_first_telegram_of_a_stop_has_nothing_to_be_compared_with() -> None:
    assert counted((1.5, 100.0)) == IgnoredTime(begins_at=1.0, seen_at=1.5, speed=100.0)


def test_without_a_stop_nothing_counts() -> None:
    assert counted((1.0, None), (9.0, None), begins_at=inf).time_s == 0.0


def test_the_time_of_several_stops_is_summed_and_each_counts_once() -> None:
    time = counted((1.0, None), (1.25, None), (1.5, None)).begin(inf).begin(8.0)
    time = time.seen(7.0, None).seen(8.25, None)
    assert (time.time_s, time.stops) == (0.75, 2)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_what_it_loses_counts_as_a_share_of_its_speed(sign: float) -> None:
    time = counted((1.0, sign * 100.0), (2.0, sign * 75.0))
    assert (time.time_s, time.lost) == (1.0, 0.25)
    assert time.seen(3.0, sign * 100.0).lost == 0.0, "and what it gains counts against it"


def test_speeds_before_telegrams_tell_of_the_stop_are_no_loss() -> None:
    assert counted((0.25, 200.0), (0.75, 100.0), (1.25, 100.0)).lost == 0.0


def test_speeds_of_two_stops_are_not_compared() -> None:
    time = counted((1.0, 200.0), (1.5, 200.0)).begin(inf).begin(8.0).seen(8.0, 100.0).seen(8.5, 100.0)
    assert (time.time_s, time.lost) == (1.0, 0.0)


@pytest.mark.parametrize(
    ("before", "time_s", "lost"),
    [
        ([64.0], 0.0, 0.0),  # one telegram says nothing of whether it still speeds up
        ([64.0, 64.0], 0.5, 0.25),
        ([65.0, 64.0], 0.5, 0.25),
        ([62.0, 64.0], 0.0, 0.0),
        ([64.0, 62.0, 64.0], 0.0, 0.0),
    ],
)
def test_a_speed_before_the_stop_is_of_use_where_it_was_steady(
    before: list[float], time_s: float, lost: float
) -> None:
    time = IgnoredTime()
    for place, speed in enumerate(before):
        time = time.seen(place / 64, speed)
    time = time.begin(1.0).seen(1.5, 48.0)
    assert (time.time_s, time.lost) == (time_s, lost)


@pytest.mark.parametrize("speed", [0.0, -100.0])
def test_who_stands_or_turns_round_has_obeyed(speed: float) -> None:
    assert counted((1.0, 100.0), (2.0, 100.0), (2.5, speed)) == IgnoredTime(begins_at=1.0)


def test_after_obeying_the_same_stop_may_count_again() -> None:
    time = counted((1.0, None), (2.0, None)).obeyed().seen(3.0, None).seen(3.5, None)
    assert (time.time_s, time.stops) == (0.5, 1)


def judged(time: Unfollowed, at: float, speed: float | None) -> tuple[Unfollowed, IgnoredTime | None]:
    return time.seen(at, speed, off_s=OFF_S, ramp_s=RAMP_S)


def begun(on_from: float = 1.0) -> Unfollowed:
    return Unfollowed().begin(on_from, 1.0)


def test_who_stays_on_after_a_word_that_takes_the_voltage_is_named_at_the_short_bound() -> None:
    time, found = judged(begun(), 1.0, None)
    time, found = judged(time, 1.25, None)
    assert found is None
    time, found = judged(time, 1.5, None)
    assert found is not None and found.time_s == OFF_S
    assert time == Unfollowed(IgnoredTime(begins_at=1.0), IgnoredTime(begins_at=1.0)), (
        "and the count begins anew"
    )


def test_a_stop_that_leaves_the_voltage_on_is_not_judged_without_a_speed() -> None:
    time, found = judged(Unfollowed().begin(inf, 1.0), 1.0, None)
    _, found = judged(time, 1000.0, None)
    assert found is None


@pytest.mark.parametrize(
    ("lost", "is_named"),
    [(0.0, True), (0.0625 - 1 / 1024, True), (0.0625, False), (0.25, False), (-0.5, True)],
)
def test_after_a_quarter_of_the_slowest_ramp_a_quarter_of_its_loss_is_asked_for(
    lost: float, is_named: bool
) -> None:
    time, found = judged(begun(inf), 1.0, 1024.0)
    time, found = judged(time, 1.0 + LIMIT_S - 1 / 64, 1024.0)
    assert found is None
    time, found = judged(time, 1.0 + LIMIT_S, 1024.0 * (1.0 - lost))
    assert (found is not None) is is_named
    assert time.fast == IgnoredTime(begins_at=1.0), "either way the count begins anew"


def test_where_the_bounds_are_the_same_the_whole_of_it_is_the_least() -> None:
    time, _ = begun(inf).seen(1.0, 8.0, off_s=0.5, ramp_s=0.5)
    time, found = time.seen(1.25, 8.0, off_s=0.5, ramp_s=0.5)
    assert found is None
    assert time.seen(1.5, 8.0, off_s=0.5, ramp_s=0.5)[1] is not None


def test_what_has_been_summed_outlives_a_word_that_enables_and_no_obedience() -> None:
    time, _ = judged(begun(), 1.0, 8.0)
    time, _ = judged(time, 1.25, 8.0)
    kept = time.end()
    assert (kept.on.time_s, kept.fast.time_s) == (0.25, 0.25)
    assert (kept.on.begins_at, kept.fast.begins_at) == (inf, inf)
    assert kept.obeyed() == Unfollowed()
