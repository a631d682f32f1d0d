"""Modbus PDUs: bytes to requests and answers to bytes (MODBUS Application Protocol V1.1b3, §6).

Plain ``struct`` code rather than pymodbus's PDU classes: ``DecodePDU`` returns None for a wrong count, which
loses the function code for the exception, accepts FC16 with a wrong byte count, and formats a log line for
each PDU. As the client of the wire tests, pymodbus checks this codec from the other side.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from functools import partial
from typing import Final

PDU_MOST: Final = 253
"""Longest PDU in bytes, §4.1."""


class Function(IntEnum):
    """The function codes that are served."""

    READ_COILS = 1
    READ_DISCRETE_INPUTS = 2
    READ_HOLDING_REGISTERS = 3
    READ_INPUT_REGISTERS = 4
    WRITE_COIL = 5
    WRITE_REGISTER = 6
    DIAGNOSTICS = 8
    WRITE_COILS = 15
    WRITE_REGISTERS = 16
    MASK_WRITE = 22
    READ_WRITE = 23
    ENCAPSULATED = 43


class ExceptionCode(IntEnum):
    """Exception codes of a refused request, §7."""

    ILLEGAL_FUNCTION = 0x01
    ILLEGAL_ADDRESS = 0x02
    ILLEGAL_VALUE = 0x03
    DEVICE_FAILURE = 0x04
    BUSY = 0x06
    PATH_UNAVAILABLE = 0x0A
    NOT_RESPONDING = 0x0B


class ModbusException(Exception):
    """The request is answered with this exception code."""

    def __init__(self, code: ExceptionCode) -> None:
        super().__init__(code.name)
        self.code = code


@dataclass(frozen=True, slots=True)
class ModbusRead:
    """FC1 … FC4."""

    function: Function
    start: int
    count: int


@dataclass(frozen=True, slots=True)
class WriteBits:
    """FC5 and FC15. ``echo``, here and below, is the answer to a successful write."""

    start: int
    bits: tuple[bool, ...]
    echo: bytes


@dataclass(frozen=True, slots=True)
class WriteWords:
    """FC6 and FC16."""

    start: int
    words: tuple[int, ...]
    echo: bytes


@dataclass(frozen=True, slots=True)
class MaskWrite:
    """FC22: the register becomes ``(register & and_mask) | (or_mask & ~and_mask)``, §6.16."""

    address: int
    and_mask: int
    or_mask: int
    echo: bytes


@dataclass(frozen=True, slots=True)
class ReadWrite:
    """FC23: the write comes before the read, §6.17."""

    start: int
    words: tuple[int, ...]
    read_start: int
    read_count: int


@dataclass(frozen=True, slots=True)
class Loopback:
    """FC8, sub-function 0: the request is its own answer."""

    echo: bytes


@dataclass(frozen=True, slots=True)
class Identify:
    """FC43/14. ``code`` is 1 basic, 2 regular, 3 extended (streams), 4 one object, §6.21."""

    code: int
    object_id: int


PduRequest = ModbusRead | WriteBits | WriteWords | MaskWrite | ReadWrite | Loopback | Identify

_TWO: Final = struct.Struct(">HH")
_THREE: Final = struct.Struct(">HHH")
_MANY: Final = struct.Struct(">HHB")
_READ_WRITE: Final = struct.Struct(">HHHHB")
_OFF_ON: Final = {0x0000: False, 0xFF00: True}
_MEI_IDENTIFICATION: Final = 0x0E
_IDENTIFY_EVERYTHING: Final = 0x83  # conformity level: extended, as streams and one by one


def parse(pdu: bytes) -> PduRequest:
    """The request in ``pdu``, which has at least one byte.

    Raises ``ModbusException``: ILLEGAL_FUNCTION for a function that is not served, ILLEGAL_VALUE for a count,
    length or value that the function does not allow. Nothing else is raised, whatever the bytes are.
    """
    parser = _PARSERS.get(pdu[0])
    if parser is None:
        raise ModbusException(ExceptionCode.ILLEGAL_FUNCTION)
    try:
        return parser(pdu)
    except struct.error:
        raise ModbusException(ExceptionCode.ILLEGAL_VALUE) from None


def _demand(condition: bool) -> None:
    if not condition:
        raise ModbusException(ExceptionCode.ILLEGAL_VALUE)


def _read(most: int, pdu: bytes) -> ModbusRead:
    start, count = _TWO.unpack(pdu[1:])
    _demand(1 <= count <= most)
    return ModbusRead(Function(pdu[0]), start, count)


def _write_coil(pdu: bytes) -> WriteBits:
    start, value = _TWO.unpack(pdu[1:])
    _demand(value in _OFF_ON)
    return WriteBits(start, (_OFF_ON[value],), pdu)


def _write_register(pdu: bytes) -> WriteWords:
    start, word = _TWO.unpack(pdu[1:])
    return WriteWords(start, (word,), pdu)


def _write_coils(pdu: bytes) -> WriteBits:
    start, count, size = _MANY.unpack(pdu[1:6])
    _demand(1 <= count <= 1968 and size == (count + 7) // 8 == len(pdu) - 6)
    packed = int.from_bytes(pdu[6:], "little")
    return WriteBits(start, tuple(bool(packed >> i & 1) for i in range(count)), pdu[:5])


def _write_registers(pdu: bytes) -> WriteWords:
    start, count, size = _MANY.unpack(pdu[1:6])
    _demand(1 <= count <= 123 and size == 2 * count == len(pdu) - 6)
    return WriteWords(start, struct.unpack(f">{count}H", pdu[6:]), pdu[:5])


def _mask_write(pdu: bytes) -> MaskWrite:
    address, and_mask, or_mask = _THREE.unpack(pdu[1:])
    return MaskWrite(address, and_mask, or_mask, pdu)


def _read_write(pdu: bytes) -> ReadWrite:
    read_start, read_count, start, count, size = _READ_WRITE.unpack(pdu[1:10])
    _demand(1 <= read_count <= 125 and 1 <= count <= 121 and size == 2 * count == len(pdu) - 10)
    return ReadWrite(start, struct.unpack(f">{count}H", pdu[10:]), read_start, read_count)


def _diagnostics(pdu: bytes) -> Loopback:
    _demand(len(pdu) >= 3)
    if pdu[1:3] != b"\0\0":
        raise ModbusException(ExceptionCode.ILLEGAL_FUNCTION)
    _demand(len(pdu) >= 5)
    return Loopback(pdu)


def _encapsulated(pdu: bytes) -> Identify:
    _demand(len(pdu) >= 2)
    if pdu[1] != _MEI_IDENTIFICATION:
        raise ModbusException(ExceptionCode.ILLEGAL_FUNCTION)
    _demand(len(pdu) == 4 and 1 <= pdu[2] <= 4)
    return Identify(pdu[2], pdu[3])


_PARSERS: Final[dict[int, Callable[[bytes], PduRequest]]] = {
    Function.READ_COILS: partial(_read, 2000),
    Function.READ_DISCRETE_INPUTS: partial(_read, 2000),
    Function.READ_HOLDING_REGISTERS: partial(_read, 125),
    Function.READ_INPUT_REGISTERS: partial(_read, 125),
    Function.WRITE_COIL: _write_coil,
    Function.WRITE_REGISTER: _write_register,
    Function.DIAGNOSTICS: _diagnostics,
    Function.WRITE_COILS: _write_coils,
    Function.WRITE_REGISTERS: _write_registers,
    Function.MASK_WRITE: _mask_write,
    Function.READ_WRITE: _read_write,
    Function.ENCAPSULATED: _encapsulated,
}


def refusal(function: int, code: ExceptionCode) -> bytes:
    """The exception answer to a request of ``function``."""
    return bytes((function | 0x80, code))


def words_answer(function: Function, words: Sequence[int]) -> bytes:
    return struct.pack(f">BB{len(words)}H", function, 2 * len(words), *words)


def bits_answer(function: Function, bits: Sequence[bool]) -> bytes:
    """The first bit is the lowest of the first byte, §6.1."""
    packed = sum(bit << position for position, bit in enumerate(bits))
    size = (len(bits) + 7) // 8
    return bytes((function, size)) + packed.to_bytes(size, "little")


def identification_answer(request: Identify, objects: Mapping[int, bytes]) -> bytes:
    """The answer to FC43/14 from ``objects`` by object id, in rising order.

    A stream begins at ``object_id`` and, if it is too long, names the object to continue with. Raises
    ``ModbusException`` (ILLEGAL_ADDRESS) if a single object is asked for that does not exist.
    """
    if request.code == 4:
        value = objects.get(request.object_id)
        if value is None:
            raise ModbusException(ExceptionCode.ILLEGAL_ADDRESS)
        chosen = [(request.object_id, value)]
    else:
        last = {1: 0x02, 2: 0x7F, 3: 0xFF}[request.code]
        category = [(number, value) for number, value in objects.items() if number <= last]
        # A stream from an unknown object id starts at the beginning, §6.21.
        known = any(number == request.object_id for number, _ in category)
        chosen = [pair for pair in category if not known or pair[0] >= request.object_id]
    body = bytearray()
    count, next_id = 0, 0
    for number, value in chosen:
        if 7 + len(body) + 2 + len(value) > PDU_MOST:
            next_id = number
            break
        body += bytes((number, len(value))) + value
        count += 1
    more = 0xFF if next_id else 0x00
    head = (Function.ENCAPSULATED, _MEI_IDENTIFICATION, request.code, _IDENTIFY_EVERYTHING, more, next_id)
    return bytes((*head, count)) + body
