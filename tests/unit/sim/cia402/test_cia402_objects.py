"""Object dictionary of the simulated CiA 402 drive."""

from __future__ import annotations

import pytest

from bridge.sim.cia402.cia402_drive import Cia402Drive
from bridge.sim.cia402.cia402_settings import INCREMENTS, Cia402Mode

OUT_OF_RANGE, READ_ONLY = "06090030", "06010002"


@pytest.fixture
def drive(bench_of):
    made = bench_of(Cia402Drive(5))
    made.run(0.3)
    return made


def test_it_is_a_servo_drive_with_this_profile(drive):
    assert drive.read(0x1000, 0) == 0x0002_0192
    assert (drive.read(0x608F, 1), drive.read(0x608F, 2)) == (INCREMENTS, 1)


@pytest.mark.parametrize("mode", Cia402Mode)
def test_a_mode_that_there_is_can_be_chosen(drive, mode):
    assert drive.write(0x6060, 0, mode, 1) == "60"
    assert drive.read(0x6061, 0) == mode
    assert drive.write(0x6060, 0, 7, 1) == OUT_OF_RANGE


@pytest.mark.parametrize(
    ("index", "sub", "value", "size", "answer"),
    [
        (0x6083, 0, 1000, 4, "60"),
        (0x6083, 0, 0, 4, OUT_OF_RANGE),  # a ramp that never ends
        (0x605A, 0, 8, 2, "60"),
        (0x605A, 0, 9, 2, OUT_OF_RANGE),
        (0x60C2, 2, 1, 1, OUT_OF_RANGE),
        (0x1016, 1, 128 << 16, 4, OUT_OF_RANGE),
        (0x6041, 0, 0, 2, READ_ONLY),
    ],
)
def test_each_object_has_its_limits(drive, index, sub, value, size, answer):
    assert drive.write(index, sub, value, size) == answer


def test_what_is_saved_outlasts_the_power(drive):
    for value, is_saved in ((1111, False), (2222, True)):
        drive.write(0x6083, 0, value, 4)
        if is_saved:
            drive.write(0x1010, 1, int.from_bytes(b"save", "little"), 4)
        drive.node.power_cycle()
        drive.run(0.5)
        assert (drive.read(0x6083, 0) == value) is is_saved
