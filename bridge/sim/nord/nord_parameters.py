"""Parameters of one NORD inverter and their sub-indices (BU 2500 §6.6)."""

from __future__ import annotations

import copy
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

from bridge.sim.core.dictionary import Dictionary, IntegerType, Number

PARAMETER_BASE: Final = 0x2000
SETS: Final = 4


@dataclass(frozen=True, slots=True)
class NordParameter:
    """A settable parameter. ``defaults`` has one raw value per array element; ``unit`` is one raw step.

    ``per_set``: the parameter has a value for each of the four parameter sets.
    """

    number: int
    defaults: tuple[int, ...]
    low: int
    high: int
    unit: float = 1.0
    per_set: bool = False

    @property
    def is_plain(self) -> bool:
        """Neither array nor set: its sub-index is 0."""
        return len(self.defaults) == 1 and not self.per_set


PARAMETERS: Final = (
    NordParameter(102, (200,), 0, 32000, unit=0.01, per_set=True),  # acceleration time, s
    NordParameter(103, (200,), 0, 32000, unit=0.01, per_set=True),  # deceleration time, s
    NordParameter(104, (0,), 0, 4000, unit=0.1, per_set=True),  # minimum frequency, Hz
    NordParameter(105, (500,), 1, 4000, unit=0.1, per_set=True),  # maximum frequency, Hz
    NordParameter(112, (100,), 1, 32767, unit=0.1, per_set=True),  # torque current limit, A (see NordDrive)
    NordParameter(113, (0,), -4000, 4000, unit=0.1, per_set=True),  # jog frequency, Hz
    NordParameter(120, (1, 1, 1, 1), 0, 2),  # option supervision
    NordParameter(426, (10,), 0, 32000, unit=0.01, per_set=True),  # quick stop time, s
    NordParameter(509, (3,), 0, 10),  # source of the control word; 3 = system bus (§7.2)
    NordParameter(510, (0, 0), 0, 10),  # source of the setpoints; 0 = as P509
    NordParameter(513, (10,), -1, 1000, unit=0.1),  # telegram downtime, s; -0.1 = ignore
    NordParameter(514, (5,), 0, 7),  # bit rate of the system bus; 5 = 250 kbit/s (§7.2)
    NordParameter(515, (32, 32, 32), 0, 255),  # its addresses
    NordParameter(543, (1, 3, 5, 0, 0), 0, 57, per_set=True),  # meaning of the actual values
    NordParameter(546, (1, 0, 0, 0, 0), 0, 57, per_set=True),  # meaning of the setpoints
    NordParameter(560, (1,), 0, 2),  # 0 = changes go to RAM only, 1 = to the EEPROM too
    NordParameter(600, (0,), 0, 2, per_set=True),  # position control, see nord_posicon
    NordParameter(604, (0,), 0, 17),  # encoder for positions
    NordParameter(607, (1, 1, 1), 1, 32000),  # ratio, and
    NordParameter(608, (1, 1, 1), 1, 32000),  # reduction of positions, see nord_posicon
)

_ON_SYSTEM_BUS: Final = (120, 509, 543, 546)
_DIRECT: Final = (
    *(parameter for parameter in PARAMETERS if parameter.number not in _ON_SYSTEM_BUS),
    NordParameter(509, (6,), 0, 10),  # 6 = CANopen (§7.2)
)
SK_5XXE: Final = (
    *_DIRECT,
    *(NordParameter(543 + place, (value,), 0, 57, per_set=True) for place, value in enumerate((1, 3, 5))),
    *(NordParameter(546 + place, (value,), 0, 57, per_set=True) for place, value in enumerate((1, 0, 0))),
)
"""SK 500E…535E: P543…P545 and P546…P548 without elements (§6.5.4)."""
SK_54XE: Final = (*_DIRECT, *(parameter for parameter in PARAMETERS if parameter.number in (543, 546)))

_SAVE_TO_EEPROM: Final = 560
_PLAIN_VALUES: Final = 3

Values = dict[tuple[int, int, int], int]
"""Raw values by number, element and set, the last two counted from 1."""


def sub_index(element: int, parameter_set: int) -> int:
    """Sub-index of an array element in a parameter set, both from 1 (BU 2500 §6.6.1)."""
    return 4 * (element - 1) + parameter_set


