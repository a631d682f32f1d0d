"""Whether the machine was suspended, by two bounds of a clock that goes on and one that does not."""

from __future__ import annotations

from bridge.master.suspend import SuspendWatch


class Clocks:
    def __init__(self) -> None:
        self.at_least, self.at_most = 100.0, 100.002

    def look(self) -> tuple[float, float]:
        return self.at_least, self.at_most

    def are(self, at_least: float, at_most: float) -> None:
        self.at_least, self.at_most = at_least, at_most


def test_a_machine_that_was_suspended_before_the_start_was_not_since() -> None:
    clocks = Clocks()
    assert SuspendWatch(clocks.look).take() == 0.0


def test_what_is_certain_is_told_once() -> None:
    clocks = Clocks()
    watch = SuspendWatch(clocks.look)
    clocks.are(160.0, 160.003)
    assert watch.take() == 160.0 - 100.002, "the shortest time that it can have been"
    assert watch.take() == 0.0


def test_what_may_be_a_delay_between_two_readings_is_no_suspension() -> None:
    clocks = Clocks()
    watch = SuspendWatch(clocks.look)
    clocks.are(100.011, 105.0)
    assert watch.take() == 0.0, "less than 10 ms are not noticeable"
    clocks.are(100.013, 105.0)
    assert watch.take() > 0.01


def test_a_closer_look_narrows_what_was_known() -> None:
    clocks = Clocks()
    clocks.are(100.0, 105.0)
    watch = SuspendWatch(clocks.look)
    clocks.are(100.0, 100.001)
    assert watch.take() == 0.0
    clocks.are(101.0, 101.001)
    assert watch.take() == 101.0 - 100.001
