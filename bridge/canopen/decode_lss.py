"""Decodes LSS messages (CiA 305) for listeners. Sans-IO."""

from __future__ import annotations

from typing import Final

from bridge.canopen import lss

Facts = tuple[tuple[str, int | str], ...]
"""The facts of a message by name, for scripts."""

_LENGTH: Final = 8
_MOST_BIT: Final = 31
_STATES: Final = {0: "waiting", 1: "configuration"}
_CONFIGURE: Final = {
    lss.NODE_ID: "configure node id",
    lss.BIT_TIMING: "configure bit timing",
    lss.STORE: "store configuration",
}
"""Commands that are answered with an error code."""
_NUMBERS: Final = (
    {lss.SELECT[sub]: f"switch selective: {name}" for sub, name in enumerate(lss.FIELDS)}
    | {0x46: "identify: vendor id", 0x47: "identify: product code"}
    | {0x48: "identify: lowest revision number", 0x49: "identify: highest revision number"}
    | {0x4A: "identify: lowest serial number", 0x4B: "identify: highest serial number"}
)
"""Commands with a 32-bit number."""
_INQUIRIES: Final = {lss.INQUIRE[sub]: f"inquire {name}" for sub, name in enumerate(lss.FIELDS)}
_BARE: Final = {
    lss.SELECTED: "switch selective: selected",
    0x4C: "identify: whoever has no node id",
    lss.IDENTIFIED: "identified",
    0x50: "identified: it has no node id",
}
"""Commands without data."""


def said(data: bytes, *, by_master: bool) -> tuple[str, Facts]:
    """A message in words, and its facts. ``by_master``: sent by the LSS master, on 7E5h."""
    if len(data) != _LENGTH:
        return f"{len(data)} byte{'' if len(data) == 1 else 's'} instead of 8", ()
    command = data[0]
    number: int = lss.U32.unpack_from(data, 1)[0]
    if command in _BARE:
        return _BARE[command], ()
    if command in _NUMBERS:
        return f"{_NUMBERS[command]} {number:08X}h", (("number", number),)
    if command in _INQUIRIES:
        name = _INQUIRIES[command]
        return (name, ()) if by_master else (f"{name}: {number:08X}h", (("number", number),))
    if command in _CONFIGURE and not by_master:
        return f"{_CONFIGURE[command]}: {lss.error_text(data) or 'done'}", (("error", data[1]),)
    match command:
        case lss.SWITCH_GLOBAL:
            state = _STATES.get(data[1])
            text = f"switch state global: {state or f'unknown state {data[1]}'}"
            return text, (("state", state),) if state else ()
        case lss.NODE_ID:
            return f"{_CONFIGURE[lss.NODE_ID]}: {_node_id(data[1])}", (("node_id", data[1]),)
        case lss.BIT_TIMING:
            return _bit_timing(data[1], data[2])
        case lss.ACTIVATE:
            delay_ms: int = lss.U16.unpack_from(data, 1)[0]
            return f"activate bit timing: after {delay_ms} ms", (("delay_ms", delay_ms),)
        case lss.STORE:
            return _CONFIGURE[lss.STORE], ()
        case lss.FASTSCAN:
            return _fastscan(data)
        case lss.INQUIRE_NODE_ID:
            if by_master:
                return "inquire node id", ()
            return f"inquire node id: {_node_id(data[1])}", (("node_id", data[1]),)
        case _:
            return f"command {command:02X}h: {data[1:].hex(' ').upper()}", ()


def _node_id(number: int) -> str:
    return "none" if number == lss.NO_NODE_ID else str(number)


def _bit_timing(table: int, index: int) -> tuple[str, Facts]:
    name, place = "configure bit timing", f"table {table}, index {index}"
    rate = lss.BIT_RATES[index] if table == 0 and index < len(lss.BIT_RATES) else None
    if rate:
        return f"{name}: {rate} bit/s ({place})", (("bit_rate", rate),)
    if table == 0 and index == lss.AUTOMATIC:
        return f"{name}: automatic ({place})", ()
    return f"{name}: {place}", ()


def _fastscan(data: bytes) -> tuple[str, Facts]:
    """The query: does your number match from this bit upwards? Lower bits are not compared."""
    number, bit, field, _ = lss.QUESTION.unpack_from(data, 1)
    if bit == lss.CONFIRM:
        return "fastscan: is anybody there?", ()
    if bit > _MOST_BIT or field >= len(lss.FIELDS):
        return f"fastscan: {data[1:].hex(' ').upper()}", ()
    text = f"fastscan: {lss.FIELDS[field]}, bits {bit}…{_MOST_BIT} as in {number:08X}h"
    return text, (("number", number), ("bit", bit))
