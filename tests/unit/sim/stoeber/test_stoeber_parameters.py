"""Parameters of a STÖBER inverter by their coordinates (ID 441684.06 §11.2)."""

from __future__ import annotations

import pytest

from bridge.sim.core.dictionary import Dictionary
from bridge.sim.core.sdo_abort import SdoAbort
from bridge.sim.core.store import Store
from bridge.sim.stoeber.stoeber_device import StoeberDevice
from bridge.sim.stoeber.stoeber_parameters import add_axis, add_device
from bridge.sim.stoeber.stoeber_settings import coordinate, factory_settings


def made(axes: int) -> tuple[StoeberDevice, Dictionary, Dictionary]:
    store = Store(lambda: factory_settings(axes))
    device = StoeberDevice(axes, store, lambda code, register: None)
    of_device, of_axis = Dictionary(), Dictionary()
    add_device(of_device, device, store)
    add_axis(of_axis, device, axes - 1)
    device.power_on(0.0)
    return device, of_device, of_axis


def test_one_axis_is_commanded_by_a180_and_d230() -> None:
    device, of_device, _ = made(1)
    of_device.find(coordinate("A180"), 0).download(b"\1")
    of_device.find(coordinate("D230"), 0).download((-500).to_bytes(2, "little", signed=True))
    assert (device.axes[0].control, device.axes[0].setpoint) == (1, -500)
    assert of_device.find(coordinate("E48"), 0).upload() == bytes([device.state])


def test_each_of_several_has_its_own_words_and_parameters() -> None:
    device, of_device, of_axis = made(2)
    assert not of_device.has_object(coordinate("A180"))
    of_axis.find(coordinate("Q00"), 0).download(b"\1")
    of_axis.find(coordinate("C01"), 0).download((1200).to_bytes(2, "little"))
    assert [axis.control for axis in device.axes] == [0, 1]
    assert [device.parameters(number).c01_rpm for number in range(2)] == [3000, 1200]
    with pytest.raises(SdoAbort):
        of_axis.find(coordinate("C01"), 0).download(b"\0\0")


def test_the_acknowledge_is_an_edge() -> None:
    device, of_device, _ = made(1)
    control = of_device.find(coordinate("A180"), 0)
    control.download(b"\2")
    device.trip(41)
    device.advance(0.5)
    control.download(b"\2")
    assert device.event == 41
    for byte in (b"\0", b"\2"):
        control.download(byte)
    assert device.event == 30
