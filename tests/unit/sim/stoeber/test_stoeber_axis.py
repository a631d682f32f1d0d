"""One axis of a STÖBER inverter: states and ramp (ID 441684.06 §11.1)."""

from __future__ import annotations

import pytest

from bridge.sim.stoeber.stoeber_axis import SELF_TEST_S, AxisParameters, AxisState, StoeberAxis

ENABLE, QUICK = 0x01, 0x04


class Rig:
    def __init__(self) -> None:
        self.is_free = True
        self.parameters = AxisParameters(accelerate_s=1.0, decelerate_s=2.0, quick_stop_s=0.5)
        self.axis = StoeberAxis(2, lambda: self.parameters, lambda: self.is_free)
        self.now = 10.0
        self.axis.power_on(self.now)
        self.run(SELF_TEST_S + 0.01)

    def run(self, seconds: float) -> AxisState:
        for _ in range(round(seconds * 100)):
            self.now += 0.01
            self.axis.advance(self.now)
        return self.axis.state

    def control(self, byte: int, setpoint: int = 1000, seconds: float = 0.1) -> AxisState:
        self.axis.control, self.axis.setpoint = byte, setpoint
        self.axis.settle()
        return self.run(seconds)


def test_it_is_enabled_by_an_edge_and_follows_its_setpoint() -> None:
    rig = Rig()
    assert rig.axis.state is AxisState.READY
    assert rig.control(ENABLE, seconds=0.52) is AxisState.ENABLED
    assert rig.axis.speed_rpm == pytest.approx(1500, abs=60)
    rig.run(1.0)
    assert (rig.axis.speed_rpm, rig.axis.next_deadline()) == (3000, None)
    assert rig.axis.status_byte == 0x01 | 1 << 3 | 0x20
    rig.axis.setpoint = 9999
    rig.run(1.0)
    assert rig.axis.speed_rpm == 3000, "no more than C01"


def test_a_quick_stop_ends_inhibited_and_nothing_starts_by_itself() -> None:
    rig = Rig()
    rig.control(ENABLE, seconds=2.0)
    assert rig.control(ENABLE | QUICK, seconds=0.25) is AxisState.QUICK_STOP
    assert rig.axis.speed_rpm == pytest.approx(1500, abs=60)
    assert rig.run(0.5) is AxisState.INHIBITED
    assert rig.control(ENABLE) is AxisState.INHIBITED
    assert rig.control(0) is AxisState.READY


def test_while_another_axis_is_on_it_does_not_switch_on() -> None:
    rig = Rig()
    rig.is_free = False
    assert rig.control(ENABLE) is AxisState.INHIBITED
    assert not rig.axis.blocks_others


@pytest.mark.parametrize(("can_brake", "after"), [(True, 0.6), (False, 1.1)])
def test_a_fault_brakes_or_coasts_and_is_acknowledged_at_the_end(can_brake: bool, after: float) -> None:
    rig = Rig()
    rig.control(ENABLE, seconds=2.0)
    rig.axis.trip(brakes=can_brake)
    assert not rig.axis.acknowledge()
    assert rig.run(after) is AxisState.FAULT
    assert rig.axis.speed_rpm == 0
    assert rig.axis.acknowledge()
    assert rig.axis.state is AxisState.INHIBITED
