"""Heartbeat or node guarding, never both (CiA 301 §7.2.8.3.2); written only where it differs."""

from __future__ import annotations

import struct
from typing import Final

from bridge.base.sdo_texts import text_of
from bridge.canopen.sdo import SdoError
from bridge.config import NodeTable
from bridge.node.boot.actions import BootResult, BootStep, Do, number, same, told_as, wish, write_number
from bridge.node.boot.error_status import BootError
from bridge.text import Text

_PERIOD: Final = 0x1017


def heartbeat_period_ms(supervision_ms: int) -> int:
    """Producer time in ms for a consumer time: two heartbeats in a row may be lost."""
    return max(1, supervision_ms // 3)


def set_error_control(table: NodeTable, result: BootResult) -> Do:
    """Bring 1017h, 100Ch and 100Dh to what the site file asks for. Raises BootError J.

    A heartbeat period that the node rounds is adopted.
    """
    yield BootStep(Text.of("boot_step.error_control"), "J", needed_by="supervision")
    heartbeat_ms = heartbeat_period_ms(table.supervision_ms) if table.supervision == "heartbeat" else 0
    guard = (table.supervision_ms, table.life_time_factor) if table.supervision == "guarding" else (0, 0)
    wanted = [
        (_PERIOD, struct.pack("<H", heartbeat_ms)),
        (0x100C, struct.pack("<H", guard[0])),
        (0x100D, struct.pack("<B", guard[1])),
    ]
    # What is to be off goes off first.
    wanted.sort(key=lambda item: any(item[1]))
    result.heartbeat_ms = heartbeat_ms
    for index, data in wanted:
        have = yield from wish(result, index)
        if same(have, data) or (have is None and not any(data)):
            continue
        if index == _PERIOD and heartbeat_ms:
            yield from _set_period(table, data, have, result)
            continue
        yield from _write(table, index, data, have)
        was = number(have, size=len(data))
        result.notes.append(Text.of("boot.changed", object=f"{index:04X}h", before=was, now=number(data)))


def _set_period(table: NodeTable, data: bytes, have: bytes | None, result: BootResult) -> Do:
    """Write 1017h, which some nodes round: Lenze keeps multiples of 5 ms (C00381)."""
    want_ms, was_ms = number(data), number(have, size=len(data))
    kept_ms = was_ms
    if not result.memory.was_not_kept(_PERIOD, 0, data):
        yield from _write(table, _PERIOD, data, have)
        kept_ms = number((yield from wish(result, _PERIOD)), want_ms, size=len(data))
        note = Text.of("boot.changed", object="1017h", before=was_ms, now=kept_ms)
        if kept_ms != want_ms:
            result.memory.note_not_kept(_PERIOD, 0, data)
            note = Text.of("boot.period_rounded", before=was_ms, now=kept_ms, written=want_ms)
        result.notes.append(note)
    least_ms, most_ms = (want_ms + 1) // 2, table.supervision_ms // 2
    if not least_ms <= kept_ms <= most_ms:
        what = Text.of("boot.period_not_kept", kept=kept_ms, written=want_ms, least=least_ms, most=most_ms)
        raise BootError("J", what)
    result.heartbeat_ms = kept_ms


def _write(table: NodeTable, index: int, data: bytes, have: bytes | None) -> Do:
    def refused(error: SdoError) -> BootError:
        supervision = Text.word("supervision", table.supervision)
        return BootError("J", Text.of("boot.not_possible", supervision=supervision, why=text_of(error)))

    with told_as(refused):
        yield from write_number(index, 0, data, have)
