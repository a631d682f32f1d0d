"""The register map of a node that is no drive. Addresses are 0-based PDU addresses."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Final

from bridge.catalogue import DeviceSpec
from bridge.image import DataType, Point, Quality
from bridge.mapping.device_signals import Signal
from bridge.northbound.modbus.registers import (
    ABORT_CODE,
    ACKNOWLEDGE,
    KEEP_ALIVE,
    MOST_PARAMETERS,
    PARAMETERS,
    STOP,
    TELEGRAMS,
    VALUES,
    VALUES_NOT_GOOD,
    Allows,
    RegisterTable,
    Row,
    row_maker,
    value_rows,
)

WATCHDOG: Final = 14
QUALITY: Final = 11
AGE: Final = 16
ABORT: Final = 18
OWNER: Final = 20
_WIDTHS: Final = {
    "bool": ("bool", 1),
    "uint8": ("uint16", 1),
    "uint16": ("uint16", 1),
    "int8": ("int16", 1),
    "int16": ("int16", 1),
    "uint32": ("uint32", 2),
    "int32": ("int32", 2),
}
"""Type and registers of an integer that is not scaled; every other value is a float32."""


@dataclass(frozen=True, slots=True)
class SignalBit:
    """One discrete input or coil: a point that is true or false, or a bit of one."""

    leaf: str
    name: str
    bit: int | None


class DeviceMap:
    """The map of one device, by the tables of Modbus: inputs are discrete inputs and input registers, outputs
    coils and holding registers. ``parameters`` are the holding registers from 1000 on. ``texts`` is what
    device identification knows, by object id."""

    def __init__(self, device: DeviceSpec, allows: Allows | None = None) -> None:
        """``allows`` is for the access column; without it, the access is what the mapping offers."""
        allows = allows or Allows()
        self._allows = allows
        family = device.family
        self.unit_id = device.unit_id
        self.device_name = device.name
        self.texts = {0: family.family.vendor, 1: family.family.name, 6: device.name}
        self.has_outputs = device.is_commanded
        own = {point.name[len(device.name) + 1 :]: point for point in device.points}
        self.discrete_inputs, self.input_registers = _signals("input", family.input, own, "r")
        access = "rw" if allows.may_command else "r"
        self.coils, self.holding_registers = _signals("output", family.output, own, access)
        writable = [
            leaf
            for leaf, point in own.items()
            if leaf.startswith("parameter/") and point.writable and point.data_type is not DataType.STRING
        ]
        shown = writable[:MOST_PARAMETERS]
        self.parameters = value_rows(RegisterTable.HOLDING_REGISTER, shown, own, allows, PARAMETERS)

    def end(self, table: RegisterTable) -> int:
        """First address behind its inputs or outputs."""
        rows = self.input_registers if table is RegisterTable.INPUT_REGISTER else self.holding_registers
        return rows[-1].address + rows[-1].size if rows else VALUES

    @property
    def rows(self) -> Iterator[Row]:
        row = row_maker(RegisterTable.INPUT_REGISTER, "r")
        qualities = ", ".join(f"{quality.value} {quality.label}" for quality in Quality)
        yield row(QUALITY, "quality", "uint16", "", qualities)
        if self.has_outputs:
            states = "0 off, 1 idle, 2 running, 3 tripped"
            yield row(WATCHDOG, "supervision/watchdog_state", "uint16", "", states)
            left = "time left on the watchdog"
            yield row(WATCHDOG + 1, "supervision/watchdog_left_ms", "uint16", "ms", left)
        age = "age of the oldest PDO; FFFFFFFFh: one never came"
        yield row(AGE, "node/pdo_age_ms", "uint32", "ms", age)
        abort = "why the node last refused an SDO of a client; 0: never"
        yield row(ABORT, ABORT_CODE.rpartition("/")[2], "uint32", "", abort)
        if self.has_outputs:
            owners = "0 none, 1 opcua, 2 modbus, 3 zenoh, 4 local"
            yield row(OWNER, "supervision/owner", "uint16", "", owners)
        not_good = f"bit 0: the first value from {VALUES} on is not good, and so on, up to the 32nd"
        yield row(VALUES_NOT_GOOD, "values_not_good", "uint32", "", not_good)
        if self.has_outputs:
            yield row(TELEGRAMS, "supervision/telegrams", "uint16", "", "counts the owner's valid telegrams")
        yield from self.input_registers
        yield from self._command_rows()
        yield from self.holding_registers
        yield from self.parameters
        for address, bit in enumerate(self.discrete_inputs):
            yield Row(RegisterTable.DISCRETE_INPUT, address, bit.name, "bool", "r")
        for address, bit in enumerate(self.coils):
            yield Row(
                RegisterTable.COIL, address, bit.name, "bool", "rw" if self._allows.may_command else "r"
            )

    def _command_rows(self) -> Iterator[Row]:
        if not self.has_outputs:
            return
        row = row_maker(RegisterTable.HOLDING_REGISTER, "rw" if self._allows.may_command else "r")
        stop = row_maker(RegisterTable.HOLDING_REGISTER, "rw" if self._allows.may_stop else "r")
        alive = "not 0: a telegram; 0: release; reads 1 for the owner"
        yield row(KEEP_ALIVE, "keep_alive", "uint16", "", alive)
        yield row(ACKNOWLEDGE, "acknowledge", "uint16", "", "write 1 to acknowledge a trip; reads 0")
        yield stop(STOP, "stop", "uint16", "", "1, 2 or 3: make every output safe; reads 0")


def _signals(
    group: str, signals: Iterable[Signal], points: Mapping[str, Point], access: str
) -> tuple[list[SignalBit], list[Row]]:
    """The bits and the registers of inputs or outputs, in the order of the mapping."""
    table = RegisterTable.INPUT_REGISTER if group == "input" else RegisterTable.HOLDING_REGISTER
    bits: list[SignalBit] = []
    rows: list[Row] = []
    address = VALUES
    for signal in signals:
        leaf = f"{group}/{signal.name}"
        point = points[leaf]
        if point.data_type is DataType.BOOL:
            bits.append(SignalBit(leaf, leaf, None))
            continue
        bits += [SignalBit(leaf, f"{leaf}/{name or bit}", bit) for bit, name in enumerate(point.bits)]
        kind, size = ("float32", 2)
        if point.data_type is not DataType.FLOAT:
            kind, size = _WIDTHS[signal.data_type]
        rows.append(Row(table, address, leaf, kind, access, point.unit, str(point.description)))
        address += size
    return bits, rows
