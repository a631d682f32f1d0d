"""What LSS messages say (CiA 305), for those who only listen. Sans-IO."""

from __future__ import annotations

import struct
from typing import Final

from bridge.canopen.lss import AUTOMATIC, BIT_RATES, FIELDS, NO_NODE_ID, error_text

Facts = tuple[tuple[str, int | str], ...]
"""The facts of a message by name, for scripts."""

_LENGTH: Final = 8
_U32: Final = struct.Struct("<I")
_U16: Final = struct.Struct("<H")
_FASTSCAN: Final = struct.Struct("<IBBB")
_NODE_ID: Final = 0x11
_BIT_TIMING: Final = 0x13
_STORE: Final = 0x17
_CONFIRM: Final = 0x80
_MOST_BIT: Final = 31
_STATES: Final = {0: "waiting", 1: "configuration"}
_CONFIGURE: Final = {
    _NODE_ID: "configure node id",
    _BIT_TIMING: "configure bit timing",
    _STORE: "store configuration",
}
"""What is answered with an error code."""
_NUMBERS: Final = (
    {0x40 + place: f"switch selective: {name}" for place, name in enumerate(FIELDS)}
    | {0x46: "identify: vendor id", 0x47: "identify: product code"}
    | {0x48: "identify: lowest revision number", 0x49: "identify: highest revision number"}
    | {0x4A: "identify: lowest serial number", 0x4B: "identify: highest serial number"}
)
"""What carries a number of 32 bits."""
_INQUIRIES: Final = {0x5A + place: f"inquire {name}" for place, name in enumerate(FIELDS)}
_BARE: Final = {
    0x44: "switch selective: selected",
    0x4C: "identify: whoever has no node id",
    0x4F: "identified",
    0x50: "identified: it has no node id",
}
"""What carries nothing."""


def said(data: bytes, *, by_master: bool) -> tuple[str, Facts]:
    """A message in words, and its facts. ``by_master``: sent by the LSS master, on 7E5h."""
    if len(data) != _LENGTH:
        return f"{len(data)} byte{'' if len(data) == 1 else 's'} instead of 8", ()
    command = data[0]
    number: int = _U32.unpack_from(data, 1)[0]
    if command in _BARE:
        return _BARE[command], ()
    if command in _NUMBERS:
        return f"{_NUMBERS[command]} {number:08X}h", (("number", number),)
    if command in _INQUIRIES:
        name = _INQUIRIES[command]
        return (name, ()) if by_master else (f"{name}: {number:08X}h", (("number", number),))
    if command in _CONFIGURE and not by_master:
        return f"{_CONFIGURE[command]}: {error_text(data) or 'done'}", (("error", data[1]),)
    match command:
        case 0x04:
            state = _STATES.get(data[1])
            text = f"switch state global: {state or f'unknown state {data[1]}'}"
            return text, (("state", state),) if state else ()
        case 0x11:
            return f"{_CONFIGURE[_NODE_ID]}: {_node_id(data[1])}", (("node_id", data[1]),)
        case 0x13:
            return _bit_timing(data[1], data[2])
        case 0x15:
            delay_ms: int = _U16.unpack_from(data, 1)[0]
            return f"activate bit timing: after {delay_ms} ms", (("delay_ms", delay_ms),)
        case 0x17:
            return _CONFIGURE[_STORE], ()
        case 0x51:
            return _fastscan(data)
        case 0x5E:
            if by_master:
                return "inquire node id", ()
            return f"inquire node id: {_node_id(data[1])}", (("node_id", data[1]),)
        case _:
            return f"command {command:02X}h: {data[1:].hex(' ').upper()}", ()


def _node_id(number: int) -> str:
    return "none" if number == NO_NODE_ID else str(number)


def _bit_timing(table: int, index: int) -> tuple[str, Facts]:
    name, place = "configure bit timing", f"table {table}, index {index}"
    rate = BIT_RATES[index] if table == 0 and index < len(BIT_RATES) else None
    if rate:
        return f"{name}: {rate} bit/s ({place})", (("bit_rate", rate),)
    if table == 0 and index == AUTOMATIC:
        return f"{name}: automatic ({place})", ()
    return f"{name}: {place}", ()


def _fastscan(data: bytes) -> tuple[str, Facts]:
    """A question: does the number fit from this bit up? The bits below are not compared."""
    number, bit, field, _ = _FASTSCAN.unpack_from(data, 1)
    if bit == _CONFIRM:
        return "fastscan: is anybody there?", ()
    if bit > _MOST_BIT or field >= len(FIELDS):
        return f"fastscan: {data[1:].hex(' ').upper()}", ()
    text = f"fastscan: {FIELDS[field]}, bits {bit}…{_MOST_BIT} as in {number:08X}h"
    return text, (("number", number), ("bit", bit))
