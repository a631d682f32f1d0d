"""One NORD inverter: state machine, words and ramps (BU 2500 §6.5.1 to §6.5.4, §6.8)."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.sim.nord.nord_drive import NordDrive
from bridge.sim.nord.nord_parameters import PARAMETERS
from bridge.sim.nord.nord_states import NordState


class Driver:
    """Drives one inverter directly, on a virtual clock with 1 ms steps."""

    def __init__(self) -> None:
        self.drive = NordDrive()
        self.now = 0.0
        self.drive.power_on(0.0)

    def wait(self, seconds: float) -> Driver:
        end = self.now + seconds
        while self.now < end:
            self.now = min(end, self.now + 0.001)
            self.drive.advance(self.now)
        return self

    def send(self, low_byte: int, *setpoints: int, high: int = 0x04) -> Driver:
        self.drive.on_telegram(high << 8 | low_byte, setpoints)
        return self

    def to(self, state: NordState) -> Driver:
        """The usual way into a state."""
        if state is NordState.NOT_READY:
            return self
        self.wait(0.3)
        words = {
            NordState.SWITCH_ON_INHIBITED: (),
            NordState.READY: (0x7E,),
            NordState.SWITCHED_ON: (0x7E, 0x77),
            NordState.ENABLED: (0x7E, 0x7F),
            NordState.QUICK_STOP: (0x7E, 0x7F),
            NordState.FAULT_REACTION: (0x7E,),
            NordState.FAULT: (0x7E,),
        }
        for word in words[state]:
            self.send(word, 0x2000)
        if state in (NordState.ENABLED, NordState.QUICK_STOP):
            self.wait(0.5)
        if state is NordState.QUICK_STOP:
            self.drive.parameters.commission(426, 2.0)
            self.send(0x7B)
        if state in (NordState.FAULT_REACTION, NordState.FAULT):
            self.drive.trip(30)
        if state is NordState.FAULT:
            self.wait(0.1)
        assert self.drive.state is state
        return self


@pytest.fixture
def driver() -> Driver:
    return Driver()


# §6.8


def test_the_setpoint_example_of_the_manual(make_bench):
    """The table of §6.8 to the letter, through PDOs; P105 = 50 Hz, P543 = P546 = 1."""
    bench = make_bench(p105_hz=50.0)
    bench.nmt(1)
    assert bench.answer() == (0x0000, 0x0000)
    bench.run(1.0)
    assert (bench.answer()[0] & 0xFF, bench.answer()[1]) == (0x40, 0x0000)
    for control, setpoint, status, actual, hertz in (
        (0x047E, 0x0000, 0x31, 0x0000, 0.0),
        (0x047F, 0x2000, 0x37, 0x2000, 25.0),
        (0x047E, 0x2000, 0x31, 0x0000, 0.0),
        (0x047F, 0x1000, 0x37, 0x1000, 12.5),
    ):
        bench.command(control, setpoint)
        bench.run(3.0)
        assert (bench.answer()[0] & 0xFF, bench.answer()[1]) == (status, actual)
        assert bench.node.drives[0].output_hz == pytest.approx(hertz)


def test_the_typical_answer_to_047e_is_0b31(driver):
    driver.wait(0.3).send(0x7E)
    assert driver.drive.status_word == 0x0B31


# §6.5.3: transitions


@pytest.mark.parametrize(
    ("number", "source", "words", "target"),
    [
        (2, NordState.SWITCH_ON_INHIBITED, [0x06], NordState.READY),
        (3, NordState.READY, [0x07], NordState.SWITCHED_ON),
        (4, NordState.SWITCHED_ON, [0x7F], NordState.ENABLED),
        (5, NordState.ENABLED, [0x77], NordState.SWITCHED_ON),
        (6, NordState.SWITCHED_ON, [0x06], NordState.READY),
        (7, NordState.READY, [0x04], NordState.SWITCH_ON_INHIBITED),
        (7, NordState.READY, [0x02], NordState.SWITCH_ON_INHIBITED),
        (8, NordState.ENABLED, [0x7E], NordState.READY),
        (9, NordState.ENABLED, [0x7D], NordState.SWITCH_ON_INHIBITED),
        (10, NordState.SWITCHED_ON, [0x75], NordState.SWITCH_ON_INHIBITED),
        (10, NordState.SWITCHED_ON, [0x73], NordState.SWITCH_ON_INHIBITED),
        (11, NordState.ENABLED, [0x7B], NordState.QUICK_STOP),
        (12, NordState.QUICK_STOP, [0x7D], NordState.SWITCH_ON_INHIBITED),
        (15, NordState.FAULT, [0x00, 0x80], NordState.SWITCH_ON_INHIBITED),
    ],
)
def test_commanded_transitions(driver, number, source, words, target):
    driver.to(source)
    for word in words:
        driver.send(word)
    if number == 8:
        assert driver.drive.state is NordState.ENABLED, "first the ramp"
        driver.wait(3.0)
    assert driver.drive.state is target


def test_transition_1_comes_with_the_charging_relay(driver):
    driver.wait(0.19)
    assert (driver.drive.state, driver.drive.status_word) == (NordState.NOT_READY, 0)
    driver.wait(0.02)
    assert driver.drive.state is NordState.SWITCH_ON_INHIBITED


@pytest.mark.parametrize(
    "state", [s for s in NordState if s not in (NordState.FAULT_REACTION, NordState.FAULT)]
)
def test_transitions_13_and_14_a_fault_comes_from_every_state(driver, state):
    driver.to(state)
    driver.drive.trip(30)
    assert driver.drive.state is NordState.FAULT_REACTION
    assert driver.drive.status_word & 0x4F == 0x0F
    driver.wait(0.1)
    assert driver.drive.state is NordState.FAULT
    assert driver.drive.status_word & 0x4F == 0x08
    assert (driver.drive.fault_tenths, driver.drive.last_faults[0]) == (30, 30)


@pytest.mark.parametrize(
    ("state", "bits"),
    [
        (NordState.SWITCH_ON_INHIBITED, 0x40),
        (NordState.READY, 0x31),
        (NordState.SWITCHED_ON, 0x33),
        (NordState.ENABLED, 0x37),
        (NordState.QUICK_STOP, 0x17),
    ],
)
def test_the_coded_states(driver, state, bits):
    assert driver.to(state).drive.status_word & 0x7F == bits


def test_switch_on_inhibited_is_left_only_by_shut_down(driver):
    driver.to(NordState.SWITCH_ON_INHIBITED)
    for low in range(256):
        if low & 7 != 6:
            driver.send(low)
            assert driver.drive.state is NordState.SWITCH_ON_INHIBITED, f"{low:02X}h"


def test_disable_voltage_goes_before_quick_stop(driver):
    driver.to(NordState.ENABLED).send(0x79)
    assert driver.drive.state is NordState.SWITCH_ON_INHIBITED


def test_a_commanded_stop_can_be_withdrawn_on_the_ramp(driver):
    driver.to(NordState.ENABLED).send(0x7E, 0x2000).wait(0.2).send(0x7F, 0x2000).wait(3.0)
    assert (driver.drive.state, driver.drive.output_hz) == (NordState.ENABLED, 25.0)


def test_a_quick_stop_cannot_be_withdrawn_and_ends_in_switch_on_inhibited(driver):
    driver.to(NordState.QUICK_STOP).send(0x7F, 0x2000)
    assert driver.drive.status_word & 0x7F == 0x17
    driver.wait(3.0)
    assert driver.drive.state is NordState.SWITCH_ON_INHIBITED


def test_a_drive_in_quick_stop_goes_on_to_ready_if_that_is_commanded_meanwhile(driver):
    driver.to(NordState.QUICK_STOP).send(0x7E).wait(3.0)
    assert driver.drive.state is NordState.READY


# §6.5.1: single bits


@given(low=st.integers(0, 255), high=st.integers(0, 255).filter(lambda high: not high & 0x04))
def test_without_bit_10_a_telegram_is_void(low, high):
    driver = Driver().to(NordState.ENABLED)
    before = (driver.drive.state, driver.drive.control_word, driver.drive.setpoints)
    driver.send(low, 0x1234, high=high)
    assert (driver.drive.state, driver.drive.control_word, driver.drive.setpoints) == before
    assert driver.drive.telegrams_ignored == 1


def test_only_the_edge_of_bit_7_acknowledges(driver):
    driver.to(NordState.ENABLED).send(0xFF, 0x2000)
    driver.drive.trip(30)
    driver.wait(0.1).send(0xFF)
    assert driver.drive.state is NordState.FAULT, "no edge: the bit was set before"
    driver.send(0x7F).send(0xFF)
    assert driver.drive.state is NordState.SWITCH_ON_INHIBITED
    assert driver.drive.fault_tenths == 0
    assert driver.drive.last_faults[0] == 30


def test_a_fault_whose_cause_lasts_is_not_acknowledged(driver):
    driver.to(NordState.READY)
    driver.drive.trip(30, lasting=True)
    driver.wait(0.1).send(0x00).send(0x80)
    assert driver.drive.state is NordState.FAULT
    driver.drive.cause_gone()
    driver.send(0x00).send(0x80)
    assert driver.drive.state is NordState.SWITCH_ON_INHIBITED


@pytest.mark.landing(8)
@pytest.mark.parametrize(
    ("direction", "setpoint", "hertz"),
    [
        (0x0000, 0x2000, 25.0),
        (0x0800, 0x2000, 25.0),
        (0x1000, 0x2000, -25.0),
        (0x1800, 0x2000, -25.0),
        (0x0800, 0xE000, -25.0),
        (0x1000, 0xE000, 25.0),
        (0x0000, 0x7FFF, 50.0),
        (0x0000, 0x8000, -50.0),
    ],
)
def test_direction_and_clipping_at_p105(driver, direction, setpoint, hertz):
    driver.to(NordState.READY).send(0x7F, setpoint, high=0x04 | direction >> 8).wait(3.0)
    assert driver.drive.output_hz == pytest.approx(hertz)
    assert driver.drive.status_word & 0x1800 == (0x0800 if hertz > 0 else 0x1000)
    assert driver.drive.actual_values[0] == round(hertz / 50 * 0x4000) & 0xFFFF


def test_the_parameter_set_is_chosen_and_echoed_by_bits_14_and_15(driver):
    driver.drive.parameters.write(_parameter(105), 1, 3, 250)
    driver.to(NordState.READY).send(0x7F, 0x4000, high=0x84).wait(3.0)
    assert driver.drive.status_word >> 14 == 2
    assert driver.drive.output_hz == 25.0


def test_bit_4_sets_the_ramp_generator_to_0_and_keeps_the_state(driver):
    driver.to(NordState.ENABLED).send(0x6F, 0x2000).wait(0.001)
    assert (driver.drive.state, driver.drive.output_hz) == (NordState.ENABLED, 0.0)


def test_bit_5_holds_the_frequency(driver):
    driver.to(NordState.ENABLED).send(0x5F, 0x4000)
    held = driver.drive.output_hz
    driver.wait(1.0)
    assert driver.drive.output_hz == held
    assert driver.drive.next_deadline() is None


def test_bit_6_takes_the_setpoint_away(driver):
    driver.to(NordState.ENABLED).send(0x3F, 0x2000).wait(0.1)
    assert 0 < driver.drive.output_hz < 25
    driver.wait(3.0)
    assert (driver.drive.state, driver.drive.output_hz) == (NordState.ENABLED, 0.0)


# Ramps and values


def test_ramps_take_p102_p103_and_p426(driver):
    driver.drive.parameters.commission(102, 1.0)
    driver.drive.parameters.commission(103, 4.0)
    driver.drive.parameters.commission(426, 0.5)
    driver.to(NordState.READY).send(0x7F, 0x4000).wait(0.5)
    assert driver.drive.output_hz == pytest.approx(25.0)
    assert not driver.drive.status_word & 0x0100, "setpoint not reached yet"
    driver.wait(0.51)
    assert driver.drive.output_hz == 50.0
    assert driver.drive.status_word & 0x0100
    driver.send(0x7E, 0x4000).wait(2.0)
    assert driver.drive.output_hz == pytest.approx(25.0)
    driver.send(0x7B).wait(0.1)
    assert driver.drive.output_hz == pytest.approx(15.0)


def test_disable_voltage_takes_the_output_away_and_the_motor_runs_down(driver):
    driver.to(NordState.READY).send(0x7F, 0x4000).wait(3.0)
    assert driver.drive.motor_hz(driver.now) == 50.0
    driver.send(0x7D)
    assert (driver.drive.output_hz, driver.drive.actual_values[:2]) == (0.0, (0, 0))
    assert driver.drive.motor_hz(driver.now + 0.5) == pytest.approx(25.0)
    assert driver.drive.motor_hz(driver.now + 1.5) == 0.0


def test_current_is_scaled_by_p112_and_is_0_without_voltage(driver):
    driver.to(NordState.ENABLED).wait(3.0)
    current_word = driver.drive.actual_values[1]
    assert 10.0 * current_word / 0x4000 == pytest.approx(driver.drive.current_a, abs=0.001)
    assert 2.0 < driver.drive.current_a < 10.0
    driver.send(0x77)
    assert driver.drive.actual_values[1] == 0


def test_what_an_actual_value_means_is_set_by_p543(driver):
    driver.drive.digital_inputs = 5
    assert driver.drive.actual_values == (0, 0, 5, 0, 0)
    driver.drive.parameters.write(_parameter(543), 3, 1, 9)
    driver.drive.trip(103)
    assert driver.drive.actual_values[2] == 103


def test_under_local_control_the_bus_commands_nothing(driver):
    driver.drive.parameters.commission(509, 0)
    driver.wait(0.3).send(0x7E)
    assert driver.drive.state is NordState.SWITCH_ON_INHIBITED
    assert not driver.drive.status_word & 0x0200


def _parameter(number: int):
    return next(parameter for parameter in PARAMETERS if parameter.number == number)
