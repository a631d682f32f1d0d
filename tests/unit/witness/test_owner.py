"""The owner of a drive as the witness knows it: by the number of its telegrams, as young as they can be."""

from __future__ import annotations

import pytest

from bridge.witness.owner import WatchedOwner


def owner(timeout_ms: int = 200, beside_ms: int | None = 50) -> WatchedOwner:
    """Asked every 50 ms; its last telegram came before 10.0 s."""
    one = WatchedOwner("conveyor/fu1", timeout_ms, beside_ms)
    one.on_number(7, 9.95, 10.0)
    return one


def test_it_is_promised_its_time_out_and_what_is_beside_it() -> None:
    assert owner().is_promised
    assert owner().bound_ms == 250
    assert not owner(beside_ms=None).is_promised
    assert owner(beside_ms=None).bound_ms is None
    assert owner(timeout_ms=0).bound_ms is None


def test_an_rpdo_that_enables_after_that_is_late_once_it_is_known_that_nothing_came() -> None:
    one = owner()
    one.on_enabling(10.260)
    assert one.lateness() == "", "it has not been asked since"
    one.on_number(7, 10.3, 10.31)
    assert one.lateness() == "260 ms after its owner's last telegram; promised: 250"
    assert one.lateness() == "", "once"


def test_one_at_the_bound_is_in_time() -> None:
    one = owner()
    one.on_enabling(10.250)
    one.on_number(7, 10.3, 10.31)
    assert one.lateness() == ""


def test_a_telegram_that_came_meanwhile_excuses_it() -> None:
    one = owner()
    one.on_enabling(10.260)
    one.on_number(8, 10.3, 10.31)
    assert one.lateness() == ""
    one.on_enabling(10.561)
    one.on_number(8, 10.6, 10.61)
    assert one.lateness().startswith("251 ms after")


def test_a_time_out_that_became_shorter_holds_from_when_that_is_known() -> None:
    one = owner(timeout_ms=1000)
    assert one.bound_ms == 1050
    one.on_number(7, 10.5, 10.55, timeout_ms=100)
    assert one.bound_ms == 600, "50 ms after it was told"
    assert one.timeout_ms == 100


def test_silence_is_the_reason_where_it_is_as_long_as_the_time_out() -> None:
    one = owner()
    assert one.silence_ms(10.2) == 200
    assert one.silence_ms(10.05) == 50, "it may seem younger by 150 ms"
    assert one.silence_ms(10.04) is None
    assert owner(timeout_ms=0).silence_ms(99.0) is None


def test_where_nobody_tells_its_numbers_nothing_is_known() -> None:
    one = owner()
    one.on_numbers_lost()
    assert (one.bound_ms, one.telegrams(), one.silence_ms(99.0)) == (None, None, None)


@pytest.mark.parametrize(("first", "last", "count"), [(7, 12, 5), (65_534, 3, 5), (7, 7, 0)])
def test_telegrams_are_counted_beyond_the_end_of_their_numbers(first: int, last: int, count: int) -> None:
    one = WatchedOwner("x", 200, 50)
    one.on_number(first, 10.0, 10.01)
    one.on_number(last, 10.5, 10.51)
    assert one.telegrams() == (count, 10.01, 10.5)


def test_only_the_last_seconds_are_counted() -> None:
    one = WatchedOwner("x", 200, 50)
    for second in range(10):
        one.on_number(second, float(second), second + 0.01)
    found = one.telegrams()
    assert found is not None
    assert found[0] == 2
