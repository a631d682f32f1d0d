"""The throttle of logins: pauses that double, by user and by address, and what a right password forgets."""

from __future__ import annotations

import pytest

from bridge.northbound.page.throttle import (
    FORGOTTEN_S,
    FREE,
    FREE_OF_ADDRESS,
    LONGEST_PAUSE_S,
    Throttle,
)


def guesses(throttle: Throttle, times: int, user: str = "ann", now: float = 0.0, address: str = "a") -> float:
    """So many wrong passwords, each as soon as it is looked at; when the last was."""
    for _ in range(times):
        while (pause_s := throttle.begin(address, user, now)) > 0:
            now += pause_s
    return now


def test_a_few_cost_nothing_and_then_each_doubles_the_pause() -> None:
    throttle = Throttle()
    assert guesses(throttle, FREE) == 0.0
    now, pauses = 0.0, list[float]()
    for _ in range(5):
        before = now
        now = guesses(throttle, 1, now=now)
        pauses.append(now - before)
    assert pauses == [0.0, 1.0, 2.0, 4.0, 8.0]


def test_a_pause_has_an_end_and_is_never_longer_than_five_minutes() -> None:
    throttle = Throttle()
    now = guesses(throttle, 30)
    assert throttle.begin("a", "ann", now) == pytest.approx(LONGEST_PAUSE_S)
    assert throttle.begin("a", "ann", now + 299.0) == pytest.approx(1.0)
    assert throttle.begin("a", "ann", now + LONGEST_PAUSE_S) == 0.0


def test_other_users_and_other_addresses_are_not_held_up() -> None:
    throttle = Throttle()
    now = guesses(throttle, FREE + 3)
    assert throttle.begin("a", "ann", now) > 0
    assert throttle.begin("a", "bob", now) == 0.0
    assert throttle.begin("b", "ann", now) == 0.0


def test_an_address_that_tries_many_users_is_held_up_for_all() -> None:
    throttle = Throttle()
    for number in range(FREE_OF_ADDRESS + 1):
        assert throttle.begin("a", f"user {number}", 0.0) == 0.0
    assert throttle.begin("a", "another", 0.0) == 1.0


def test_a_right_password_forgets_its_own_user_and_nobody_elses() -> None:
    throttle = Throttle()
    now = guesses(throttle, FREE + 3)
    now = guesses(throttle, FREE + 3, "bob", now)
    throttle.succeeded("a", "ann")
    assert throttle.begin("a", "ann", now) == 0.0
    assert throttle.begin("a", "bob", now) > 0
    throttle.succeeded("a", "nobody has tried this one")


def test_what_is_not_checked_after_all_does_not_count() -> None:
    throttle = Throttle()
    for _ in range(50):
        assert throttle.begin("a", "ann", 0.0) == 0.0
        throttle.withdrawn("a", "ann")
    throttle.withdrawn("b", "unknown")


def test_after_an_hour_all_begins_anew() -> None:
    throttle = Throttle()
    now = guesses(throttle, FREE + 9) + FORGOTTEN_S + 1
    assert guesses(throttle, FREE, now=now) == now


def test_there_is_an_end_to_what_is_remembered() -> None:
    throttle = Throttle()
    for number in range(5000):
        throttle.begin(f"address {number}", "x" * 10_000, float(number))
    assert len(throttle) == 4096
