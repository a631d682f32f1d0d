"""The register map of a node that is no drive. Addresses are 0-based PDU addresses."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final

from bridge.command.device import Device
from bridge.image import DataType, Point, Quality
from bridge.northbound.modbus.registers import VALUES, VALUES_NOT_GOOD, Row, Table

QUALITY: Final = 11
AGE: Final = 16
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
class InputBit:
    """One discrete input: a point that is true or false, or a bit of one."""

    leaf: str
    name: str
    bit: int | None


class DeviceMap:
    """The map of one device. ``texts`` is what device identification knows, by object id."""

    def __init__(self, device: Device, points: Mapping[str, Point]) -> None:
        family = device.family
        self.unit_id = device.unit_id
        self.device_name = device.name
        self.texts = {0: family.family.vendor, 1: family.family.name, 6: device.name}
        self.bits: list[InputBit] = []
        self.inputs: list[Row] = []
        address = VALUES
        for signal in family.input:
            leaf = f"input/{signal.name}"
            point = points[f"{device.name}/{leaf}"]
            if point.data_type is DataType.BOOL:
                self.bits.append(InputBit(leaf, leaf, None))
                continue
            self.bits += [InputBit(leaf, f"{leaf}/{name or bit}", bit) for bit, name in enumerate(point.bits)]
            kind, size = ("float32", 2)
            if point.data_type is not DataType.FLOAT:
                kind, size = _WIDTHS[signal.data_type]
            row = Row(Table.INPUT_REGISTER, address, leaf, kind, "r", point.unit, point.description)
            self.inputs.append(row)
            address += size
        self.end = address

    @property
    def rows(self) -> Iterator[Row]:
        qualities = ", ".join(f"{quality.value} {quality.label}" for quality in Quality)
        yield Row(Table.INPUT_REGISTER, QUALITY, "quality", "uint16", "r", "", qualities)
        age = "age of the oldest PDO; FFFFFFFFh: one never came"
        yield Row(Table.INPUT_REGISTER, AGE, "node/pdo_age_ms", "uint32", "r", "ms", age)
        not_good = f"bit 0: the first value from {VALUES} on is not good, and so on, up to the 32nd"
        yield Row(Table.INPUT_REGISTER, VALUES_NOT_GOOD, "values_not_good", "uint32", "r", "", not_good)
        yield from self.inputs
        for address, bit in enumerate(self.bits):
            yield Row(Table.DISCRETE_INPUT, address, bit.name, "bool", "r")
