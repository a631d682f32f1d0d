"""The register map: what each address of each unit means.

Only the layout, used by the server and by ``drivebridge export modbus``. Addresses are 0-based PDU addresses.
Reference for users: ``docs/reference/modbus.md``.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from bridge.catalogue import DriveSpec
from bridge.config import WordOrder
from bridge.image import DataType, Point, Quality
from bridge.mapping.model import Family

BRIDGE_UNITS: Final = (255, 0)
"""Unit ids of the bridge itself; the first is the one to show."""

PROCESS_WORDS: Final = 8
"""Setpoint and actual words that have a register, whether the drive has them or not."""

# Holding registers of a drive.
KEEP_ALIVE: Final = 10
ACKNOWLEDGE: Final = 11
TIMEOUT: Final = 12
STOP: Final = 13
LIFE_SIGN: Final = 14
# Input registers of a drive: 0 … 9 are the drive's data, 10 … 31 the bridge's own knowledge.
DIAGNOSTICS: Final = 10
WORDS_NOT_GOOD: Final = 21
VALUES_NOT_GOOD: Final = 22
TELEGRAMS: Final = 24
TOKEN: Final = 26
VALUES: Final = 32
"""First register of the 32-bit values, input and holding alike."""
PARAMETERS: Final = 1000
"""First holding register of the writable parameters, two registers each."""
MIRROR: Final = 4096
"""First holding register of the copy of the input registers, for clients that know function 3 alone and for
function 23, whose read is of holding registers. The machine unit has its status blocks there, too."""
MOST_PARAMETERS: Final = (MIRROR - PARAMETERS) // 2
"""Parameters that have registers; further ones are reached over the other protocols."""
VALUE_FLAGS: Final = 4096
"""First discrete input of those that say which values are not good: one for each 32-bit value."""
INPUT_FLAGS: Final = 8192
"""First discrete input of those that say which discrete inputs are not good."""
QUALITY_BITS: Final = 16
"""First discrete input of the quality."""
ABORT_CODE: Final = "supervision/sdo_abort_code"
"""The point behind the register ``sdo_abort_code``."""


_REGISTERS: Final = struct.Struct(">HH")


class RegisterTable(StrEnum):
    COIL = "coil"
    DISCRETE_INPUT = "discrete input"
    INPUT_REGISTER = "input register"
    HOLDING_REGISTER = "holding register"


_REFERENCE: Final = {
    RegisterTable.COIL: 0,
    RegisterTable.DISCRETE_INPUT: 1,
    RegisterTable.INPUT_REGISTER: 3,
    RegisterTable.HOLDING_REGISTER: 4,
}


@dataclass(frozen=True, slots=True)
class Row:
    """One value: a bit, a register, or two registers for 32 bits.

    ``type`` is bool, uint16, uint32, int32 or float32; ``access`` r, w or rw; ``name`` the point's name below
    its drive if it is a point.
    """

    table: RegisterTable
    address: int
    name: str
    type: str
    access: str
    unit: str = ""
    description: str = ""

    @property
    def size(self) -> int:
        return 2 if self.type.endswith("32") else 1

    @property
    def reference(self) -> str:
        """The 1-based number used in older manuals, such as 30033 or 40001."""
        return f"{_REFERENCE[self.table]}{self.address + 1:04d}"


@dataclass(frozen=True, slots=True)
class Allows:
    """Rights of Modbus clients to write to a drive."""

    write: Callable[[Point], bool] = lambda point: point.writable
    may_command: bool = True
    may_stop: bool = True


_NOTHING: Final = Allows(lambda point: False, may_command=False, may_stop=False)


def _access(is_writable: bool) -> str:
    return "rw" if is_writable else "r"


class DriveMap:
    """The map of one drive. ``inputs`` and ``setpoints`` are the 32-bit values from register 32 on,
    ``parameters`` those from register 1000 on. ``words`` are the process words by table and register,
    ``timeout_range_ms`` what an owner may write to ``TIMEOUT``, None where that is nothing. ``texts`` is what
    device identification knows without asking the drive, by object id."""

    def __init__(self, drive: DriveSpec, allows: Allows | None = None) -> None:
        """``allows`` is for the access column; without it, the access is what the drive's family offers."""
        allows = allows or Allows()
        self.drive_name = drive.name
        self.unit_id = drive.unit_id
        family, slot = drive.family, drive.slot
        self.texts = {0: family.family.vendor, 1: family.family.name, 5: slot.name, 6: drive.name}
        self.has_life_sign = drive.table.life_sign
        is_writable = drive.table.fieldbus_timeout_writable
        self.timeout_range_ms = drive.table.timeout_range_ms if is_writable else None
        self.words: dict[RegisterTable, dict[int, str]] = {
            RegisterTable.INPUT_REGISTER: _words("actual", family.process.tpdo, family.carried(slot)[1]),
            RegisterTable.HOLDING_REGISTER: _words("command", family.process.rpdo, family.carried(slot)[0]),
        }
        points = {point.name[len(drive.name) + 1 :]: point for point in drive.points}
        fixed = (
            *_input_rows(self.words[RegisterTable.INPUT_REGISTER]),
            *_holding_rows(self.words[RegisterTable.HOLDING_REGISTER], allows, may_set=is_writable),
            *(_life_rows(allows) if self.has_life_sign else ()),
        )
        # What has to be set in the drive first goes behind all others, whose addresses do not depend on it.
        values = sorted(family.values_of(slot), key=lambda value: not family.is_usual(slot, value))
        unusual = [value.leaf for value in values if not family.is_usual(slot, value)]
        scaled = [value.name for value in values if value.group == "actual"]
        taken = {row.name for row in fixed} | {ABORT_CODE}
        more = [
            leaf
            for leaf, point in points.items()
            if point.data_type is not DataType.STRING
            and not leaf.startswith("command/")
            and leaf not in taken
        ]
        first = [leaf for name in scaled if (leaf := f"actual/{name}") not in unusual]
        last = [leaf for leaf in unusual if leaf.startswith("actual/")]
        chosen = first + [leaf for leaf in more if leaf not in first and leaf not in last] + last
        chosen.sort(key=lambda leaf: points[leaf].added)
        self.inputs = value_rows(RegisterTable.INPUT_REGISTER, chosen, points, _NOTHING)
        commands = [value.leaf for value in values if value.group == "command"]
        self.setpoints = value_rows(RegisterTable.HOLDING_REGISTER, commands, points, allows)
        writable = [
            leaf
            for leaf, point in points.items()
            if leaf.startswith("parameter/") and point.writable and point.data_type is not DataType.STRING
        ]
        shown = writable[:MOST_PARAMETERS]
        self.parameters = value_rows(RegisterTable.HOLDING_REGISTER, shown, points, allows, PARAMETERS)
        self.rows: tuple[Row, ...] = (
            *(row for row in fixed if row.table is RegisterTable.INPUT_REGISTER),
            *self.inputs,
            *(row for row in fixed if row.table is RegisterTable.HOLDING_REGISTER),
            *self.setpoints,
            *self.parameters,
            *_bit_rows(family, allows),
        )

    def end(self, table: RegisterTable, start: int) -> int:
        """First address behind the block of registers that contains ``start``."""
        if table is not RegisterTable.INPUT_REGISTER and start >= PARAMETERS:
            return PARAMETERS + 2 * len(self.parameters)
        return VALUES + 2 * len(self.inputs if table is RegisterTable.INPUT_REGISTER else self.setpoints)

    def second_halves(self, table: RegisterTable) -> frozenset[int]:
        """Addresses at which no read or write may begin or end, because it would split a value."""
        return frozenset(row.address + 1 for row in self.rows if row.table is table and row.size == 2)


