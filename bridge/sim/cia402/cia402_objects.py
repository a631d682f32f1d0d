"""The object dictionary of the simulated CiA 402 drive."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Final

from bridge.sim.cia402.cia402_axis import Cia402Axis
from bridge.sim.cia402.cia402_homing import METHODS
from bridge.sim.cia402.cia402_settings import INCREMENTS, SUPPORTED_MODES, Cia402Mode, Cia402Settings
from bridge.sim.core.communication_objects import DeviceIdentity, add_communication
from bridge.sim.core.communication_settings import CommunicationSettings
from bridge.sim.core.dictionary import Dictionary, IntegerType, Number, constant, item, variable
from bridge.sim.core.emcy_producer import EmcyProducer
from bridge.sim.core.pdo_objects import PdoConfigurator
from bridge.sim.core.sdo_abort import AbortCode, SdoAbort
from bridge.sim.core.store import Store

IDENTITY: Final = DeviceIdentity(
    device_type=0x0002_0192,  # a servo drive with this profile
    vendor_id=0,
    product_code=0x402,
    revision=1,
    serial=1,
    device_name="CiA 402 simulation",
    hardware_version="SIM",
    software_version="1.0",
)
_OPTIONS: Final = {0x605A: (0, 8), 0x605B: (0, 1), 0x605C: (0, 1), 0x605D: (1, 4), 0x605E: (0, 4)}
_NUMBERS: Final = {
    0x6065: (IntegerType.UNSIGNED32, "following_window"),
    0x6066: (IntegerType.UNSIGNED16, "following_ms"),
    0x6067: (IntegerType.UNSIGNED32, "position_window"),
    0x6068: (IntegerType.UNSIGNED16, "position_window_ms"),
    0x606D: (IntegerType.UNSIGNED16, "velocity_window"),
    0x606F: (IntegerType.UNSIGNED16, "velocity_threshold"),
    0x607C: (IntegerType.INTEGER32, "home_offset"),
    0x607F: (IntegerType.UNSIGNED32, "max_profile_velocity"),
    0x6080: (IntegerType.UNSIGNED32, "max_motor_rpm"),
    0x6081: (IntegerType.UNSIGNED32, "profile_velocity"),
    0x6083: (IntegerType.UNSIGNED32, "acceleration"),
    0x6084: (IntegerType.UNSIGNED32, "deceleration"),
    0x6085: (IntegerType.UNSIGNED32, "quick_stop_deceleration"),
    0x609A: (IntegerType.UNSIGNED32, "homing_acceleration"),
}
_ARRAYS: Final = {
    0x604C: ((IntegerType.INTEGER32, IntegerType.INTEGER32), "vl_dimension"),
    0x6046: ((IntegerType.UNSIGNED32, IntegerType.UNSIGNED32), "vl_limits"),
    0x6048: ((IntegerType.UNSIGNED32, IntegerType.UNSIGNED16), "vl_acceleration"),
    0x6049: ((IntegerType.UNSIGNED32, IntegerType.UNSIGNED16), "vl_deceleration"),
    0x604A: ((IntegerType.UNSIGNED32, IntegerType.UNSIGNED16), "vl_quick_stop"),
    0x607D: ((IntegerType.INTEGER32, IntegerType.INTEGER32), "position_limits"),
    0x6099: ((IntegerType.UNSIGNED32, IntegerType.UNSIGNED32), "homing_speeds"),
    0x60C2: ((IntegerType.UNSIGNED8, IntegerType.INTEGER8), "interpolation"),
}
_LEAST: Final = {0x6080: 1, 0x6083: 1, 0x6084: 1, 0x6085: 1, 0x609A: 1}
"""A ramp of 0 would never end."""
_NODE_MAX: Final = 127
_POWER: Final = (-6, 0)
"""60C2:02."""


class Cia402Objects:
    """Fills a dictionary; settings and communication are those of the node."""

    def __init__(
        self, axis: Cia402Axis, settings: Store[Cia402Settings], communication: Store[CommunicationSettings]
    ) -> None:
        self._axis = axis
        self._store = settings
        self._communication = communication

    @property
    def _settings(self) -> Cia402Settings:
        return self._store.current

    def add_to(self, dictionary: Dictionary, emcy: EmcyProducer, pdos: PdoConfigurator) -> None:
        stores = (self._communication, self._store)
        add_communication(dictionary, IDENTITY, lambda: self._axis.status_word, emcy, *stores)
        self._add_consumer(dictionary)
        pdos.add()
        self._add_control(dictionary)
        self._add_options(dictionary)
        self._add_process_data(dictionary)
        self._add_numbers(dictionary)
        dictionary.add_array(
            0x608F, [constant(IntegerType.UNSIGNED32, INCREMENTS), constant(IntegerType.UNSIGNED32, 1)]
        )

    def _add_consumer(self, dictionary: Dictionary) -> None:
        def write(value: int) -> None:
            if value >> 16 > _NODE_MAX:
                raise SdoAbort(AbortCode.VALUE_RANGE)
            self._settings.heartbeat_consumer = value

        entry = Number(IntegerType.UNSIGNED32, lambda: self._settings.heartbeat_consumer, write)
        dictionary.add_array(0x1016, [entry])

    def _add_control(self, dictionary: Dictionary) -> None:
        axis = self._axis

        def set_mode(value: int) -> None:
            if value not in list(Cia402Mode):
                raise SdoAbort(AbortCode.VALUE_RANGE)
            self._settings.mode = value
            axis.set_mode()

        u16, i8 = IntegerType.UNSIGNED16, IntegerType.INTEGER8
        dictionary.add(0x603F, 0, Number(u16, lambda: axis.error_code, in_tpdo=True))
        dictionary.add(
            0x6040, 0, Number(u16, lambda: axis.control_word, axis.command, in_rpdo=True, in_tpdo=True)
        )
        dictionary.add(0x6041, 0, Number(u16, lambda: axis.status_word, in_tpdo=True))
        mode = Number(i8, lambda: self._settings.mode, set_mode, in_rpdo=True, in_tpdo=True)
        dictionary.add(0x6060, 0, mode)
        dictionary.add(0x6061, 0, Number(i8, lambda: self._settings.mode, in_tpdo=True))
        dictionary.add(0x6502, 0, constant(IntegerType.UNSIGNED32, SUPPORTED_MODES))

    def _add_options(self, dictionary: Dictionary) -> None:
        for index, (low, high) in _OPTIONS.items():
            option = item(IntegerType.INTEGER16, lambda: self._settings.options, index, low, high)
            dictionary.add(index, 0, option)
        dictionary.add(
            0x6007, 0, variable(IntegerType.INTEGER16, lambda: self._settings, "abort_connection", 0, 3)
        )

    def _add_process_data(self, dictionary: Dictionary) -> None:
        axis, targets, motor = self._axis, self._axis.targets, self._axis.motor

        def set_position(value: int) -> None:
            targets.position = value
            axis.on_target_position()

        def actual(index: int, kind: IntegerType, read: Callable[[], int]) -> None:
            dictionary.add(index, 0, Number(kind, read, in_tpdo=True))

        i16, i32 = IntegerType.INTEGER16, IntegerType.INTEGER32
        dictionary.add(0x6042, 0, variable(i16, lambda: targets, "vl_velocity", in_pdos=True))
        actual(0x6043, i16, lambda: round(axis.demand_rpm / self._settings.vl_factor))
        actual(0x6044, i16, lambda: round(axis.actual_rpm / self._settings.vl_factor))
        actual(0x6062, i32, lambda: round(motor.position))
        actual(0x6064, i32, lambda: round(motor.position))
        actual(0x606B, i32, lambda: axis.demand_velocity)
        actual(0x606C, i32, lambda: round(motor.velocity))
        position = Number(i32, lambda: targets.position, set_position, in_rpdo=True, in_tpdo=True)
        dictionary.add(0x607A, 0, position)
        actual(0x60FD, IntegerType.UNSIGNED32, lambda: axis.homing.inputs)
        dictionary.add(0x60FF, 0, variable(i32, lambda: targets, "velocity", in_pdos=True))

    def _add_numbers(self, dictionary: Dictionary) -> None:
        for index, (kind, name) in _NUMBERS.items():
            dictionary.add(index, 0, variable(kind, lambda: self._settings, name, _LEAST.get(index)))
        for index, (kinds, name) in _ARRAYS.items():
            values = partial(self._values, name)
            dictionary.add_array(index, [item(kind, values, n) for n, kind in enumerate(kinds)])
        power = item(IntegerType.INTEGER8, partial(self._values, "interpolation"), 1, *_POWER)
        dictionary.add(0x60C2, 2, power)
        dictionary.add(0x6098, 0, self._method())

    def _method(self) -> Number:
        def write(value: int) -> None:
            if value not in METHODS:
                raise SdoAbort(AbortCode.VALUE_RANGE)
            self._settings.homing_method = value

        return Number(IntegerType.INTEGER8, lambda: self._settings.homing_method, write)

    def _values(self, name: str) -> list[int]:
        found: list[int] = getattr(self._settings, name)
        return found
