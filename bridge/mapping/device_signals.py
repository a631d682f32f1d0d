"""Signals of a node that is no drive: an encoder (CiA 406), inputs and outputs (CiA 401), anything that sends
PDOs."""

from __future__ import annotations

import math
import struct
import sys
from typing import Annotated, Final, Literal, TypeGuard

from pydantic import Field

from bridge.canopen.datatypes import INTEGERS
from bridge.image import DataType, Value
from bridge.image.limits import ValueNotTaken, out_of_range
from bridge.mapping.entry_types import Name, Ref, States, Table, Wording
from bridge.mapping.parameters import VALUE_TYPES
from bridge.mapping.process import LARGEST_REAL, Process
from bridge.text import Text

SignalType = Literal[
    "bool", "int8", "int16", "int32", "int64", "uint8", "uint16", "uint32", "uint64", "real32", "real64"
]
_REALS: Final = {"real32": struct.Struct("<f"), "real64": struct.Struct("<d")}
_LARGEST: Final = {"real32": LARGEST_REAL, "real64": sys.float_info.max}


class Signal(Table):
    """One object of a PDO: value = number received × factor + offset."""

    name: Name
    object: Ref
    data_type: SignalType
    factor: float = Field(1.0, allow_inf_nan=False)
    offset: float = Field(0.0, allow_inf_nan=False)
    unit: str = ""
    low: float | None = Field(None, allow_inf_nan=False)
    high: float | None = Field(None, allow_inf_nan=False)
    states: States = Field(default_factory=dict[int, str])
    bits: Annotated[list[str], Field(max_length=32)] = Field(
        default_factory=list[str], description="names of the bits from bit 0 on"
    )
    description: str | Wording = ""

    @property
    def is_scaled(self) -> bool:
        return (self.factor, self.offset) != (1.0, 0.0) and self.data_type != "bool"

    @property
    def is_signed(self) -> bool:
        number = INTEGERS.get(self.data_type)
        return number is not None and number.low < 0

    @property
    def size(self) -> int:
        """Number of bits in a PDO."""
        return 1 if self.data_type == "bool" else int("".join(filter(str.isdigit, self.data_type)))

    @property
    def value_type(self) -> DataType:
        """Type of its point."""
        return DataType.FLOAT if self.is_scaled else VALUE_TYPES[self.data_type]

    @property
    def is_real(self) -> bool:
        """Whether it is a floating-point number on the wire."""
        return self.data_type in _REALS

    def decode(self, raw: int) -> Value:
        """Value of a PDO entry; ``raw`` is its integer, with a sign where the type has one."""
        if self.data_type == "bool":
            return bool(raw)
        real = _REALS.get(self.data_type)
        number = raw if real is None else real.unpack(raw.to_bytes(real.size, "little"))[0]
        if self.is_scaled:
            return number * self.factor + self.offset
        return float(number) if self.value_type is DataType.FLOAT else number

    def encode(self, value: object) -> int:
        """PDO entry of a value, as an unsigned integer. Raises ``ValueNotTaken`` with what it takes
        instead."""
        if self.data_type == "bool":
            if value not in (0, 1):
                raise ValueNotTaken(Text.of("takes.bool", value=repr(value)))
            return int(bool(value))
        if not _is_number(value):
            raise ValueNotTaken(Text.of("takes.number"))
        low, high = self.low, self.high
        if (low is not None and value < low) or (high is not None and value > high):
            raise out_of_range(low, high, value)
        number = (value - self.offset) / self.factor if self.is_scaled else value
        real = _REALS.get(self.data_type)
        if real is not None:
            largest = _LARGEST[self.data_type]
            if abs(number) > largest:
                raise self._beyond(-largest, largest, value)
            return int.from_bytes(real.pack(number), "little")
        if not self.is_scaled and number != int(number):
            raise ValueNotTaken(Text.of("takes.whole_number", value=f"{value:g}"))
        kind = INTEGERS[self.data_type]
        # Within reach of the type first: what a scale makes of a large number may be infinite.
        raw = round(max(kind.low - 1, min(kind.high + 1, number)))
        if not kind.low <= raw <= kind.high:
            raise self._beyond(kind.low, kind.high, value)
        return raw & ((1 << self.size) - 1)

    def _beyond(self, low: float, high: float, value: float) -> ValueNotTaken:
        """Refusal of a value that the type, from ``low`` to ``high``, does not hold."""
        ends = [low * self.factor + self.offset, high * self.factor + self.offset]
        return out_of_range(min(ends), max(ends), value)


def _is_number(value: object) -> TypeGuard[int | float]:
    """Whether it is a finite number. An integer of more than 308 digits counts as infinite."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    try:
        return math.isfinite(value)
    except OverflowError:
        return False


OnExpiry = bool | int | float | Literal["hold"]


class Output(Signal):
    """One object of a PDO that the node receives: number sent = (value − offset) / factor."""

    on_expiry: OnExpiry = Field(
        0,
        description='value when its controller falls silent: a number, or "hold" for the last one',
    )
    error_mode: Ref | None = Field(
        None, description="says whether it takes the error value when the node leaves Operational (CiA 401)"
    )
    error_value: Ref | None = Field(None, description="the error value")


def no_process() -> Process:
    """Stand-in for the process data of drives, in a family without slots."""
    return Process.model_validate({"rpdo": ["control_word"], "tpdo": ["status_word"]})
