"""Engineering units: from the unit of a point to what OPC UA calls it (Part 8 §5.6.4.3)."""

from __future__ import annotations

from typing import Final

UNIT_NAMESPACE: Final = "http://www.opcfoundation.org/UA/units/un/cefact"

NO_UNIT_ID: Final = -1
"""The unit id where UNECE has none for the unit."""

# UNECE Recommendation 20, common codes.
_COMMON_CODES: Final = {
    "Hz": ("HTZ", "hertz"),
    "kHz": ("KHZ", "kilohertz"),
    "A": ("AMP", "ampere"),
    "mA": ("4K", "milliampere"),
    "V": ("VLT", "volt"),
    "mV": ("2Z", "millivolt"),
    "W": ("WTT", "watt"),
    "kW": ("KWT", "kilowatt"),
    "kWh": ("KWH", "kilowatt hour"),
    "%": ("P1", "percent"),
    "µs": ("B98", "microsecond"),
    "ms": ("C26", "millisecond"),
    "s": ("SEC", "second"),
    "min": ("MIN", "minute"),
    "h": ("HUR", "hour"),
    "d": ("DAY", "day"),
    "rpm": ("RPM", "revolutions per minute"),
    "1/min": ("RPM", "revolutions per minute"),
    "1/s": ("RPS", "revolutions per second"),
    "rev": ("M44", "revolution"),
    "°": ("DD", "degree"),
    "rad": ("C81", "radian"),
    "mm": ("MMT", "millimetre"),
    "m": ("MTR", "metre"),
    "µm": ("4H", "micrometre"),
    "mm/s": ("C16", "millimetre per second"),
    "m/s": ("MTS", "metre per second"),
    "m/s²": ("MSK", "metre per second squared"),
    "N": ("NEW", "newton"),
    "Nm": ("NU", "newton metre"),
    "kg": ("KGM", "kilogram"),
    "°C": ("CEL", "degree Celsius"),
    "K": ("KEL", "kelvin"),
    "bar": ("BAR", "bar"),
    "Ω": ("OHM", "ohm"),
}


def unit_id(unit: str) -> int:
    """The number that Part 8 makes of a UNECE common code, or -1 where ``unit`` has none."""
    known = _COMMON_CODES.get(unit)
    return int.from_bytes(known[0].encode("ascii"), "big") if known else NO_UNIT_ID


def unit_description(unit: str) -> str:
    known = _COMMON_CODES.get(unit)
    return known[1] if known else unit
