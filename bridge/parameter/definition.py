"""What is known of one parameter, and where it stands in the object dictionary."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final

from bridge.image import DataType

_VALUE_TYPES: Final = {
    "bool": DataType.BOOL,
    "int8": DataType.INT16,
    "int16": DataType.INT16,
    "int32": DataType.INT32,
    "int64": DataType.FLOAT,
    "uint8": DataType.UINT8,
    "uint16": DataType.UINT16,
    "uint32": DataType.UINT32,
    "uint64": DataType.FLOAT,
    "real32": DataType.FLOAT,
    "real64": DataType.FLOAT,
    "string": DataType.STRING,
    "bytes": DataType.STRING,
}
_TEXTS: Final = ("string", "bytes", "bool")
_OTHER: Final = re.compile(r"[^0-9a-z]+")


@dataclass(frozen=True, slots=True, order=True)
class Address:
    """Index and sub-index of an object."""

    index: int
    sub: int

    def __str__(self) -> str:
        return f"{self.index:04X}:{self.sub:02X}"


@dataclass(frozen=True, slots=True)
class Definition:
    """One ``[[parameter]]`` of a mapping file: value = wire × factor, ``low`` and ``high`` in ``unit``.

    ``data_type`` is CiA 301's, such as ``int16`` or ``real32``. ``base`` is the object of its first
    element in its first set, or None where the family's naming rule gives it. ``elements`` and ``sets``
    are 0 where the parameter has none. ``protected`` is empty or says who may write it and when, ``backup``
    is false for what no parameter set holds, ``of_node`` true for what only the node's first SDO channel
    reaches.
    """

    name: str
    title: str
    data_type: str
    factor: float = 1.0
    unit: str = ""
    low: float | None = None
    high: float | None = None
    access: str = "rw"
    elements: int = 0
    sets: int = 0
    states: tuple[tuple[int, str], ...] = ()
    base: Address | None = None
    point: bool = False
    every_ms: int = 0
    volatile: bool = False
    protected: str = ""
    backup: bool = True
    of_node: bool = False

    @property
    def readable(self) -> bool:
        return self.access != "wo"

    @property
    def writable(self) -> bool:
        return self.access != "ro"

    @property
    def value_type(self) -> DataType:
        """The type of the value as users see it."""
        if self.factor != 1.0 and self.data_type not in _TEXTS:
            return DataType.FLOAT
        return _VALUE_TYPES[self.data_type]


@dataclass(frozen=True, slots=True)
class Entry:
    """One value of a drive: a parameter, one element of it, or an object that no file describes."""

    name: str
    address: Address
    definition: Definition | None = None

    @property
    def leaf(self) -> str:
        """Its name as a point, such as ``p102_2_3`` for P102[2].3."""
        return leaf_of(self.name)

    @property
    def unit(self) -> str:
        return self.definition.unit if self.definition else ""


def leaf_of(name: str) -> str:
    return _OTHER.sub("_", name.lower()).strip("_")
