"""EMCY codes of drive faults (BU 2500 §8.3.3) and the error register they set (CiA 301 §7.5.2.2)."""

from __future__ import annotations

from typing import Final

UNKNOWN_CODE: Final = 0x1000
"""The interface does not know the drive's fault number; it is in P700."""

TELEGRAM_DOWNTIME: Final = 102
"""10.2: the NMT master's life time or P513 has expired (the older BU 0260 distinguishes it from 10.3 in this
way)."""
BUS_TIMEOUT: Final = 103
"""10.3, P151."""
LINK_BROKEN: Final = 108
"""10.8: the connection between the SK TU3-CAO and its drive is lost."""
INTERFACE_MISSING: Final = 109
"""10.9: the drive does not reach the bus interface on the system bus."""

INTERFACE_BUS_TIMEOUT: Final = 1020
"""102.0 in P170: P151 has expired."""
INTERFACE_CANOPEN_TIMEOUT: Final = 5120
"""512.0 in P170: node guarding has expired."""

# Fault number × 10 → code. 3.2 and 3.3 are in the table twice (2211h/2311h, 2212h/2312h); the first counts.
_CODES: Final = {
    40: 0x2200,
    41: 0x2200,
    32: 0x2211,
    33: 0x2212,
    30: 0x2310,
    51: 0x3110,
    61: 0x3120,
    70: 0x3130,
    50: 0x3210,
    60: 0x3230,
    10: 0x4210,
    20: 0x4310,
    21: 0x4310,
    108: 0x5000,
    110: 0x5110,
    170: 0x5300,
    200: 0x5510,
    208: 0x5520,
    81: 0x5530,
    82: 0x5530,
    **dict.fromkeys((*range(201, 208), 209, *range(210, 214)), 0x6000),
    80: 0x6310,
    31: 0x7112,
    160: 0x7120,
    161: 0x7120,
    143: 0x7300,
    130: 0x7305,
    144: 0x7306,
    145: 0x7310,
    146: 0x7320,
    147: 0x7320,
    148: 0x7320,
    250: 0x7330,
    251: 0x7331,
    252: 0x7332,
    253: 0x7333,
    254: 0x7334,
    **dict.fromkeys(range(100, 108), 0x8100),
    132: 0x8300,
    131: 0x8400,
    140: 0x8600,
    141: 0x8600,
    142: 0x8612,
    135: 0x8710,
    136: 0x8711,
    120: 0x9000,
    121: 0x9000,
    122: 0x9000,
    180: 0xFF10,
    190: 0xFF11,
}

_REGISTER_BITS: Final = {0x2: 0x02, 0x3: 0x04, 0x4: 0x08, 0x8: 0x10, 0xF: 0x80}
"""Leading digit of the code → current, voltage, temperature, communication, manufacturer specific."""


def emcy_code(fault_tenths: int) -> int:
    """Error code of a drive fault given as P700 shows it (E010/10.3 → 103)."""
    return _CODES.get(fault_tenths, UNKNOWN_CODE)


def register_bits(code: int) -> int:
    """The bits that this error sets in 1001h: the generic one and that of its group."""
    return 0x01 | _REGISTER_BITS.get(code >> 12, 0)