class NordParameters:
    """RAM and EEPROM of a drive's parameters."""

    def __init__(self, parameters: Sequence[NordParameter] = PARAMETERS) -> None:
        self._by_number = {parameter.number: parameter for parameter in parameters}
        self._eeprom: Values = {}
        for parameter in parameters:
            for element, default in enumerate(parameter.defaults, start=1):
                for parameter_set in range(1, SETS + 1):
                    self._eeprom[parameter.number, element, parameter_set] = default
        self._ram = copy.copy(self._eeprom)
        self.eeprom_writes = 0
        self.changes = 0
        """Number of times that any of them may have got another value."""

    def power_on(self) -> None:
        self._ram = copy.copy(self._eeprom)
        self.changes += 1

    def raw(self, number: int, element: int = 1, parameter_set: int = 1) -> int:
        return self._ram[number, element, parameter_set]

    def value(self, number: int, parameter_set: int = 1) -> float:
        """Element 1 in engineering units."""
        return self.raw(number, 1, parameter_set) * self._by_number[number].unit

    def meaning(self, number: int, value: int, parameter_set: int) -> int:
        """The meaning of actual value (P543) or setpoint (P546) number ``value``, from 1: an element of that
        parameter, or in an SK 500E…535E one of the three parameters from that number on. 0 is none."""
        by_elements = len(self._by_number[number].defaults) > 1
        key = (number, value, parameter_set) if by_elements else (number + value - 1, 1, parameter_set)
        return self._ram.get(key, 0) if by_elements or value <= _PLAIN_VALUES else 0

    def commission(self, number: int, value: float, element: int | None = None) -> None:
        """Set all sets, and all elements or one, as at commissioning, before the drive was connected to the
        bus.

        Raises ``KeyError`` for a parameter the simulation does not have and ``ValueError`` out of range.
        """
        parameter = self._by_number[number]
        raw = round(value / parameter.unit)
        if not parameter.low <= raw <= parameter.high:
            low, high = parameter.low * parameter.unit, parameter.high * parameter.unit
            raise ValueError(f"P{number} = {value:g} is outside {low:g} … {high:g}")
        elements = range(1, len(parameter.defaults) + 1) if element is None else (element,)
        for one in elements:
            for parameter_set in range(1, SETS + 1):
                self._eeprom[number, one, parameter_set] = raw
                self._ram[number, one, parameter_set] = raw
        self.changes += 1

    def at_keypad(self, number: int, raw: int, *, element: int = 1, parameter_set: int = 1) -> None:
        """Set a parameter at the drive itself: it goes to the EEPROM, unless P560 says RAM only."""
        self._ram[number, element, parameter_set] = raw
        self.changes += 1
        if self.raw(_SAVE_TO_EEPROM) == 1:
            self._eeprom[number, element, parameter_set] = raw

    def write(self, parameter: NordParameter, element: int, parameter_set: int, raw: int) -> None:
        """A write over the bus: to the EEPROM too, unless P560 says RAM only (§6.6: 100 000 cycles)."""
        sets = (parameter_set,) if parameter.per_set else range(1, SETS + 1)
        to_eeprom = self.raw(_SAVE_TO_EEPROM) == 1 or parameter.number == _SAVE_TO_EEPROM
        for one in sets:
            self._ram[parameter.number, element, one] = raw
            if to_eeprom:
                self._eeprom[parameter.number, element, one] = raw
        self.changes += 1
        self.eeprom_writes += to_eeprom

    def add_to(self, dictionary: Dictionary) -> None:
        """Put every parameter into ``dictionary`` at 2000h + number."""
        for parameter in self._by_number.values():
            index = PARAMETER_BASE + parameter.number
            if parameter.is_plain:
                dictionary.add(index, 0, self._entry(parameter, 1, 1))
                continue
            for element in range(1, len(parameter.defaults) + 1):
                for parameter_set in range(1, SETS + 1):
                    entry = self._entry(parameter, element, parameter_set)
                    dictionary.add(index, sub_index(element, parameter_set), entry)

    def _entry(self, parameter: NordParameter, element: int, parameter_set: int) -> Number:
        return Number(
            IntegerType.INTEGER16,
            lambda: self.raw(parameter.number, element, parameter_set),
            lambda raw: self.write(parameter, element, parameter_set, raw),
            low=parameter.low,
            high=parameter.high,
        )


def add_display(dictionary: Dictionary, number: int, elements: int, read: Callable[[int], int]) -> None:
    """A display parameter: ``read`` gets the element from 1. It is the same in every parameter set."""

    def entry(element: int) -> Number:
        return Number(IntegerType.INTEGER16, lambda: read(element))

    for element in range(1, elements + 1):
        for parameter_set in range(1, SETS + 1):
            dictionary.add(PARAMETER_BASE + number, sub_index(element, parameter_set), entry(element))
