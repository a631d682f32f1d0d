"""Clocks of the bridge: monotonic seconds, moments by the wall clock, a machine that was suspended."""

from __future__ import annotations

import time

import pytest

from bridge.base import clock


class Clocks:
    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.monotonic_ns, self.wall_ns, self.boot_ns = (
            5_000_000_000,
            1_795_262_400_000_000_000,
            8_000_000_000,
        )
        monkeypatch.setattr(time, "monotonic", lambda: self.monotonic_ns / 1e9)
        monkeypatch.setattr(time, "monotonic_ns", lambda: self.monotonic_ns)
        monkeypatch.setattr(time, "time_ns", lambda: self.wall_ns)
        monkeypatch.setattr(time, "clock_gettime", lambda kind: self.boot_ns / 1e9)


@pytest.fixture
def clocks(monkeypatch: pytest.MonkeyPatch) -> Clocks:
    return Clocks(monkeypatch)


def test_now_is_the_monotonic_clock(clocks: Clocks) -> None:
    assert clock.now() == 5.0


def test_a_monotonic_time_has_its_moment_by_the_wall_clock(clocks: Clocks) -> None:
    assert clock.epoch_ns(5.0) == clocks.wall_ns
    assert clock.epoch_ns(4.5) == clocks.wall_ns - 500_000_000
    clocks.wall_ns += 3_600_000_000_000
    assert clock.epoch_ns(5.0) == clocks.wall_ns, "as it is set now"


def test_what_the_other_clock_has_more_is_how_long_it_was_suspended(clocks: Clocks) -> None:
    assert clock.suspended_s() == (3.0, 3.0)
    clocks.boot_ns = clocks.monotonic_ns
    assert clock.suspended_s() == (0.0, 0.0)


def test_a_delay_between_the_readings_lies_between_the_bounds(monkeypatch: pytest.MonkeyPatch) -> None:
    times = iter((5.0, 5.4))
    monkeypatch.setattr(time, "monotonic", lambda: next(times))
    monkeypatch.setattr(time, "clock_gettime", lambda kind: 5.2)
    least, most = clock.suspended_s()
    assert least <= 0.0 <= most
    assert most - least == pytest.approx(0.4)
