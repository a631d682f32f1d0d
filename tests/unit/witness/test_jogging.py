"""An owner that jogs, as the witness sees it: a drive that does not brake is told, one that brakes never."""

from __future__ import annotations

import pytest

from bridge.witness.jogging import Jogs

RAMP_S, JUDGED_S = 5.0, 6.5
FULL = 16_000
JOGS = [(1.0, 0.3), (0.5, 0.3), (3.0, 1.0), (60.0, 5.0)]


class Drive:
    """Brakes and speeds up in ``ramp_s`` from to full speed, ``late_s`` after a word; None: it goes on."""

    def __init__(
        self, ramp_s: float | None, *, tpdo_s: float = 0.05, late_s: float = 0.05, noise: int = 0
    ) -> None:
        self.jogs = Jogs(RAMP_S, JUDGED_S)
        self.ramp_s, self.tpdo_s, self.late_s, self.noise = ramp_s, tpdo_s, late_s, noise
        self.now, self.speed, self.next = 0.0, float(FULL), 0.0
        self.told: list[str] = []

    def phase(self, seconds: float, *, stops: bool) -> None:
        begin = self.now
        self.jogs.on_turn(begin, stops=stops)
        while self.now < begin + seconds:
            self.now = round(self.now + 0.01, 6)
            brakes = stops if self.now >= begin + self.late_s else not stops
            if self.ramp_s is not None:
                change = (-1 if brakes else 1) * FULL * 0.01 / self.ramp_s
                self.speed = min(FULL, max(0.0, self.speed + change))
            if self.now >= self.next:
                self.next = self.now + self.tpdo_s
                self.noise = -self.noise
                found = self.jogs.on_speed(round(self.speed) + self.noise, self.now)
                self.told += [found] if found else []

    def jog(self, run_s: float, stop_s: float, until_s: float) -> None:
        self.phase(2.0, stops=False)
        while self.now < until_s and not self.told:
            self.phase(stop_s, stops=True)
            self.phase(run_s, stops=False)


@pytest.mark.parametrize(("run_s", "stop_s"), JOGS)
@pytest.mark.parametrize("tpdo_s", [0.01, 0.05, 0.25])
def test_a_drive_that_does_not_brake_is_told(run_s: float, stop_s: float, tpdo_s: float) -> None:
    drive = Drive(None, tpdo_s=tpdo_s)
    drive.jog(run_s, stop_s, 200.0)
    (told,) = drive.told
    assert told.startswith("enabled and no slower in ")


def test_it_is_told_again_only_when_it_has_not_braked_for_as_long_again() -> None:
    drive = Drive(None)
    drive.phase(2.0, stops=False)
    drive.phase(4 * JUDGED_S + 0.5, stops=True)
    assert len(drive.told) == 4
    assert all(" of 1 stops" in told for told in drive.told)


@pytest.mark.parametrize("noise", [1, 160])
def test_noise_does_not_hide_it(noise: int) -> None:
    drive = Drive(None, noise=noise)
    drive.jog(1.0, 0.3, 100.0)
    assert drive.told


@pytest.mark.landing(48)
@pytest.mark.parametrize(("run_s", "stop_s"), [*JOGS, (0.1, 0.1), (0.3, 0.3), (0.2, 0.3), (0.3, 0.05)])
@pytest.mark.parametrize("ramp_s", [0.2, 5.0, 10.0])
@pytest.mark.parametrize("tpdo_s", [0.01, 0.25])
def test_a_drive_that_brakes_is_not_told(run_s: float, stop_s: float, ramp_s: float, tpdo_s: float) -> None:
    drive = Drive(ramp_s, tpdo_s=tpdo_s)
    drive.jog(run_s, stop_s, 25.0)
    assert not drive.told


def almost() -> Jogs:
    """A drive that goes on, shortly before it is told."""
    jogs = Jogs(RAMP_S, 1.0)
    jogs.on_turn(0.0, stops=False)
    jogs.on_speed(100, 1.0)
    jogs.on_turn(2.0, stops=True)
    assert not jogs.on_speed(100, 2.9)
    return jogs


def test_it_is_told_when_enough_has_been_seen() -> None:
    assert almost().on_speed(100, 3.0) == "enabled and no slower in 1.0 s of 1 stops"


@pytest.mark.parametrize("speed", [0, -100])
def test_standstill_and_the_other_direction_are_braking(speed: int) -> None:
    jogs = almost()
    jogs.on_speed(speed, 2.95)
    assert not jogs.on_speed(100, 3.2)


def test_a_run_at_another_speed_is_no_braking() -> None:
    jogs = Jogs(RAMP_S, 1.0)
    for begin, speed in ((0.0, 200), (10.0, 100)):
        jogs.on_turn(begin, stops=False)
        jogs.on_speed(speed, begin + 5.0)
        jogs.on_turn(begin + 6.0, stops=True)
    assert jogs.on_speed(100, 17.5)


def test_what_it_says_at_once_tells_nothing() -> None:
    jogs = Jogs(RAMP_S, 1.0)
    for n in range(100):
        jogs.on_turn(n, stops=False)
        jogs.on_speed(100, n + 0.4)
        jogs.on_turn(n + 0.5, stops=True)
        assert not jogs.on_speed(100, n + 0.55)


def test_a_drive_that_stood_in_the_run_is_not_judged() -> None:
    jogs = Jogs(RAMP_S, 1.0)
    jogs.on_turn(0.0, stops=False)
    jogs.on_speed(0, 1.0)
    jogs.on_turn(2.0, stops=True)
    assert not jogs.on_speed(0, 9.0)


def test_a_report_that_it_is_not_enabled_begins_anew() -> None:
    jogs = almost()
    jogs.on_obeyed()
    assert not jogs.on_speed(100, 3.0)


def test_a_speed_that_was_not_seen_before_the_stop_tells_nothing() -> None:
    jogs = Jogs(RAMP_S, 1.0)
    jogs.on_turn(0.0, stops=False)
    jogs.on_turn(2.0, stops=True)
    assert not jogs.on_speed(100, 9.0)
