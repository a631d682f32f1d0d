"""Delays of the answers to failed logins; no server, no clock."""

from __future__ import annotations

from bridge.northbound.opcua.failed_logins import FailedLogins


def test_the_delay_grows_with_each_failure_up_to_its_limit() -> None:
    failed = FailedLogins()
    delays = [failed.delay_s("10.0.0.1", float(now)) for now in range(9)]
    assert delays == [0.0, 0.0, 0.0, 0.25, 0.5, 1.0, 2.0, 2.0, 2.0]


def test_another_address_is_not_held_up() -> None:
    failed = FailedLogins()
    for _ in range(9):
        failed.delay_s("10.0.0.1", 0.0)
    assert failed.delay_s("10.0.0.2", 0.0) == 0.0


def test_failures_are_forgotten_after_a_minute_without_one() -> None:
    failed = FailedLogins()
    for now in (0.0, 50.0, 100.0):
        assert failed.delay_s("10.0.0.1", now) == 0.0
    assert failed.delay_s("10.0.0.1", 150.0) == 0.25
    assert failed.delay_s("10.0.0.1", 211.0) == 0.0


def test_of_too_many_addresses_the_one_that_failed_first_is_forgotten() -> None:
    failed = FailedLogins()
    for _ in range(3):
        failed.delay_s("10.0.0.1", 0.0)
    for number in range(1_000):
        failed.delay_s(f"10.1.{number // 250}.{number % 250}", 1.0)
    assert failed.delay_s("10.0.0.1", 2.0) == 0.0
