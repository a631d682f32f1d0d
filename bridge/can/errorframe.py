"""Decoder of SocketCAN's error frames (<linux/can/error.h>). Sans-IO.

An error frame is not on the wire: the driver makes it from what the controller reports.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Final, NamedTuple

from bridge.text import Text

_TX_TIMEOUT: Final = 0x001
_LOST_ARBITRATION: Final = 0x002
_CONTROLLER: Final = 0x004
_PROTOCOL: Final = 0x008
_TRANSCEIVER: Final = 0x010
_NO_ACK: Final = 0x020
_BUS_OFF: Final = 0x040
_BUS_ERROR: Final = 0x080
_RESTARTED: Final = 0x100
_COUNTERS: Final = 0x200

_WARNING: Final = 0x04 | 0x08
_PASSIVE: Final = 0x10 | 0x20
_ACTIVE: Final = 0x40
_CONTROLLER_TEXTS: Final = (
    Text.of("can_error.receive_overflow"),
    Text.of("can_error.transmit_overflow"),
    Text.of("can_error.receive_warning"),
    Text.of("can_error.transmit_warning"),
    Text.of("can_error.receive_passive"),
    Text.of("can_error.transmit_passive"),
    Text.of("can_error.active_again"),
)
_PROTOCOL_TEXTS: Final = (
    Text.of("can_error.bit"),
    Text.of("can_error.form"),
    Text.of("can_error.stuff"),
    Text.of("can_error.no_dominant"),
    Text.of("can_error.no_recessive"),
    Text.of("can_error.overload"),
    Text.of("can_error.announced"),
    Text.of("can_error.transmitting"),
)
_LOCATIONS: Final = {
    0x02: Text.of("can_place.identifier_bits", bits="10-3"),
    0x03: Text.of("can_place.start_of_frame"),
    0x04: Text.of("can_place.rtr"),
    0x05: Text.of("can_place.ide"),
    0x06: Text.of("can_place.identifier_bits", bits="2-0"),
    0x07: Text.of("can_place.identifier_bits", bits="17-13"),
    0x08: "CRC",
    0x09: Text.of("can_place.reserved_bit", bit=0),
    0x0A: Text.of("can_place.data"),
    0x0B: Text.of("can_place.length"),
    0x0C: Text.of("can_place.rtr"),
    0x0D: Text.of("can_place.reserved_bit", bit=1),
    0x0E: Text.of("can_place.identifier_bits", bits="4-0"),
    0x0F: Text.of("can_place.identifier_bits", bits="12-5"),
    0x12: Text.of("can_place.intermission"),
    0x18: Text.of("can_place.crc_delimiter"),
    0x19: Text.of("can_place.ack_slot"),
    0x1A: Text.of("can_place.end_of_frame"),
    0x1B: Text.of("can_place.ack_delimiter"),
}
_WIRE_FAULTS: Final = {
    0x04: Text.of("can_error.canh_broken"),
    0x05: Text.of("can_error.canh_battery"),
    0x06: Text.of("can_error.canh_supply"),
    0x07: Text.of("can_error.canh_ground"),
    0x40: Text.of("can_error.canl_broken"),
    0x50: Text.of("can_error.canl_battery"),
    0x60: Text.of("can_error.canl_supply"),
    0x70: Text.of("can_error.canl_ground"),
    0x80: Text.of("can_error.canl_canh"),
}


class ControllerState(IntEnum):
    """Fault confinement state of the CAN controller (ISO 11898-1), numbered as the Modbus register."""

    OK = 0
    WARNING = 1
    PASSIVE = 2
    BUS_OFF = 3
    DOWN = 4


class ErrorNews(NamedTuple):
    """Changes reported by an error frame: the state (None: unchanged) and both error counters (None: not
    reported)."""

    state: ControllerState | None
    counters: tuple[int, int] | None


def judge(can_id: int, data: bytes) -> ErrorNews:
    """The news in an error frame with these eight bytes."""
    counters = (data[6], data[7]) if can_id & _COUNTERS else None
    state = None
    if can_id & _BUS_OFF:
        state = ControllerState.BUS_OFF
    elif can_id & _CONTROLLER and data[1] & _PASSIVE:
        state = ControllerState.PASSIVE
    elif can_id & _CONTROLLER and data[1] & _WARNING:
        state = ControllerState.WARNING
    elif can_id & _RESTARTED or (can_id & _CONTROLLER and data[1] & _ACTIVE):
        state = ControllerState.OK
    return ErrorNews(state, counters)


def describe(can_id: int, data: bytes) -> Text:
    """An error frame in words, its classes in the order of <linux/can/error.h>."""
    found: list[Text] = []
    if can_id & _TX_TIMEOUT:
        found.append(Text.of("can_error.transmission_timed_out"))
    if can_id & _LOST_ARBITRATION:
        found.append(_lost_arbitration(data[0]))
    if can_id & _CONTROLLER:
        found += _bits(data[1], _CONTROLLER_TEXTS) or [Text.of("can_error.controller")]
    if can_id & _PROTOCOL:
        found.append(_protocol_violation(data))
    if can_id & _TRANSCEIVER:
        found.append(_WIRE_FAULTS.get(data[4], Text.of("can_error.transceiver")))
    if can_id & _NO_ACK:
        found.append(Text.of("can_error.no_acknowledge"))
    if can_id & _BUS_OFF:
        found.append(Text.word("controller_state", "bus-off"))
    if can_id & _BUS_ERROR and not can_id & (_PROTOCOL | _NO_ACK):
        found.append(Text.of("can_error.bus"))
    if can_id & _RESTARTED:
        found.append(Text.of("can_error.restarted"))
    if can_id & _COUNTERS:
        found.append(Text.of("can_error.counters", transmit=data[6], receive=data[7]))
    return Text.of("can_error.several", errors=tuple(found or [Text.of("can_error.unspecified")]))


def _lost_arbitration(bit: int) -> Text:
    return Text.of("can_error.arbitration_lost_in", bit=bit) if bit else Text.of("can_error.arbitration_lost")


def _protocol_violation(data: bytes) -> Text:
    errors = tuple(_bits(data[2], _PROTOCOL_TEXTS) or [Text.of("can_error.protocol")])
    place = _LOCATIONS.get(data[3])
    if place is None:
        return Text.of("can_error.violations", errors=errors)
    return Text.of("can_error.violations_in", errors=errors, place=place)


def _bits(octet: int, texts: tuple[Text, ...]) -> list[Text]:
    return [text for number, text in enumerate(texts) if octet >> number & 1]