_VALUES_NOT_GOOD: Final = f"bit 0: the first value from {VALUES} on is not good, and so on, up to the 32nd"


def row_maker(table: RegisterTable, access: str) -> Callable[[int, str, str, str, str], Row]:
    def make(address: int, name: str, kind: str, unit: str, description: str) -> Row:
        return Row(table, address, name, kind, access, unit, description)

    return make


def _words(group: str, process: list[str], carried: list[str]) -> dict[int, str]:
    """The words that a drive has beside its control or status word; the register of each is its place in the
    family."""
    return {process.index(word): f"{group}/{word}" for word in carried[1:]}


def _input_rows(actual: Mapping[int, str]) -> list[Row]:
    row = row_maker(RegisterTable.INPUT_REGISTER, "r")
    qualities = ", ".join(f"{quality.value} {quality.label}" for quality in Quality)
    states = "0 not ready, 1 switch-on inhibited, 2 ready, 3 switched on, 4 operation enabled, \
5 quick stop active, 6 fault reaction active, 7 fault, 255 unknown"
    return [
        row(0, "status/status_word", "uint16", "", "status word; shows fault while tripped"),
        *(row(i, leaf, "uint16", "", "actual value, raw") for i, leaf in actual.items()),
        row(9, "status/drive_status_word", "uint16", "", "status word as the drive sent it"),
        row(10, "status/state", "uint16", "", states),
        row(11, "quality", "uint16", "", qualities),
        row(12, "status/emcy_code", "uint16", "", "last emergency code"),
        row(13, "supervision/last_fault", "uint16", "0.1", "last fault × 10: 103 is 10.3"),
        row(14, "supervision/watchdog_state", "uint16", "", "0 off, 1 idle, 2 running, 3 tripped"),
        row(15, "supervision/watchdog_left_ms", "uint16", "ms", "time left on the watchdog"),
        row(16, "supervision/pdo_age_ms", "uint32", "ms", "age of the last PDO; FFFFFFFFh: none yet"),
        row(18, "sdo_abort_code", "uint32", "", "why the drive last refused an SDO of a client; 0: never"),
        row(20, "supervision/owner", "uint16", "", "0 none, 1 opcua, 2 modbus, 3 zenoh, 4 local"),
        row(
            WORDS_NOT_GOOD,
            "words_not_good",
            "uint16",
            "",
            "bit 0: actual value word 1 is not good, and so on",
        ),
        row(VALUES_NOT_GOOD, "values_not_good", "uint32", "", _VALUES_NOT_GOOD),
        row(TELEGRAMS, "supervision/telegrams", "uint16", "", "counts the owner's valid telegrams"),
    ]


