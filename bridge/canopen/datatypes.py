"""CANopen's data types on the wire (CiA 301 version 4.2, §7.1.4): numbers are little-endian.

Site files, mappings and the command line name them as ``TypeName`` does.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass, field
from enum import Enum
from typing import Final, Literal

TypeName = Literal[
    "bool", "int8", "int16", "int32", "int64", "uint8", "uint16", "uint32", "uint64",
    "real32", "real64", "string", "bytes",
]  # fmt: skip
Plain = bool | int | float | str


class Misfit(Enum):
    """Kinds of ``DataTypeError``, each with its English."""

    NO_BOOL = "a bool is true or false"
    NOT_WHOLE = "a {type} is a whole number"
    NO_NUMBER = "a {type} is a number"
    NO_TEXT = "a {type} is a text in quotes"
    NO_BYTES = "bytes are pairs of hexadecimal digits"
    OUT_OF_RANGE = "a {type} is {low}…{high}"
    TOO_LARGE = "{value} is too large for a {type}"
    NOT_LATIN = "a string has characters of ISO 8859-1 only"
    TOO_SHORT = "a {type} has {size} bytes, not {value}"


class DataTypeError(ValueError):
    """A value that does not fit data type ``kind``. With ``Misfit.TOO_SHORT`` the value is the number of
    bytes that came."""

    def __init__(self, misfit: Misfit, kind: str, value: Plain = "") -> None:
        super().__init__(misfit, kind, value)
        self.misfit = misfit
        self.kind = kind
        self.value = value

    def __str__(self) -> str:
        number = NUMBERS.get(self.kind)
        low, high = (number.low, number.high) if isinstance(number, Integer) else ("", "")
        size = number.size if number else ""
        return self.misfit.value.format(type=self.kind, value=self.value, size=size, low=low, high=high)


@dataclass(frozen=True, slots=True)
class Integer:
    """INTEGERn or UNSIGNEDn: ``size`` bytes that hold ``low`` to ``high``."""

    size: int
    signed: bool = False
    low: int = field(init=False)
    high: int = field(init=False)

    def __post_init__(self) -> None:
        bits = 8 * self.size
        object.__setattr__(self, "low", -(1 << bits - 1) if self.signed else 0)
        object.__setattr__(self, "high", (1 << bits - self.signed) - 1)

    def encode(self, value: int) -> bytes:
        """Raises ValueError if ``value`` does not fit."""
        if not self.low <= value <= self.high:
            raise ValueError(f"takes {self.low}…{self.high}")
        return value.to_bytes(self.size, "little", signed=self.signed)

    def decode(self, data: bytes) -> int:
        """Surplus bytes are ignored: some servers answer every read with four."""
        return int.from_bytes(data[: self.size], "little", signed=self.signed)

    def from_word(self, word: int) -> int:
        """The value of an unsigned word of the same length: FFFFh of an INTEGER16 is -1."""
        return word - (self.high - self.low + 1) if word > self.high else word

    def to_word(self, value: int) -> int:
        """The other way round."""
        return value & self.high - self.low


@dataclass(frozen=True, slots=True)
class Real:
    """REAL32 or REAL64 (IEEE 754)."""

    size: int
    layout: str

    def encode(self, value: float) -> bytes:
        """Raises ValueError if ``value`` is too large."""
        try:
            return struct.pack(self.layout, value)
        except (OverflowError, struct.error):  # of a float, and of an integer
            raise ValueError("too large") from None

    def decode(self, data: bytes) -> float:
        """May be infinite or NaN. Raises ValueError if bytes are missing; surplus ones are ignored."""
        if len(data) < self.size:
            raise ValueError(f"{len(data)} bytes are too few")
        return struct.unpack_from(self.layout, data)[0]


INTEGERS: Final = {
    "bool": Integer(1),
    "int8": Integer(1, signed=True),
    "int16": Integer(2, signed=True),
    "int32": Integer(4, signed=True),
    "int64": Integer(8, signed=True),
    "uint8": Integer(1),
    "uint16": Integer(2),
    "uint32": Integer(4),
    "uint64": Integer(8),
}
REALS: Final = {"real32": Real(4, "<f"), "real64": Real(8, "<d")}
NUMBERS: Final[dict[str, Integer | Real]] = {**INTEGERS, **REALS}


def encode(kind: str, value: Plain) -> bytes:
    """``value`` as bytes. Raises DataTypeError if it does not fit ``kind``."""
    if kind == "bool":
        if value not in (0, 1) or isinstance(value, float | str):
            raise DataTypeError(Misfit.NO_BOOL, kind, value)
        return bytes((int(value),))
    if kind in INTEGERS:
        if isinstance(value, bool | float | str):
            raise DataTypeError(Misfit.NOT_WHOLE, kind, value)
        try:
            return INTEGERS[kind].encode(value)
        except ValueError:
            raise DataTypeError(Misfit.OUT_OF_RANGE, kind, value) from None
    if kind in REALS:
        if isinstance(value, bool | str):
            raise DataTypeError(Misfit.NO_NUMBER, kind, value)
        try:
            return REALS[kind].encode(value)
        except ValueError:
            raise DataTypeError(Misfit.TOO_LARGE, kind, value) from None
    if not isinstance(value, str):
        raise DataTypeError(Misfit.NO_TEXT, kind, value)
    if kind == "bytes":
        return _from_hexadecimal(value)
    try:
        return value.encode("latin-1")
    except UnicodeEncodeError:
        raise DataTypeError(Misfit.NOT_LATIN, kind, value) from None


def _from_hexadecimal(digits: str) -> bytes:
    try:
        return bytes.fromhex(digits)
    except ValueError:
        raise DataTypeError(Misfit.NO_BYTES, "bytes", digits) from None


def decode(kind: str, data: bytes) -> Plain:
    """The value of these bytes: a string up to its first zero byte, bytes in hexadecimal.

    Raises DataTypeError if bytes of a number are missing; surplus ones are ignored.
    """
    if kind == "string":
        return text(data)
    if kind == "bytes":
        return data.hex(" ").upper()
    number = NUMBERS[kind]
    if len(data) < number.size:
        raise DataTypeError(Misfit.TOO_SHORT, kind, len(data))
    value = number.decode(data)
    return bool(value) if kind == "bool" else value


def text(data: bytes) -> str:
    """A VISIBLE_STRING, up to its first zero byte. Devices send ISO 8859-1 in it."""
    return data.split(b"\0", 1)[0].decode("latin-1")


def readable(data: bytes) -> str:
    """A VISIBLE_STRING as people read it: many devices send UTF-8. What is written back goes by ``text``,
    which loses no byte."""
    plain = data.split(b"\0", 1)[0]
    try:
        return plain.decode("utf-8")
    except UnicodeDecodeError as error:
        # A text that was cut within a letter ends in one that is none; what came before has to be UTF-8.
        whole = plain[: error.start]
        if error.end == len(plain) and error.reason == "unexpected end of data" and not whole.isascii():
            return whole.decode("utf-8")
        return text(data)
