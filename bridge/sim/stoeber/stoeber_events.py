"""Events of a STÖBER inverter of the 5th generation (ID 441684.06 §9.3)."""

from __future__ import annotations

from typing import Final

NO_EVENT: Final = 30
COMMUNICATION: Final = 52
LIFE_GUARDING: Final = 1
"""Cause of event 52: "error control" (§9.4.2)."""
SYNC_MISSING: Final = 2
"""Cause of event 52 that this simulation gives a SYNC missing within 1006h; §6 shows the LED only."""

GENERIC, CURRENT, VOLTAGE, TEMPERATURE, COMMUNICATION_ERROR = 0x01, 0x02, 0x04, 0x08, 0x10

CODES: Final[dict[int, tuple[int, int]]] = {
    31: (0x2110, CURRENT),
    32: (0x2230, CURRENT),
    33: (0x2310, CURRENT),
    34: (0x5000, GENERIC),
    35: (0x6010, GENERIC),
    36: (0x3110, VOLTAGE),
    37: (0x7303, GENERIC),
    38: (0x4210, TEMPERATURE),
    39: (0x4280, TEMPERATURE),
    40: (0x6310, GENERIC),
    41: (0x4310, TEMPERATURE),
    42: (0x7110, TEMPERATURE),
    44: (0x9000, GENERIC),
    45: (0x4380, TEMPERATURE),
    46: (0x3120, VOLTAGE),
    47: (0x8311, GENERIC),
    48: (0x8312, GENERIC),
    49: (0x8331, GENERIC),
    52: (0x8100, COMMUNICATION_ERROR),
    55: (0x5200, GENERIC),
    56: (0x8400, GENERIC),
    57: (0x6100, GENERIC),
    58: (0x2110, CURRENT),
    59: (0x4280, TEMPERATURE),
    **dict.fromkeys(range(60, 68), (0x6200, GENERIC)),
    68: (0x9000, GENERIC),
    69: (0x7120, GENERIC),
    70: (0x6300, GENERIC),
}
"""Event number (E82) to error code and error register. The worked example of §9.3 sends event 41 with code
1000h and register 1; the table counts."""

_VOLTAGE_OFF: Final = frozenset({31, 32, 33, 34, 35, 36, 37, 46, 56, 57, 58, 69})


def brakes(event: int) -> bool:
    """Whether the motor can still be stopped with voltage when this event comes."""
    return event not in _VOLTAGE_OFF
