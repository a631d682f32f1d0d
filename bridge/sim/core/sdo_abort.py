"""Abort codes of an SDO transfer (BU 2500 §8.3.2, CiA 301 §7.2.4.3.17)."""

from __future__ import annotations

from enum import IntEnum


class AbortCode(IntEnum):
    """Abort codes of SDO transfers: bytes 4…7 of the abort."""

    TOGGLE_BIT = 0x0503_0000
    COMMAND_UNKNOWN = 0x0504_0001
    BLOCK_SIZE = 0x0504_0002
    SEQUENCE_NUMBER = 0x0504_0003
    CRC = 0x0504_0004
    UNSUPPORTED_ACCESS = 0x0601_0000
    WRITE_ONLY = 0x0601_0001
    READ_ONLY = 0x0601_0002
    OBJECT_MISSING = 0x0602_0000
    NOT_MAPPABLE = 0x0604_0041
    PDO_TOO_LONG = 0x0604_0042
    HARDWARE_FAULT = 0x0606_0000
    LENGTH_MISMATCH = 0x0607_0010
    LENGTH_TOO_HIGH = 0x0607_0012
    LENGTH_TOO_LOW = 0x0607_0013
    SUBINDEX_MISSING = 0x0609_0011
    VALUE_RANGE = 0x0609_0030
    CANNOT_STORE = 0x0800_0020
    WRONG_STATE = 0x0800_0022


class SdoAbort(Exception):
    """A request for an object that the dictionary refuses, with one of ``AbortCode`` or another's code."""

    def __init__(self, code: int) -> None:
        super().__init__(f"{code.name} {code:08X}h" if isinstance(code, AbortCode) else f"{code:08X}h")
        self.code = code
