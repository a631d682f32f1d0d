"""Device control and motor of the simulated 8400 motec."""

from __future__ import annotations

import pytest

from bridge.sim.lenze.lenze_drive import INIT_S, DeviceState, LenzeDrive, Reaction
from bridge.sim.lenze.lenze_settings import LenzeCodes

RUN, STOPPED, QUICK = 0x0009, 0x0001, 0x000D


class Rig:
    def __init__(self) -> None:
        self.codes = LenzeCodes(5, ramp_ms=[1000, 2000, 500])
        self.drive = LenzeDrive(lambda: self.codes)
        self.now = 10.0
        self.drive.power_on(self.now)
        self.run(INIT_S + 0.01)

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds * 100)):
            self.now += 0.01
            self.drive.advance(self.now)


def test_it_follows_its_words_by_its_ramps() -> None:
    rig = Rig()
    assert rig.drive.state is DeviceState.READY_TO_SWITCH_ON
    rig.drive.on_words([STOPPED, 0x4000])
    assert rig.drive.state is DeviceState.SWITCHED_ON
    rig.drive.on_words([RUN, 0x4000])
    rig.run(0.5)
    assert rig.drive.speed_rpm == pytest.approx(750)
    rig.run(0.6)
    assert (rig.drive.speed_rpm, rig.drive.speed_word) == (1500, 0x4000)
    assert rig.drive.status_word & 0x0018 == 0x0018
    assert rig.drive.next_deadline() is None
    rig.drive.on_words([QUICK, 0x4000])
    rig.run(0.25)
    assert rig.drive.speed_rpm == pytest.approx(750)
    rig.drive.on_words([RUN, 0x7FFF])
    rig.run(5.0)
    assert rig.drive.speed_rpm == 1500, "no more than C00011"


def test_a_fault_waits_for_the_acknowledge_and_a_trouble_for_its_cause() -> None:
    rig = Rig()
    rig.drive.on_words([RUN, 0])
    rig.drive.error(7, Reaction.FAULT)
    rig.drive.on_words([RUN | 0x80, 0])
    assert rig.drive.state is DeviceState.FAULT, "the cause lasts"
    rig.drive.cause_gone(7)
    rig.drive.on_words([RUN, 0])
    rig.drive.on_words([RUN | 0x80, 0])
    assert rig.drive.state is DeviceState.OPERATION_ENABLED
    rig.drive.error(9, Reaction.TROUBLE, lasting=False)
    assert (rig.drive.state, rig.drive.status_word & 0x2000) == (DeviceState.TROUBLE, 0x2000)
    rig.drive.cause_gone(9)
    assert rig.drive.state is DeviceState.OPERATION_ENABLED


def test_a_warning_is_shown_and_stops_nothing() -> None:
    rig = Rig()
    rig.drive.on_words([RUN, 0])
    rig.drive.error(3, Reaction.WARNING_LOCKED)
    assert rig.drive.state is DeviceState.OPERATION_ENABLED
    assert (rig.drive.status_word & 0x1000, rig.drive.error_number) == (0x1000, 3)
    rig.drive.error(4, Reaction.FAULT)
    assert rig.drive.errors == [4, 3], "the worst first"
    rig.drive.error(5, Reaction.NONE)
    assert 5 not in rig.drive.errors