def _holding_rows(setpoints: Mapping[int, str], allows: Allows, *, may_set: bool) -> list[Row]:
    row = row_maker(RegisterTable.HOLDING_REGISTER, _access(allows.may_command))
    stop = row_maker(RegisterTable.HOLDING_REGISTER, _access(allows.may_stop))
    timeout = row_maker(RegisterTable.HOLDING_REGISTER, _access(may_set and allows.may_command))
    name, text = "supervision/fieldbus_timeout_ms", "how long the controller may be silent; 0: off (as P151)"
    return [
        row(0, "command/control_word", "uint16", "", "control word"),
        *(row(i, leaf, "uint16", "", "setpoint, raw") for i, leaf in setpoints.items()),
        row(KEEP_ALIVE, "keep_alive", "uint16", "", "not 0: a telegram; 0: release; reads 1 for the owner"),
        row(ACKNOWLEDGE, "acknowledge", "uint16", "", "write 1 to acknowledge a fault; reads 0"),
        timeout(TIMEOUT, name, "uint16", "ms", text),
        stop(STOP, "stop", "uint16", "", "1 stop, 2 quick stop, 3 disable voltage; reads 0"),
    ]


def _life_rows(allows: Allows) -> list[Row]:
    offered = "token to be brought back, another one each second"
    brought = f"what input register {TOKEN} had, not longer ago than register {TIMEOUT}"
    access = _access(allows.may_command)
    return [
        Row(RegisterTable.INPUT_REGISTER, TOKEN, "supervision/life_sign", "uint16", "r", "", offered),
        Row(RegisterTable.HOLDING_REGISTER, LIFE_SIGN, "command/life_sign", "uint16", access, "", brought),
    ]


def value_rows(
    table: RegisterTable, leaves: Iterable[str], points: dict[str, Point], allows: Allows, first: int = VALUES
) -> tuple[Row, ...]:
    """Two registers for each of ``leaves``; integers are not turned into floats, so that no digit is lost."""
    rows: list[Row] = []
    for position, leaf in enumerate(leaves):
        point = points[leaf]
        kind = "uint32"
        if point.data_type is DataType.FLOAT:
            kind = "float32"
        elif point.data_type in (DataType.INT16, DataType.INT32):
            kind = "int32"
        access, place = _access(allows.write(point)), first + 2 * position
        rows.append(Row(table, place, leaf, kind, access, point.unit, str(point.description)))
    return tuple(rows)


def _bit_rows(family: Family, allows: Allows) -> list[Row]:
    status = row_maker(RegisterTable.DISCRETE_INPUT, "r")
    coil = row_maker(RegisterTable.COIL, _access(allows.may_command))
    return [
        *(
            status(i, f"status/{name or i}", "bool", "", _bit_text(i, "status word as served", name))
            for i, name in enumerate(_padded(family.status_word.bits))
        ),
        *(
            status(
                QUALITY_BITS + quality, f"quality/{quality.label}", "bool", "", f"quality is {quality.label}"
            )
            for quality in Quality
        ),
        *(
            coil(i, f"command/{name or i}", "bool", "", _bit_text(i, "control word", name))
            for i, name in enumerate(_padded(family.control_word.bits))
        ),
    ]


def _padded(names: Sequence[str]) -> list[str]:
    """A name for each bit of a word, empty if the family has none."""
    return [*names, *[""] * 16][:16]


def _bit_text(place: int, word: str, name: str) -> str:
    return f"bit {place} of the {word}" + ("" if name else ", which has no name")


class Words32:
    """32-bit values as two registers in the site's word order, and back.

    ABCD is the high word first, each with its high byte first; A is the highest byte.
    """

    def __init__(self, order: WordOrder) -> None:
        self._places = tuple(map("ABCD".index, order))

    def from_int(self, value: int) -> tuple[int, int]:
        """Two registers of an integer, in two's complement."""
        return _REGISTERS.unpack(self._ordered((value & 0xFFFF_FFFF).to_bytes(4, "big")))

    def from_float(self, value: float) -> tuple[int, int]:
        """Two registers of an IEEE 754 single; too large a number becomes infinite."""
        try:
            packed = struct.pack(">f", value)
        except OverflowError:
            packed = struct.pack(">f", math.copysign(math.inf, value))
        return _REGISTERS.unpack(self._ordered(packed))

    def to_float(self, first: int, second: int) -> float:
        return struct.unpack(">f", self._ordered(_REGISTERS.pack(first, second)))[0]

    def to_int(self, first: int, second: int, *, signed: bool) -> int:
        return int.from_bytes(self._ordered(_REGISTERS.pack(first, second)), "big", signed=signed)

    def _ordered(self, data: bytes) -> bytes:
        """Each order is its own inverse."""
        return bytes(data[place] for place in self._places)
