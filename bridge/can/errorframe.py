"""Decoder of SocketCAN's error frames (<linux/can/error.h>). Sans-IO.

An error frame is not on the wire: the driver makes it from what the controller reports.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Final, NamedTuple

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
    "receive buffer overflow",
    "transmit buffer overflow",
    "warning level reached for receive errors",
    "warning level reached for transmit errors",
    "error passive, receiving",
    "error passive, transmitting",
    "error active again",
)
_PROTOCOL_TEXTS: Final = (
    "bit error",
    "form error",
    "stuff error",
    "cannot send a dominant bit",
    "cannot send a recessive bit",
    "overload",
    "active error announced",
    "while transmitting",
)
_LOCATIONS: Final = {
    0x02: "identifier bits 10-3",
    0x03: "start of frame",
    0x04: "RTR bit",
    0x05: "IDE bit",
    0x06: "identifier bits 2-0",
    0x07: "identifier bits 17-13",
    0x08: "CRC",
    0x09: "reserved bit 0",
    0x0A: "data",
    0x0B: "data length code",
    0x0C: "RTR bit",
    0x0D: "reserved bit 1",
    0x0E: "identifier bits 4-0",
    0x0F: "identifier bits 12-5",
    0x12: "intermission",
    0x18: "CRC delimiter",
    0x19: "ACK slot",
    0x1A: "end of frame",
    0x1B: "ACK delimiter",
}
_WIRE_FAULTS: Final = {
    0x04: "CANH broken",
    0x05: "CANH shorted to the battery",
    0x06: "CANH shorted to the supply",
    0x07: "CANH shorted to ground",
    0x40: "CANL broken",
    0x50: "CANL shorted to the battery",
    0x60: "CANL shorted to the supply",
    0x70: "CANL shorted to ground",
    0x80: "CANL shorted to CANH",
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


def describe(can_id: int, data: bytes) -> str:
    """An error frame in words, its classes in the order of <linux/can/error.h>."""
    found: list[str] = []
    if can_id & _TX_TIMEOUT:
        found.append("transmission timed out")
    if can_id & _LOST_ARBITRATION:
        found.append(f"arbitration lost in bit {data[0]}" if data[0] else "arbitration lost")
    if can_id & _CONTROLLER:
        found += _bits(data[1], _CONTROLLER_TEXTS) or ["controller problem"]
    if can_id & _PROTOCOL:
        place = _LOCATIONS.get(data[3])
        found.append(
            ", ".join(_bits(data[2], _PROTOCOL_TEXTS) or ["protocol violation"])
            + (f" in {place}" if place else "")
        )
    if can_id & _TRANSCEIVER:
        found.append(_WIRE_FAULTS.get(data[4], "transceiver fault"))
    if can_id & _NO_ACK:
        found.append("no acknowledge: nobody else on the bus, or another bit rate")
    if can_id & _BUS_OFF:
        found.append("bus-off")
    if can_id & _BUS_ERROR and not can_id & (_PROTOCOL | _NO_ACK):
        found.append("bus error")
    if can_id & _RESTARTED:
        found.append("controller restarted")
    if can_id & _COUNTERS:
        found.append(f"{data[6]} transmit and {data[7]} receive errors")
    return "; ".join(found) or "unspecified error"


def _bits(octet: int, texts: tuple[str, ...]) -> list[str]:
    return [text for number, text in enumerate(texts) if octet >> number & 1]
