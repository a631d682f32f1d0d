"""Engineering units: from the unit of a point to what OPC UA calls it (Part 8 §5.6.4.3)."""

from __future__ import annotations

from typing import Final

from bridge.text import Text, Words

UNIT_NAMESPACE: Final = "http://www.opcfoundation.org/UA/units/un/cefact"

NO_UNIT_ID: Final = -1
"""The unit id where UNECE has none for the unit."""

# UNECE Recommendation 20, common codes.
_COMMON_CODES: Final = {
    "Hz": ("HTZ", Text.of("unit.hertz")),
    "kHz": ("KHZ", Text.of("unit.kilohertz")),
    "A": ("AMP", Text.of("unit.ampere")),
    "mA": ("4K", Text.of("unit.milliampere")),
    "V": ("VLT", Text.of("unit.volt")),
    "mV": ("2Z", Text.of("unit.millivolt")),
    "W": ("WTT", Text.of("unit.watt")),
    "kW": ("KWT", Text.of("unit.kilowatt")),
    "kWh": ("KWH", Text.of("unit.kilowatt_hour")),
    "%": ("P1", Text.of("unit.percent")),
    "µs": ("B98", Text.of("unit.microsecond")),
    "ms": ("C26", Text.of("unit.millisecond")),
    "s": ("SEC", Text.of("unit.second")),
    "min": ("MIN", Text.of("unit.minute")),
    "h": ("HUR", Text.of("unit.hour")),
    "d": ("DAY", Text.of("unit.day")),
    "rpm": ("RPM", Text.of("unit.revolutions_per_minute")),
    "1/min": ("RPM", Text.of("unit.revolutions_per_minute")),
    "1/s": ("RPS", Text.of("unit.revolutions_per_second")),
    "rev": ("M44", Text.of("unit.revolution")),
    "°": ("DD", Text.of("unit.degree")),
    "rad": ("C81", Text.of("unit.radian")),
    "mm": ("MMT", Text.of("unit.millimetre")),
    "m": ("MTR", Text.of("unit.metre")),
    "µm": ("4H", Text.of("unit.micrometre")),
    "mm/s": ("C16", Text.of("unit.millimetre_per_second")),
    "m/s": ("MTS", Text.of("unit.metre_per_second")),
    "m/s²": ("MSK", Text.of("unit.metre_per_second_squared")),
    "N": ("NEW", Text.of("unit.newton")),
    "Nm": ("NU", Text.of("unit.newton_metre")),
    "kg": ("KGM", Text.of("unit.kilogram")),
    "°C": ("CEL", Text.of("unit.degree_celsius")),
    "K": ("KEL", Text.of("unit.kelvin")),
    "bar": ("BAR", Text.of("unit.bar")),
    "Ω": ("OHM", Text.of("unit.ohm")),
}


def unit_id(unit: str) -> int:
    """The number that Part 8 makes of a UNECE common code, or -1 where ``unit`` has none."""
    known = _COMMON_CODES.get(unit)
    return int.from_bytes(known[0].encode("ascii"), "big") if known else NO_UNIT_ID


def unit_description(unit: str) -> Words:
    known = _COMMON_CODES.get(unit)
    return known[1] if known else unit
