"""Heartbeat or node guarding, never both (CiA 301 §7.2.8.3.2); written only where it differs."""

from __future__ import annotations

import struct

from bridge.config import NodeTable
from bridge.southbound.boot.actions import BootResult, Do, Step, Write, number, optional
from bridge.southbound.boot.status import BootError
from bridge.southbound.canopen.sdo import SdoError


def heartbeat_period_ms(supervision_ms: int) -> int:
    """The producer time for a consumer time: two heartbeats in a row may be lost."""
    return max(1, supervision_ms // 3)


def set_error_control(table: NodeTable, result: BootResult) -> Do:
    """Bring 1017h, 100Ch and 100Dh to what the site file asks for. Raises BootError J."""
    yield Step("setting error control", "J")
    heartbeat_ms = heartbeat_period_ms(table.supervision_ms) if table.supervision == "heartbeat" else 0
    guard = (table.supervision_ms, table.life_time_factor) if table.supervision == "guarding" else (0, 0)
    wanted = [
        (0x1017, struct.pack("<H", heartbeat_ms)),
        (0x100C, struct.pack("<H", guard[0])),
        (0x100D, struct.pack("<B", guard[1])),
    ]
    # What is to be off goes off first.
    wanted.sort(key=lambda item: any(item[1]))
    for index, data in wanted:
        have = yield from optional(index)
        if have == data or (have is None and not any(data)):
            continue
        try:
            yield Write(index, 0, data)
        except SdoError as error:
            if not error.by_server:
                raise
            raise BootError("J", f"{table.supervision} is not possible: {error}") from None
        result.notes.append(f"{index:04X}h was {number(have)}, is {number(data)} now")
