"""The checks of ``conformance``: SDO server, error control, NMT, emergency, PDOs. Sans-IO."""

from __future__ import annotations

from typing import Final

from bridge.bustools.conformance import (
    REACTION_S,
    Check,
    ProbeStep,
    Slave,
    Verdict,
    aborted,
    expedited_bytes,
    is_state,
    lacking,
    plain,
    send,
    shown,
)
from bridge.bustools.conformance_pdos import operation, settings_of_pdos
from bridge.bustools.conformance_transfers import block, segmented
from bridge.canopen import abort, cobid, nmt
from bridge.canopen.frame import REMOTE, Frame
from bridge.canopen.nmt import NmtCommand, NmtState
from bridge.canopen.sdo_transfer import MUX, U32

_READ_ONLY: Final = 0x0601_0002
_NO_ACCESS: Final = 0x0601_0000
_RESERVED: Final = 0x0FFF
"""Index that no device has (CiA 301 §7.4.1, table 40)."""
_NO_SUCH_SUB: Final = 0x7F
_NO_COMMAND: Final = 0x55
"""Command specifier that is no NMT command."""
_BEAT_MS: Final = 100
_BEATS: Final = 5
_BEAT_SLACK: Final = 0.25
"""Tolerance of the mean period, as a share of the one that was set: the test's own jitter is in it."""
_BOOT_UP_S: Final = 10.0


def checks(slave: Slave, *, reset: bool) -> list[Check]:
    """All checks, in the order in which they are made. ``reset`` resets the node's communication, too."""
    found = [
        mandatory(slave),
        error_codes(slave),
        unknown_requests(slave),
        segmented(slave),
        block(slave),
        emergency(slave),
        *settings_of_pdos(slave),
        guarding(slave),
        heartbeat(slave),
        operation(slave),
        stopping(slave),
    ]
    return [*found, boot_up(slave)] if reset else found


def put_back(slave: Slave) -> Check:
    """Undo what the checks have changed: 1017h, and the NMT state."""
    if slave.is_displaced:
        yield send(nmt.command(NmtCommand.ENTER_PRE_OPERATIONAL, slave.id))
        slave.is_displaced = False
    if slave.heartbeat_ms is not None:
        before = slave.heartbeat_ms
        yield from slave.write(0x1017, 0, before.to_bytes(2, "little"))
        now = yield from slave.number(0x1017)
        slave.found(
            "§7.5.2.20", "1017h holds again what it held", now == before, f"{now} ms, was {before} ms"
        )
        slave.heartbeat_ms = None


def mandatory(slave: Slave) -> Check:
    """Objects that every device has, which do not change from one reading to the next."""
    for index, sub, name in (
        (0x1000, 0, "device type"),
        (0x1001, 0, "error register"),
        (0x1018, 1, "vendor"),
    ):
        answer = yield from slave.read(index, sub)
        place = f"{index:04X}h:{sub:02X}"
        slave.found("§7.5.2", f"{place}, {name}, can be read", plain(answer) is not None, shown(answer))
        if index != 0x1001:
            again = yield from slave.read(index, sub)
            slave.found("§7.5.2", f"{place} is the same when it is read again", answer == again, shown(again))
    highest = yield from slave.number(0x1018, 0)
    for sub in range(2, min(highest or 0, 4) + 1):
        answer = yield from slave.read(0x1018, sub)
        rule = f"1018h:{sub:02X} is there, as 1018h:00 says"
        slave.found("§7.5.2.21", rule, plain(answer) is not None, shown(answer))


def error_codes(slave: Slave) -> Check:
    """Refusal of objects that are not there, or must not be written, with the abort code for it."""
    for rule, request, codes in (
        ("reading an object that is not there is refused", (_RESERVED, 0, b""), (abort.NO_OBJECT,)),
        ("reading a sub-index that is not there is refused", (0x1018, _NO_SUCH_SUB, b""), (abort.NO_SUB,)),
        ("writing an object that is not there is refused", (_RESERVED, 0, b"\0"), (abort.NO_OBJECT,)),
    ):
        index, sub, data = request
        answer = yield from (slave.write(index, sub, data) if data else slave.read(index, sub))
        wanted = " or ".join(f"{code:08X}h" for code in codes)
        is_about_it = answer[1:4] == MUX.pack(index, sub)
        slave.found(
            "§7.2.4.3.17", f"{rule}: {wanted}", aborted(answer) in codes and is_about_it, shown(answer)
        )
    # The value that it has: if a faulty node takes it, nothing has changed.
    held = yield from slave.number(0x1000)
    if held is not None:
        answer = yield from slave.write(0x1000, 0, U32.pack(held))
        ok = aborted(answer) in (_READ_ONLY, _NO_ACCESS)
        slave.found("§7.2.4.3.17", "writing a read-only object is refused: 06010002h", ok, shown(answer))


