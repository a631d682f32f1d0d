"""POSICON in the simulated NORD drives: BU 2500 §5.4 (example), §6.5.2 (bit 8), §6.5.4 (positions)."""

from __future__ import annotations

import pytest

from bridge.sim.nord.nord_drive import NordDrive
from bridge.sim.nord.nord_posicon import PositionControl, commission, target
from bridge.sim.nord.nord_states import NordState

REACHED = 0x0100
TURNS_LEFT = 0x1000
FULL_HZ = 0x4000


class Axis:
    """An inverter with the parameters of §5.4, step 5, on a virtual clock with 10 ms steps."""

    def __init__(self, control: PositionControl = PositionControl.AT_SETPOINT) -> None:
        self.drive = NordDrive()
        self.now = 0.0
        self.drive.power_on(0.0)
        commission(self.drive.parameters)
        self.drive.parameters.commission(600, control)
        self.wait(0.3)
        self.send(0x047E)

    def wait(self, seconds: float) -> None:
        for _ in range(round(seconds / 0.01)):
            self.now += 0.01
            self.drive.advance(self.now)

    def send(self, word: int, revolutions: float = 0.0, speed: int = FULL_HZ) -> None:
        position = round(revolutions * 1000) & 0xFFFF_FFFF
        self.drive.on_telegram(word, (speed, position & 0xFFFF, position >> 16))

    @property
    def revolutions(self) -> float:
        words = self.drive.actual_values
        value = words[1] | words[2] << 16
        return ((value ^ 0x8000_0000) - 0x8000_0000) / 1000


@pytest.fixture
def axis() -> Axis:
    return Axis()


def test_it_goes_to_the_position_and_stops_there(axis: Axis):
    axis.send(0x047F, 30.0)
    axis.wait(1.0)
    assert not axis.drive.status_word & REACHED
    assert axis.drive.output_hz > 0
    axis.wait(5.0)
    assert axis.revolutions == 30.0
    assert axis.drive.output_hz == 0
    assert axis.drive.state is NordState.ENABLED, "it holds the position"
    assert axis.drive.status_word & REACHED


def test_the_position_gives_the_direction(axis: Axis):
    """Bit 11 and bit 12 do not matter."""
    axis.send(0x0C7F, -12.345)
    axis.wait(0.5)
    assert axis.drive.status_word & TURNS_LEFT
    axis.wait(5.0)
    assert axis.revolutions == -12.345


def test_the_set_frequency_is_how_fast(axis: Axis):
    """§5.4: "mit einer Drehzahl- und einer Positionsvorgabe"."""
    axis.send(0x047F, 500.0, speed=0x2000)
    axis.wait(3.0)
    assert axis.drive.output_hz == pytest.approx(25.0)
    axis.send(0x047F, 500.0, speed=FULL_HZ)
    axis.wait(2.0)
    assert axis.drive.output_hz == pytest.approx(50.0)


def test_without_speed_it_stays(axis: Axis):
    axis.send(0x047F, 10.0, speed=0)
    axis.wait(1.0)
    assert (axis.revolutions, axis.drive.output_hz) == (0.0, 0.0)
    assert not axis.drive.status_word & REACHED
    assert axis.drive.next_deadline() is None


def test_p600_may_take_the_speed_from_p105():
    axis = Axis(PositionControl.AT_P105)
    axis.send(0x047F, 500.0, speed=0)
    axis.wait(3.0)
    assert axis.drive.output_hz == pytest.approx(50.0)


def test_without_p600_the_position_does_nothing():
    axis = Axis(PositionControl.OFF)
    axis.send(0x047F, 10.0, speed=0x2000)
    axis.wait(3.0)
    assert axis.drive.output_hz == pytest.approx(25.0)


def test_a_stop_ramps_down_and_the_next_enable_goes_on(axis: Axis):
    axis.send(0x047F, 500.0)
    axis.wait(3.0)
    axis.send(0x047E, 500.0)
    axis.wait(3.0)
    assert axis.drive.state is NordState.READY
    assert 20.0 < axis.revolutions < 400.0
    axis.send(0x047F, 100.0)
    axis.wait(10.0)
    assert axis.revolutions == 100.0


def test_words_and_revolutions():
    """§6.6.1: 2800.758 revolutions are 002ABC76h; §6.5.4: the low word alone has 32.767 … −32.768."""
    both = {1: 1, 2: 23, 3: 24}
    assert target((0, 0xBC76, 0x002A), lambda n: both.get(n, 0)) == 2_800_758
    assert target((0, 0x438A, 0xFFD5), lambda n: both.get(n, 0)) == -2_800_758
    low = {2: 23}
    assert target((0, 0x7FFF, 0x1234), lambda n: low.get(n, 0)) == 32_767
    assert target((0, 0x8000), lambda n: low.get(n, 0)) == -32_768
    assert target((0, 0xFFFF, 0x7FFF), lambda n: both.get(n, 0)) == 50_000_000, "the range of the manual"
    assert target((0x2000,), lambda n: 1) is None


def test_a_drive_at_its_position_has_nothing_to_do(axis: Axis):
    axis.send(0x047F, 3.0)
    axis.wait(5.0)
    assert axis.drive.next_deadline() is None
