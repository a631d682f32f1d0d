"""The axis of the simulated CiA 402 drive."""

from __future__ import annotations

import pytest

from bridge.sim.cia402.cia402_axis import FOLLOWING_ERROR, INIT_S, Cia402Axis
from bridge.sim.cia402.cia402_settings import Cia402Mode, Cia402Settings
from bridge.sim.cia402.cia402_states import Cia402State


class Rig:
    def __init__(self, **settings: object) -> None:
        self.settings = Cia402Settings(**settings)
        self.told: list[int] = []
        self.now = 100.0
        self.axis = Cia402Axis(lambda: self.settings, self.told.append)
        self.axis.power_on(self.now)
        self.run(INIT_S)

    def run(self, seconds: float) -> None:
        end = self.now + seconds
        while self.now < end:
            self.now += 0.01
            self.axis.advance(self.now)

    def words(self, *words: int) -> Cia402State:
        for word in words:
            self.axis.command(word)
            self.axis.obey()
        return self.axis.state


def test_it_is_ready_after_a_while_and_enabled_step_by_step() -> None:
    axis = Rig().axis
    axis.power_on(500.0)
    assert (axis.state, axis.next_deadline()) == (Cia402State.NOT_READY, 500.0 + INIT_S)
    rig = Rig()
    assert rig.axis.state is Cia402State.SWITCH_ON_DISABLED
    assert rig.words(6, 7, 15) is Cia402State.ENABLED
    assert rig.axis.status_word & 0x6F == 0x27


def test_a_control_word_takes_effect_after_its_set_points() -> None:
    rig = Rig(mode=Cia402Mode.PROFILE_VELOCITY)
    rig.words(6, 7)
    rig.axis.command(15)
    assert rig.axis.state is Cia402State.SWITCHED_ON
    assert rig.axis.control_word == 15
    rig.axis.targets.velocity = 5000
    rig.axis.obey()
    rig.run(1.0)
    assert (rig.axis.demand_velocity, rig.axis.actual_rpm) == (5000, 30)


def test_a_fault_is_told_and_acknowledged_by_an_edge() -> None:
    rig = Rig()
    rig.words(6, 7, 15)
    rig.axis.fail(0x2310)
    rig.run(0.1)
    assert (rig.axis.state, rig.axis.error_code) == (Cia402State.FAULT, 0x2310)
    assert rig.words(0x00, 0x80) is Cia402State.SWITCH_ON_DISABLED
    assert (rig.told, rig.axis.error_code) == ([0x2310, 0], 0)


@pytest.mark.parametrize(
    ("option", "state", "is_fault"),
    [
        (0, Cia402State.ENABLED, False),
        (1, Cia402State.FAULT, True),
        (2, Cia402State.SWITCH_ON_DISABLED, False),
        (3, Cia402State.SWITCH_ON_DISABLED, False),
    ],
)
def test_6007h_says_what_becomes_of_it_without_a_master(
    option: int, state: Cia402State, is_fault: bool
) -> None:
    rig = Rig(abort_connection=option)
    rig.words(6, 7, 15)
    assert rig.axis.abort_connection(0x8130) is is_fault
    rig.run(0.5)
    assert rig.axis.state is state


def test_a_target_too_far_away_is_a_following_error() -> None:
    rig = Rig(mode=Cia402Mode.CYCLIC_POSITION, following_window=10, following_ms=10)
    rig.words(6, 7, 15)
    rig.axis.targets.position = 1_000_000_000
    rig.axis.on_target_position()
    rig.run(0.2)
    assert rig.told[:1] == [FOLLOWING_ERROR]


def test_at_rest_it_has_no_deadline_and_turning_it_has_one() -> None:
    rig = Rig(mode=Cia402Mode.PROFILE_VELOCITY)
    rig.words(6, 7, 15)
    assert rig.axis.next_deadline() is None
    rig.axis.targets.velocity = 100_000
    assert rig.axis.next_deadline() is not None