def unknown_requests(slave: Slave) -> Check:
    """Answers to invalid requests, and to one that needs none."""
    answer = yield from slave.ask(b"\xe0" + MUX.pack(0x1000, 0))
    rule = "an unknown command specifier is refused: 05040001h"
    slave.found("§7.2.4.3.17", rule, aborted(answer) == abort.UNKNOWN_COMMAND, shown(answer))
    answer = yield from slave.ask(b"\x60")
    rule = "a segment is refused if no transfer was begun"
    slave.found("§7.2.4.3.17", rule, aborted(answer) is not None, shown(answer))
    data = b"\x80" + MUX.pack(0x1000, 0) + U32.pack(abort.GENERAL)
    answer = yield from slave.ask(data)
    slave.found("§7.2.4.3.17", "an abort is not answered", not answer, shown(answer) if answer else "")
    answer = yield from slave.read(0x1000)
    slave.found("§7.2.4.3", "after all this it still answers", plain(answer) is not None, shown(answer))


def emergency(slave: Slave) -> Check:
    """COB-ID of emergency messages, and the history of errors."""
    rule = "1014h is a COB-ID for emergency messages"
    answer = yield from slave.read(0x1014)
    cob_id = plain(answer)
    if cob_id is None:
        slave.skipped("§7.5.2.17", rule, f"1014h: {shown(answer)}", lacking(answer))
    else:
        ok = bool(cob_id & cobid.PDO_DISABLED) or cobid.is_for_emcy(cob_id & cobid.COB_ID_MASK)
        slave.found("§7.5.2.17", rule, ok, f"{cob_id:08X}h")
    answer = yield from slave.read(0x1003)
    count = plain(answer)
    if count is None:
        rule = "1003h has as many errors as 1003h:00 says"
        slave.skipped("§7.5.2.4", rule, f"1003h: {shown(answer)}", lacking(answer))
        return
    for sub in range(1, min(count, 254) + 1):
        answer = yield from slave.read(0x1003, sub)
        if expedited_bytes(answer) != 4:
            rule = f"1003h has {count} errors, as 1003h:00 says"
            slave.found("§7.5.2.4", rule, ok=False, seen=f"1003h:{sub:02X}: {shown(answer)}")
            return
    slave.found("§7.5.2.4", "1003h has as many errors as 1003h:00 says", ok=True, seen=str(count))


def heartbeat(slave: Slave) -> Check:
    """Heartbeat period as set in 1017h. It stays set for the checks of the NMT states."""
    clause, rule = "§7.2.8.3.2.2", f"the heartbeat comes every {_BEAT_MS} ms where 1017h says so"
    answer = yield from slave.read(0x1017)
    before = plain(answer)
    if before is None:
        slave.skipped(clause, rule, f"1017h: {shown(answer)}", lacking(answer))
        return
    slave.heartbeat_ms = before
    answer = yield from slave.write(0x1017, 0, _BEAT_MS.to_bytes(2, "little"))
    if aborted(answer) is not None or not answer:
        slave.heartbeat_ms = None
        slave.skipped(clause, rule, f"1017h cannot be written: {shown(answer)}", Verdict.NOT_SEEN)
        return
    yield is_state(slave)
    beats = yield ProbeStep((), is_state(slave).fits, (_BEATS + 5) * _BEAT_MS / 1000, _BEATS)
    if len(beats) < _BEATS:
        slave.found(clause, rule, ok=False, seen=f"{len(beats)} came in {(_BEATS + 5) * _BEAT_MS} ms")
        return
    period_ms = 1000 * (beats[-1].time - beats[0].time) / (_BEATS - 1)
    ok = abs(period_ms - _BEAT_MS) <= _BEAT_SLACK * _BEAT_MS
    slave.found(clause, rule, ok, f"every {period_ms:.1f} ms")


