"""Emergency error codes in the words of CiA 301 (§7.2.7.1): for those that a family has no text for."""

from __future__ import annotations

from typing import Final

UNKNOWN: Final = "unknown code"

_CODES: Final = {
    0x8110: "CAN overrun (objects lost)",
    0x8120: "CAN in error passive mode",
    0x8130: "life guard error or heartbeat error",
    0x8140: "recovered from bus off",
    0x8150: "CAN-ID collision",
    0x8210: "PDO not processed due to length error",
    0x8220: "PDO length exceeded",
    0x8230: "DAM MPDO not processed, destination object not available",
    0x8240: "unexpected SYNC data length",
    0x8250: "RPDO timeout",
}
_GROUPS: Final = {
    0x00: "no error",
    0x10: "generic error",
    0x20: "current",
    0x21: "current, device input side",
    0x22: "current inside the device",
    0x23: "current, device output side",
    0x30: "voltage",
    0x31: "mains voltage",
    0x32: "voltage inside the device",
    0x33: "output voltage",
    0x40: "temperature",
    0x41: "ambient temperature",
    0x42: "device temperature",
    0x50: "device hardware",
    0x60: "device software",
    0x61: "internal software",
    0x62: "user software",
    0x63: "data set",
    0x70: "additional modules",
    0x80: "monitoring",
    0x81: "communication",
    0x82: "protocol error",
    0x90: "external error",
    0xF0: "additional functions",
    0xFF: "device specific",
}
"""By the code's high byte."""
_LAST_CLASS: Final = 0x90
"""Up to here the first digit is a class of its own: 43xxh has to do with temperature, whatever it is."""

_REGISTER: Final = (
    "generic error",
    "current",
    "voltage",
    "temperature",
    "communication",
    "device profile",
    "",
    "manufacturer",
)
"""Bits of the error register, 1001h (CiA 301 §7.5.2.2); bit 6 is reserved."""


def text(code: int) -> str:
    """What CiA 301 says of this code, or of the nearest group that it belongs to."""
    high = code >> 8
    found = _CODES.get(code) or _GROUPS.get(high)
    if found is None and high & 0xF0 <= _LAST_CLASS:
        found = _GROUPS[high & 0xF0] if high & 0xF0 else None
    return found or UNKNOWN


def register_text(register: int) -> str:
    """The error register in words: ``generic error, communication``."""
    names = [name or f"bit {bit}" for bit, name in enumerate(_REGISTER) if register >> bit & 1]
    return ", ".join(names) or "no error"
