"""Drive parameters of a STÖBER inverter, by their coordinates (ID 441684.06 §8.2.1, §11.2)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from bridge.sim.core.dictionary import Dictionary, IntegerType, Number, constant, item, variable
from bridge.sim.core.store import Store
from bridge.sim.stoeber.stoeber_axis import ACKNOWLEDGE, AxisParameters, StoeberAxis
from bridge.sim.stoeber.stoeber_device import StoeberDevice
from bridge.sim.stoeber.stoeber_posi import PositioningAxis
from bridge.sim.stoeber.stoeber_settings import CHANNELS, StoeberSettings, coordinate

_BAUD_250: Final = 5


def add_device(dictionary: Dictionary, device: StoeberDevice, settings: Store[StoeberSettings]) -> None:
    """Parameters of the device, and A180 and D230 if there is only one axis."""
    u8, i16 = IntegerType.UNSIGNED8, IntegerType.INTEGER16
    for channel in range(CHANNELS + 1):
        # The axis that an SDO channel (0: the display) works on.
        edited = item(u8, lambda: settings.current.edited_axis, channel, 0, len(device.axes) - 1)
        dictionary.add(coordinate("A11"), channel, edited)
    _put(dictionary, "A82", constant(u8, _BAUD_250))
    _put(dictionary, "E00", Number(i16, lambda: round(10 * device.shown.current_a), in_tpdo=True))
    _put(dictionary, "E08", Number(i16, lambda: round(device.shown.speed_rpm), in_tpdo=True))
    for name in ("E39", "E43"):  # §9.3 calls the fifth byte of the emergency message by both names
        _put(dictionary, name, Number(u8, lambda: device.cause))
    _put(dictionary, "E48", Number(u8, lambda: device.state, in_tpdo=True))
    _put(dictionary, "E82", Number(u8, lambda: device.event, in_tpdo=True))
    _put(dictionary, "E200", Number(u8, lambda: device.shown.status_byte, in_tpdo=True))
    if len(device.axes) == 1:
        _add_command(dictionary, device, device.axes[0], "A180", "D230")


def add_axis(dictionary: Dictionary, device: StoeberDevice, number: int) -> None:
    """The parameters of axis ``number`` (from 0)."""
    axis = device.axes[number]
    u8, i16 = IntegerType.UNSIGNED8, IntegerType.INTEGER16

    def parameters() -> AxisParameters:
        return device.parameters(number)

    _put(dictionary, "C01", variable(i16, parameters, "c01_rpm", 1, 32767))
    _put(dictionary, "C230", variable(i16, parameters, "c230_percent", 0, 200))
    if isinstance(axis, PositioningAxis):
        _add_positioning(dictionary, axis, parameters)
    if len(device.axes) > 1:
        _add_command(dictionary, device, axis, "Q00", "Q01")
        _put(dictionary, "Q02", Number(u8, lambda: axis.state, in_tpdo=True))
        _put(dictionary, "Q03", Number(u8, lambda: axis.status_byte, in_tpdo=True))
        _put(dictionary, "Q04", Number(i16, lambda: round(axis.speed_rpm), in_tpdo=True))
        _put(dictionary, "Q05", Number(i16, lambda: round(10 * axis.current_a), in_tpdo=True))


def _add_positioning(
    dictionary: Dictionary, axis: PositioningAxis, parameters: Callable[[], AxisParameters]
) -> None:
    u8, u16, i16, i32 = (
        IntegerType.UNSIGNED8,
        IntegerType.UNSIGNED16,
        IntegerType.INTEGER16,
        IntegerType.INTEGER32,
    )
    for name, attribute in (("I07", "i07"), ("I08", "i08"), ("I10", "max_speed")):
        _put(dictionary, name, variable(i32, parameters, attribute, 1))
    for name, kind, attribute in (
        ("I210", u8, "command"),
        ("I213", i32, "target"),
        ("I216", u16, "velocity"),
        ("I217", u16, "acceleration"),
        ("I218", u16, "deceleration"),
    ):
        _put(dictionary, name, variable(kind, lambda: axis, attribute, in_pdos=True))
    motor = axis.motor
    _put(dictionary, "I80", Number(i32, lambda: round(motor.position), in_tpdo=True))
    _put(dictionary, "I88", Number(i16, lambda: round(motor.velocity), in_tpdo=True))
    _put(dictionary, "I200", Number(u8, lambda: axis.posi_status, in_tpdo=True))


def _put(dictionary: Dictionary, name: str, entry: Number) -> None:
    dictionary.add(coordinate(name), 0, entry)


def _add_command(
    dictionary: Dictionary, device: StoeberDevice, axis: StoeberAxis, control: str, setpoint: str
) -> None:
    def set_control(value: int) -> None:
        rising = value & ~axis.control
        axis.control = value
        if rising & ACKNOWLEDGE:
            device.acknowledge()

    command = Number(IntegerType.UNSIGNED8, lambda: axis.control, set_control, in_rpdo=True, in_tpdo=True)
    _put(dictionary, control, command)
    _put(dictionary, setpoint, variable(IntegerType.INTEGER16, lambda: axis, "setpoint", in_pdos=True))
