"""Limit of password guesses: pauses by user and by address, and the end of counting."""

from __future__ import annotations

import pytest

from bridge.northbound.page.throttle import FORGOTTEN_S, FREE, FREE_OF_ADDRESS, LONGEST_PAUSE_S, Throttle

HERE = "1.2.3.4"


def fail(throttle: Throttle, user: str, times: int, now: float = 0.0) -> int:
    """Number of ``times`` logins that were checked."""
    return sum(throttle.begin(HERE, user, now) == 0 for _ in range(times))


def test_wrong_passwords_cost_more_and_more() -> None:
    throttle, now = Throttle(), 0.0
    assert fail(throttle, "ann", FREE) == FREE
    pauses: list[float] = []
    for _ in range(12):
        assert throttle.begin(HERE, "ann", now) == 0
        pauses.append(throttle.begin(HERE, "ann", now))
        now += pauses[-1]
    assert pauses == [min(2.0**n, LONGEST_PAUSE_S) for n in range(12)]
    assert throttle.begin("1.2.3.5", "ann", now) == 0, "others do not pay for it"
    throttle.succeeded(HERE, "ann")
    assert fail(throttle, "ann", FREE, now) == FREE


def test_logins_that_are_under_way_at_once_are_counted_before_they_fail() -> None:
    assert fail(Throttle(), "ann", 100) == FREE + 1


def test_a_login_of_ones_own_does_not_help_to_guess_that_of_another() -> None:
    """An observer guesses the engineer's password, with a login of its own after every few."""
    throttle, guesses = Throttle(), 0
    for second in range(60):
        for _ in range(4):
            guesses += throttle.begin(HERE, "engineer", float(second)) == 0
        throttle.begin(HERE, "observer", float(second))
        throttle.succeeded(HERE, "observer")
    assert guesses <= FREE + 7, "the pauses are 1, 2, 4 … seconds"


def test_guessing_for_many_users_counts_for_the_address() -> None:
    throttle = Throttle()
    looked_at = sum(throttle.begin(HERE, f"user {n}", 0.0) == 0 for n in range(1000))
    assert looked_at == FREE_OF_ADDRESS + 1


def test_people_behind_one_address_who_mistype_do_not_add_up() -> None:
    throttle = Throttle()
    for n in range(100):
        assert fail(throttle, f"user {n}", 4) == 4
        throttle.succeeded(HERE, f"user {n}")


def test_what_was_not_checked_does_not_count() -> None:
    throttle = Throttle()
    for _ in range(100):
        assert throttle.begin(HERE, "ann", 0.0) == 0
        throttle.withdrawn(HERE, "ann")


def test_wrong_passwords_are_forgotten_after_an_hour() -> None:
    throttle = Throttle()
    fail(throttle, "ann", FREE)
    assert fail(throttle, "ann", FREE, FORGOTTEN_S + 1) == FREE


@pytest.mark.landing
def test_a_flood_of_addresses_takes_no_more_than_its_room() -> None:
    throttle = Throttle()
    for number in range(10_000):
        throttle.begin(f"address {number}", "ann", float(number))
    assert len(throttle) <= 4096