def guarding(slave: Slave) -> Check:
    """Two guarding answers, the toggle bit of which differs. Not where they would start the life guarding, or
    while the node has a heartbeat: it has one of both."""
    clause, rule = "§7.2.8.3.2.1", "guarding is answered, with alternating toggle bit"
    if (yield from slave.number(0x1017)):
        slave.skipped(clause, rule, "it has a heartbeat", Verdict.NOT_SEEN)
        return
    times = (yield from slave.read(0x100C)), (yield from slave.read(0x100D))
    for index, answer in zip((0x100C, 0x100D), times, strict=True):
        if plain(answer) is None:
            slave.skipped(clause, rule, f"{index:04X}h: {shown(answer)}", lacking(answer))
            return
    if all(plain(answer) for answer in times):
        slave.skipped(clause, rule, "life guarding would begin", Verdict.NOT_SEEN)
        return
    question = Frame(cobid.ERROR_CONTROL + slave.id | REMOTE)
    seen: list[int] = []
    for _ in range(3):
        came = yield ProbeStep((question,), is_state(slave).fits, slave.timeout_s)
        seen += [frame.data[0] for frame in came]
    toggles = [octet >> 7 for octet in seen]
    ok = len(seen) == 3 and toggles[0] == toggles[2] != toggles[1]
    slave.found(clause, rule, ok, " ".join(f"{octet:02X}h" for octet in seen) or "no answer")


def stopping(slave: Slave) -> Check:
    """Stop and enter pre-operational, as the heartbeat and the SDO server show it."""
    has_beat = slave.heartbeat_ms is not None
    slave.is_displaced = True
    for command, state, answers in (
        (NmtCommand.STOP, NmtState.STOPPED, False),
        (NmtCommand.ENTER_PRE_OPERATIONAL, NmtState.PRE_OPERATIONAL, True),
    ):
        frames = (nmt.command(command, slave.id),)
        if has_beat:
            told = yield ProbeStep(frames, is_state(slave, state).fits, REACTION_S)
            slave.found("§7.2.8.2.1", f"the heartbeat says {state.words} when it is told so", bool(told))
        else:
            yield send(*frames)
        answer = yield from slave.read(0x1000)
        words = "is answered" if answers else "is not answered"
        rule = f"{state.words}, SDO {words}"
        slave.found("§7.3.2.2", rule, bool(answer) is answers, shown(answer))
    slave.is_displaced = False
    if not has_beat:
        return
    yield send(Frame(cobid.NMT, bytes((_NO_COMMAND, slave.id))))
    told = yield is_state(slave)
    states = [nmt.state_of(frame.data[0]) for frame in told]
    ok = states == [NmtState.PRE_OPERATIONAL]
    rule = "an unknown NMT command changes nothing"
    slave.found("§7.2.8.2.1", rule, ok, states[0].words if states else "silent")


def boot_up(slave: Slave) -> Check:
    """Reset communication: it ends with one boot-up message, and the node answers after it."""

    def fits(frame: Frame) -> bool:
        return frame.can_id == cobid.ERROR_CONTROL + slave.id and frame.data == b"\0"

    command = nmt.command(NmtCommand.RESET_COMMUNICATION, slave.id)
    came = yield ProbeStep((command,), fits, _BOOT_UP_S)
    seen = "" if came else f"none within {_BOOT_UP_S:g} s"
    slave.found("§7.2.8.3.3", "reset communication ends with a boot-up message", bool(came), seen)
    answer = yield from slave.read(0x1000)
    slave.found("§7.3.2.2", "after its boot-up message it answers SDO", bool(answer), shown(answer))


def lengths(slave: Slave, heard: dict[int, set[int]]) -> None:
    """Judge the lengths of the node's frames heard meanwhile: ``heard`` has them in bytes, by COB-ID."""
    if sizes := heard.get(cobid.EMCY + slave.id):
        slave.found("§7.2.7.3.1", "emergency messages have 8 bytes", sizes == {8}, f"{sorted(sizes)} bytes")
    for pdo in slave.tpdos:
        if not pdo.bits:
            # A static mapping may show no entries, as Lenze's does.
            continue
        rule = f"the TPDO on {pdo.cob_id:03X}h is as long as its mapping, {pdo.bits} bits"
        if sizes := heard.get(pdo.cob_id):
            slave.found("§7.5.2.38", rule, sizes == {-(-pdo.bits // 8)}, f"{sorted(sizes)} bytes")
        else:
            slave.skipped("§7.5.2.38", rule, "none came", Verdict.NOT_SEEN)
