"""Emergency error codes in the words of CiA 301 (§7.2.7.1), for those that a family has no text for."""

from __future__ import annotations

from typing import Final

from bridge.text import Text

UNKNOWN: Final = Text.of("emcy.unknown")

_CODES: Final = {
    0x8110: Text.of("emcy.overrun"),
    0x8120: Text.of("emcy.error_passive"),
    0x8130: Text.of("emcy.heartbeat"),
    0x8140: Text.of("emcy.bus_off_over"),
    0x8150: Text.of("emcy.id_collision"),
    0x8210: Text.of("emcy.pdo_length"),
    0x8220: Text.of("emcy.pdo_too_long"),
    0x8230: Text.of("emcy.mpdo"),
    0x8240: Text.of("emcy.sync_length"),
    0x8250: Text.of("emcy.rpdo_timeout"),
}
_GROUPS: Final = {
    0x00: Text.of("emcy.none"),
    0x10: Text.of("emcy.generic"),
    0x20: Text.of("emcy.current"),
    0x21: Text.of("emcy.input_current"),
    0x22: Text.of("emcy.inner_current"),
    0x23: Text.of("emcy.output_current"),
    0x30: Text.of("emcy.voltage"),
    0x31: Text.of("emcy.mains_voltage"),
    0x32: Text.of("emcy.inner_voltage"),
    0x33: Text.of("emcy.output_voltage"),
    0x40: Text.of("emcy.temperature"),
    0x41: Text.of("emcy.ambient_temperature"),
    0x42: Text.of("emcy.device_temperature"),
    0x50: Text.of("emcy.hardware"),
    0x60: Text.of("emcy.software"),
    0x61: Text.of("emcy.internal_software"),
    0x62: Text.of("emcy.user_software"),
    0x63: Text.of("emcy.data_set"),
    0x70: Text.of("emcy.modules"),
    0x80: Text.of("emcy.monitoring"),
    0x81: Text.of("emcy.communication"),
    0x82: Text.of("emcy.protocol"),
    0x90: Text.of("emcy.external"),
    0xF0: Text.of("emcy.functions"),
    0xFF: Text.of("emcy.device_specific"),
}
"""Groups of codes, by their high byte."""
_LAST_CLASS: Final = 0x90
"""Last high byte whose first digit is a class of its own: 43xxh has to do with temperature, whatever it
is."""

_REGISTER: Final = (
    Text.of("emcy.generic"),
    Text.of("emcy.current"),
    Text.of("emcy.voltage"),
    Text.of("emcy.temperature"),
    Text.of("emcy.communication"),
    Text.of("emcy.profile"),
    Text.of("emcy.register_bit", bit=6),
    Text.of("emcy.manufacturer"),
)
"""Bits of the error register, 1001h (CiA 301 §7.5.2.2); bit 6 is reserved."""


def text(code: int) -> Text:
    """Text of CiA 301 for this code, or for the nearest group that it belongs to."""
    high = code >> 8
    found = _CODES.get(code) or _GROUPS.get(high)
    if found is None and high & 0xF0 <= _LAST_CLASS:
        found = _GROUPS[high & 0xF0] if high & 0xF0 else None
    return found or UNKNOWN


def register_text(register: int) -> Text:
    """Error register in words: ``generic error, communication``."""
    bits = tuple(said for bit, said in enumerate(_REGISTER) if register >> bit & 1)
    return Text.of("emcy.register", bits=bits) if bits else Text.of("emcy.none")
