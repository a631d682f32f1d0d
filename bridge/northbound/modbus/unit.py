"""The units behind the unit ids: their interface, and the bridge's own unit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

from bridge.catalogue.codes import NODE_CODES, NodeState, WatchdogState
from bridge.command import Identity, Request
from bridge.drive import DriveState
from bridge.image import Quality, Value
from bridge.northbound.modbus.pdu import ExceptionCode, MaskWrite, ModbusException
from bridge.northbound.modbus.registers import RegisterTable
from bridge.northbound.modbus.units import BRIDGE_DRIVES, Units
from bridge.northbound.view import View

_BUS_WARNING, _BUS_PASSIVE, _BUS_OFF, _BUS_DOWN = 1, 2, 3, 4
_CONDITION_BITS, _UNPROVEN_BIT = 8, 10
_LOST: Final = NODE_CODES[NodeState.LOST]
_OPERATIONAL: Final = NODE_CODES[NodeState.OPERATIONAL]
_STARTING: Final = tuple(
    NODE_CODES[state] for state in (NodeState.ABSENT, NodeState.BOOTING, NodeState.CONFIG_ERROR)
)


class Unit:
    """One unit id. Every method may raise ``ModbusException`` and then has changed nothing; here all do, for
    what a unit does not have.

    The ``plan`` methods return the requests that a write stands for, in the order in which they have to be
    submitted; the others can fail only if the first one does.
    """

    def read_bits(self, table: RegisterTable, start: int, count: int) -> Sequence[bool]:
        raise ModbusException(ExceptionCode.ILLEGAL_FUNCTION)

    def read_words(self, table: RegisterTable, start: int, count: int, caller: Identity) -> Sequence[int]:
        raise ModbusException(ExceptionCode.ILLEGAL_FUNCTION)

    def plan_bits(self, start: int, bits: Sequence[bool], caller: Identity) -> list[Request]:
        raise ModbusException(ExceptionCode.ILLEGAL_FUNCTION)

    def plan_words(self, start: int, words: Sequence[int], caller: Identity) -> list[Request]:
        raise ModbusException(ExceptionCode.ILLEGAL_FUNCTION)

    def plan_mask(self, write: MaskWrite, caller: Identity) -> list[Request]:
        raise ModbusException(ExceptionCode.ILLEGAL_FUNCTION)

    def identify(self) -> Mapping[int, str]:
        """Texts for device identification by object id, in ascending order."""
        raise ModbusException(ExceptionCode.ILLEGAL_FUNCTION)


def refuse_quality(quality: Quality) -> None:
    """Raise ``ModbusException`` if a value of this quality is not served."""
    if not quality.has_value:
        configured = quality is not Quality.CONFIG_ERROR
        raise ModbusException(ExceptionCode.NOT_RESPONDING if configured else ExceptionCode.PATH_UNAVAILABLE)


def refuse_all_absent(qualities: Sequence[Quality]) -> None:
    """Raise ``ModbusException`` if none of these values is served: one that is not must not cost a client its
    neighbours, which tools read with it in one request."""
    if qualities and not any(quality.has_value for quality in qualities):
        refuse_quality(qualities[0])


def state_code(state: Value, watchdog_state: Value, quality: Quality) -> int:
    """The state as served: the last known state of a drive that is not heard any more does not count."""
    is_known = quality.has_value or watchdog_state == WatchdogState.TRIPPED
    return int(state) if is_known else DriveState.UNKNOWN


class BridgeUnit(Unit):
    """The bridge itself: input registers only, any other table is an illegal function."""

    def __init__(self, units: Units, view: View) -> None:
        self._site = units.site
        self._view = view
        self._image = view.image
        index = view.image.index
        self._states: Final = [index[f"bus/{name}/state"] for name in units.buses]
        self._load: Final = index[f"bus/{units.buses[0]}/load"]
        self._nodes: Final = [index[f"{name}/node/state"] for name in units.nodes]
        self._drives: Final = {
            name: (index[f"{name}/status/state"], index[f"{name}/supervision/watchdog_state"])
            for name in (drive.drive_name for drive in units.drives)
        }
        self._version: Final = index["bridge/version"]
        self._condition: Final = index["bridge/condition"]
        self._unproven: Final = index["bridge/stops_unproven"]

    def read_words(self, table: RegisterTable, start: int, count: int, caller: Identity) -> Sequence[int]:
        if table is not RegisterTable.INPUT_REGISTER:
            raise ModbusException(ExceptionCode.ILLEGAL_FUNCTION)
        if start + count > BRIDGE_DRIVES + len(self._drives):
            raise ModbusException(ExceptionCode.ILLEGAL_ADDRESS)
        for name in self._drives:
            self._view.look(name)
        image, places = self._image, self._drives.values()
        qualities = image.qualities(state for state, _ in places)
        watchdogs = image.values(watchdog for _, watchdog in places)
        states = image.values(state for state, _ in places)
        bus_state = self._bus_state()
        words = [
            self._module_state(bus_state, tripped=WatchdogState.TRIPPED in watchdogs),
            min(max(round(float(image[self._load].value) * 10), 0), 0xFFFF),
            bus_state,
            len(qualities),
            qualities.count(Quality.GOOD),
            *(
                quality | state_code(state, watchdog, quality) << 8
                for state, watchdog, quality in zip(states, watchdogs, qualities, strict=True)
            ),
        ]
        return words[start : start + count]

    def _bus_state(self) -> int:
        """The worst CAN controller state of all buses; a bus that has not been opened yet is down."""
        readings = [self._image[index] for index in self._states]
        return max(int(reading.value) if reading.quality.has_value else _BUS_DOWN for reading in readings)

    def _module_state(self, bus_state: int, *, tripped: bool) -> int:
        """The bits of P173 (BU 2500 §7.1.3). Its bits 8 … 15 are about drives; here each drive has a
        register, and they tell what is wrong anywhere."""
        states = self._image.values(self._nodes)
        operational = all(state == _OPERATIONAL for state in states)
        starting = any(state in _STARTING for state in states)
        warning = bus_state in (_BUS_WARNING, _BUS_PASSIVE)
        bits = (starting, operational, _LOST in states, tripped, warning, bus_state == _BUS_OFF)
        condition, unproven = self._image.values((self._condition, self._unproven))
        summary = int(condition) << _CONDITION_BITS | bool(unproven) << _UNPROVEN_BIT
        return summary | sum(bit << position for position, bit in enumerate(bits))

    def identify(self) -> Mapping[int, str]:
        version = str(self._image[self._version].value)
        return {0: "drivebridge", 1: "drivebridge", 2: version, 4: "drivebridge", 6: self._site}
