"""The checks of ``conformance`` on transfers of more than four bytes. Sans-IO."""

from __future__ import annotations

from collections.abc import Generator
from typing import Final

from bridge.bustools.conformance import (
    Answers,
    Check,
    ProbeStep,
    Slave,
    Verdict,
    aborted,
    expedited_bytes,
    lacking,
    shown,
)
from bridge.canopen import abort
from bridge.canopen.sdo_block import crc16
from bridge.canopen.sdo_transfer import MUX, SEGMENT, U32

_NAME: Final = 0x1008
_MOST_SEGMENTS: Final = 200


def _whole(
    slave: Slave, index: int
) -> Generator[ProbeStep, Answers, tuple[bytes | None, int | None, str, bytes]]:
    """Segmented upload of an object of any length: data, length announced in bytes, error, and the last
    answer."""
    answer = yield from slave.ask(b"\x40" + MUX.pack(index, 0))
    size = expedited_bytes(answer)
    if size is not None:
        return answer[4 : 4 + size], None, "expedited", answer
    if not answer or answer[0] & 0xE2 != 0x40:
        return None, None, shown(answer), answer
    announced = U32.unpack_from(answer, 4)[0] if answer[0] & 1 else None
    data, toggle = b"", 0
    for _ in range(_MOST_SEGMENTS):
        answer = yield from slave.ask(bytes((0x60 | toggle,)))
        if not answer or answer[0] & 0xE0:
            return None, announced, f"segment {len(data) // SEGMENT + 1}: {shown(answer)}", answer
        if answer[0] & 0x10 != toggle:
            yield from slave.break_off(index, 0)
            return None, announced, f"segment {len(data) // SEGMENT + 1} has the wrong toggle bit", answer
        data += answer[1 : 8 - (answer[0] >> 1 & 7)]
        if answer[0] & 1:
            return data, announced, "", answer
        toggle ^= 0x10
    yield from slave.break_off(index, 0)
    return None, announced, "no end", answer


def segmented(slave: Slave) -> Check:
    """Segmented upload of the device name, and its toggle bit."""
    clause, rule = "§7.2.4.3.6", "1008h is read by segments, with alternating toggle bit"
    data, announced, why, answer = yield from _whole(slave, _NAME)
    if data is None and announced is None:
        slave.skipped(clause, rule, why, lacking(answer))
        return
    if why == "expedited":
        slave.skipped(clause, rule, "1008h is no longer than four bytes", Verdict.NOT_SEEN)
        return
    slave.found(clause, rule, data is not None, why or f"{len(data or b'')} bytes")
    if announced is not None and data is not None:
        rule = "so many bytes come as were announced"
        slave.found("§7.2.4.3.5", rule, announced == len(data), f"{announced} announced, {len(data)} came")
    yield from slave.ask(b"\x40" + MUX.pack(_NAME, 0))
    answer = yield from slave.ask(b"\x70")
    rule = "a wrong toggle bit is refused: 05030000h"
    slave.found(clause, rule, aborted(answer) == abort.TOGGLE, shown(answer))
    if aborted(answer) is None:
        yield from slave.break_off(_NAME, 0)


def block(slave: Slave) -> Check:
    """Block upload of the device name with CRC, compared with the segmented one."""
    clause, rule = "§7.2.4.3.12", "1008h is read as a block"
    wanted, _, _, last = yield from _whole(slave, _NAME)
    if wanted is None:
        slave.skipped(clause, rule, "1008h cannot be read", lacking(last))
        return
    answer = yield from slave.ask(b"\xa4" + MUX.pack(_NAME, 0) + bytes((127, 0)))
    if not answer or answer[0] & 0xF9 != 0xC0:
        if answer and aborted(answer) is None:
            yield from slave.break_off(_NAME, 0)
        slave.skipped(clause, rule, shown(answer), lacking(answer))
        return
    has_crc = bool(answer[0] & 4)
    data, number, is_last = b"", 0, False
    came = yield ProbeStep((slave.request(b"\xa3"),), slave.is_reply, slave.timeout_s)
    while came and not is_last and number < _MOST_SEGMENTS:
        number += 1
        if came[0].data[0] & 0x7F != number:
            break
        data, is_last = data + came[0].data[1:], bool(came[0].data[0] & 0x80)
        if not is_last:
            came = yield ProbeStep((), slave.is_reply, slave.timeout_s)
    end = (yield from slave.ask(bytes((0xA2, number, 127)))) if is_last else b""
    if not end or end[0] & 0xE3 != 0xC1:
        slave.found(clause, rule, ok=False, seen=f"after {number} segments: {shown(end)}")
        yield from slave.break_off(_NAME, 0)
        return
    yield ProbeStep((slave.request(b"\xa1"),), slave.is_reply, 0.0)
    data = data[: len(data) - (end[0] >> 2 & 7)]
    slave.found(clause, f"{rule}, and is the same as by segments", data == wanted, f"{len(data)} bytes")
    if has_crc:
        crc = int.from_bytes(end[1:3], "little")
        slave.found("§7.2.4.3.16", "the CRC of the block is right", crc == crc16(data), f"{crc:04X}h")
