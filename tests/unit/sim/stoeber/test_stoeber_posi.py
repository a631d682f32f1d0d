"""The simulated STÖBER 5000 with command positioning (ID 441684.06 §10; bits as in stoeber/5000-posi)."""

from __future__ import annotations

import pytest

from bridge.sim.stoeber.stoeber_5000 import Stoeber5000
from bridge.sim.stoeber.stoeber_axis import AxisState
from bridge.sim.stoeber.stoeber_posi import (
    ABORTED,
    HOME_AT,
    LIMIT_AT,
    NEGATIVE_LIMIT,
    POSITIVE_LIMIT,
    REACHED,
    REFERENCED,
    START,
    TAKEN,
    PosiCommand,
    PositioningAxis,
)


@pytest.fixture
def drive(bench_of):
    """Node 5, operational and enabled."""
    drive = bench_of(Stoeber5000(5, positions=True))
    drive.run(0.3)
    drive.nmt(1)
    put(drive, 0)
    put(drive, 1)
    drive.run(0.1)
    assert axis_of(drive).state is AxisState.ENABLED
    return drive


def axis_of(drive) -> PositioningAxis:
    (axis,) = drive.node.axes
    assert isinstance(axis, PositioningAxis)
    return axis


def put(drive, control: int, command: int = 0, target: int = 0, speed: int = 9000) -> bytes:
    """RPDO1, eight bytes as in §10; the TPDO1 that answers it."""
    data = bytes([control, command]) + target.to_bytes(4, "little", signed=True) + speed.to_bytes(2, "little")
    return drive.put(0x205, data)[0].data


def go(drive, command: PosiCommand, target: int = 0, speed: int = 9000, seconds: float = 30.0) -> None:
    put(drive, 1, command, target, speed)
    put(drive, 1, command | START, target, speed)
    drive.run(seconds)


def test_a_command_is_taken_carried_out_and_answered(drive):
    put(drive, 1, PosiCommand.ABSOLUTE, 3600)
    assert axis_of(drive).posi_status == 0, "the start bit has not risen"
    assert put(drive, 1, PosiCommand.ABSOLUTE | START, 3600)[:2].hex() == "0401", "E48: enabled; taken"
    drive.run(0.2)
    assert axis_of(drive).motor.velocity > 0
    drive.run(2.0)
    answer = put(drive, 1, PosiCommand.ABSOLUTE, 3600)
    assert answer.hex(" ") == "04 02 10 0e 00 00 00 00", "reached, at 3600, standing still"


def test_it_goes_as_fast_as_it_is_told_and_no_faster_than_i10(drive):
    go(drive, PosiCommand.ABSOLUTE, 50_000, speed=5000, seconds=1.0)
    assert axis_of(drive).motor.velocity == 5000
    assert axis_of(drive).speed_rpm == pytest.approx(5000 / 360 * 60)
    put(drive, 1, PosiCommand.ABSOLUTE, 50_000, speed=60_000)
    drive.run(0.6)
    assert axis_of(drive).motor.velocity == 18_000


def test_the_ramps_come_by_the_second_pdo(drive):
    drive.put(0x305, "E8 03 D0 07")
    go(drive, PosiCommand.ABSOLUTE, 50_000, speed=5000, seconds=1.0)
    assert axis_of(drive).motor.velocity == pytest.approx(1000, abs=20), "1000 inc/s²"


def test_relative_ways_add_up(drive):
    go(drive, PosiCommand.RELATIVE, 100)
    go(drive, PosiCommand.RELATIVE, -300)
    assert axis_of(drive).motor.position == -200


def test_the_same_words_again_do_nothing(drive):
    go(drive, PosiCommand.RELATIVE, 100)
    put(drive, 1, PosiCommand.RELATIVE | START, 100)
    drive.run(3.0)
    assert axis_of(drive).motor.position == 100


def test_without_speed_it_waits(drive):
    go(drive, PosiCommand.ABSOLUTE, 100, speed=0)
    assert axis_of(drive).motor.position == 0
    put(drive, 1, PosiCommand.ABSOLUTE | START, 100)
    drive.run(3.0)
    assert axis_of(drive).motor.position == 100


def test_homing_finds_the_switch_and_counts_from_there(drive):
    go(drive, PosiCommand.ABSOLUTE, 500)
    go(drive, PosiCommand.HOMING)
    axis = axis_of(drive)
    assert axis.posi_status == TAKEN | REACHED | REFERENCED
    assert (axis.motor.position, axis.place) == (0, HOME_AT)
    go(drive, PosiCommand.ABSOLUTE, 700)
    assert axis.place == HOME_AT + 700


def test_homing_without_a_switch_ends_at_the_limit(drive):
    axis_of(drive).has_home_switch = False
    go(drive, PosiCommand.HOMING, speed=18_000)
    assert axis_of(drive).posi_status == TAKEN | ABORTED | NEGATIVE_LIMIT


def test_a_limit_switch_ends_the_command_and_lets_the_axis_back(drive):
    go(drive, PosiCommand.ABSOLUTE, 150_000, speed=18_000)
    axis = axis_of(drive)
    assert axis.posi_status == TAKEN | ABORTED | POSITIVE_LIMIT
    assert LIMIT_AT <= axis.motor.position < LIMIT_AT + 10_000, "it needs its ramp"
    go(drive, PosiCommand.ABSOLUTE, 150_000)
    assert axis.posi_status & ABORTED
    go(drive, PosiCommand.ABSOLUTE, 90_000)
    assert (axis.motor.position, axis.posi_status) == (90_000, TAKEN | REACHED)


@pytest.mark.parametrize("control", [0, 1 | 4])
def test_a_stop_ends_the_command(drive, control):
    go(drive, PosiCommand.ABSOLUTE, 50_000, seconds=1.0)
    put(drive, control, PosiCommand.ABSOLUTE | START, 50_000)
    drive.run(3.0)
    where = axis_of(drive).motor.position
    assert 1000 < where < 20_000
    put(drive, 0, PosiCommand.ABSOLUTE | START, 50_000)
    put(drive, 1, PosiCommand.ABSOLUTE | START, 50_000)
    drive.run(3.0)
    assert axis_of(drive).state is AxisState.ENABLED
    assert axis_of(drive).motor.position == where, "the start bit has not risen anew"


def test_an_unknown_command_is_not_taken(drive):
    put(drive, 1, 9 | START, 100)
    assert not axis_of(drive).posi_status & TAKEN


def test_at_rest_it_has_nothing_to_do(drive):
    go(drive, PosiCommand.ABSOLUTE, 500)
    assert drive.node.device.next_deadline() is None


def test_it_has_one_axis():
    with pytest.raises(ValueError, match="one axis"):
        Stoeber5000(5, axes=2, positions=True)
