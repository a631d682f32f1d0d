"""The inverter behind CAN 5000: axes one at a time, and its event."""

from __future__ import annotations

from bridge.sim.core.store import Store
from bridge.sim.stoeber.stoeber_axis import AxisState
from bridge.sim.stoeber.stoeber_device import StoeberDevice
from bridge.sim.stoeber.stoeber_events import NO_EVENT
from bridge.sim.stoeber.stoeber_settings import factory_settings


class Rig:
    def __init__(self, axes: int = 2) -> None:
        self.told: list[tuple[int, int]] = []
        store = Store(lambda: factory_settings(axes))
        self.device = StoeberDevice(axes, store, lambda *what: self.told.append(what))
        self.now = 10.0
        self.device.power_on(self.now)
        self.run(0.3)

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds * 100)):
            self.now += 0.01
            self.device.advance(self.now)

    def states(self) -> list[AxisState]:
        return [axis.state for axis in self.device.axes]


def test_one_axis_at_a_time_is_on() -> None:
    rig = Rig()
    first, second = rig.device.axes
    first.control = 1
    rig.run(0.1)
    second.control = 1
    rig.run(0.1)
    assert rig.states() == [AxisState.ENABLED, AxisState.INHIBITED]
    assert rig.device.shown is first
    first.control = second.control = 0
    rig.run(0.1)
    assert rig.states() == [AxisState.READY, AxisState.READY]


def test_the_first_event_is_shown_and_acknowledged_when_its_cause_has_gone() -> None:
    rig = Rig()
    rig.device.trip(41, lasting=True)
    rig.device.trip(31)
    assert (rig.device.event, rig.told, rig.device.error_register) == (41, [(0x4310, 0x08)], 0x08)
    rig.run(0.1)
    assert rig.states() == [AxisState.FAULT, AxisState.FAULT]
    rig.device.acknowledge()
    assert rig.device.event == 41
    rig.device.cause_lasts = False
    rig.device.acknowledge()
    rig.device.acknowledge()
    assert (rig.device.event, rig.told[1:], rig.device.error_register) == (NO_EVENT, [(0, 0)], 0)
