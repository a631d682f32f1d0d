"""The checks of ``conformance`` on PDOs: their settings, and their traffic once the node is started.
Sans-IO."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Sequence
from itertools import cycle, pairwise
from typing import Final

from bridge.bustools.conformance import (
    REACTION_S,
    Answers,
    Check,
    ProbeStep,
    SetPdo,
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
from bridge.canopen import abort, cobid, nmt
from bridge.canopen.frame import REMOTE, Frame
from bridge.canopen.nmt import NmtCommand, NmtState

_PDOS: Final = 4
"""PDOs of each kind that are checked: those of the pre-defined connection set."""
_PDO_BITS: Final = 64
_SYNCHRONOUS: Final = range(1, 241)
_ON_REQUEST: Final = (252, 253)
_EVENT_DRIVEN: Final = (254, 255)
_MOST_SYNCS: Final = 20
_SYNC_S: Final = 0.1
"""Longest wait for a TPDO after its SYNC, seconds."""
_QUIET_S: Final = 0.2
_LONGEST_EVENT_MS: Final = 2_000
_EVENTS: Final = 4
_SLACK: Final = 0.25
"""Tolerance as a share of a period: the test's own jitter is in it."""
_TOO_SHORT: Final = b"\x10\x82"
"""8210h: PDO not processed due to length error (CiA 301 §7.2.7.1, table 26)."""
_PRODUCES_SYNC: Final = 0x4000_0000
"""Bit 30 of 1005h: the node produces SYNC."""


def settings_of_pdos(slave: Slave) -> list[Check]:
    """The checks of how each PDO is set."""
    return [_setting(slave, number, sent=sent) for sent in (True, False) for number in range(_PDOS)]


def _setting(slave: Slave, number: int, *, sent: bool) -> Check:
    """Check one PDO of the node: its COB-ID, and that its mapped objects exist and fit into a frame."""
    name, of_mapping = (f"TPDO {number + 1}", "§7.5.2.38") if sent else (f"RPDO {number + 1}", "§7.5.2.36")
    parameter, mapping = (0x1800, 0x1A00) if sent else (0x1400, 0x1600)
    answer = yield from slave.read(parameter + number, 1)
    cob_id = plain(answer)
    if cob_id is None:
        clause = "§7.5.2.37" if sent else "§7.5.2.35"
        slave.skipped(clause, f"{name} has a COB-ID", shown(answer), lacking(answer))
        return
    if cob_id & cobid.PDO_DISABLED:
        return
    ok = bool(cob_id & cobid.PDO_EXTENDED) or cobid.is_for_pdos(cob_id & cobid.COB_ID_MASK)
    slave.found("§7.5.2.37" if sent else "§7.5.2.35", f"{name} has a COB-ID for PDOs", ok, f"{cob_id:08X}h")
    answer = yield from slave.read(mapping + number, 0)
    count = plain(answer)
    bits = 0
    for sub in range(1, min(count or 0, 64) + 1):
        entry = yield from slave.number(mapping + number, sub)
        if entry is None:
            rule = f"the mapping of {name} has {count} objects, as its sub-index 0 says"
            slave.found(of_mapping, rule, ok=False, seen=f"no {mapping + number:04X}h:{sub:02X}")
            return
        bits += entry & 0xFF
        yield from _mapped(slave, name, entry, sent=sent)
    rule = f"what is mapped to {name} fits into a frame"
    if count is None:
        slave.skipped(of_mapping, rule, f"{mapping + number:04X}h: {shown(answer)}", lacking(answer))
    else:
        slave.found(of_mapping, rule, bits <= _PDO_BITS, f"{bits} bits")
    if cob_id & cobid.PDO_EXTENDED:
        return
    kind = yield from slave.number(parameter + number, 2)
    inhibit_100us = (yield from slave.number(parameter + number, 3)) if sent else 0
    event_ms = (yield from slave.number(parameter + number, 5)) if sent else 0
    pdo = SetPdo(
        name,
        cob_id & cobid.COB_ID_MASK,
        None if count is None else bits,
        kind,
        (inhibit_100us or 0) / 10,
        event_ms or 0,
        not cob_id & cobid.NO_REMOTE,
    )
    (slave.tpdos if sent else slave.rpdos).append(pdo)


def _mapped(slave: Slave, name: str, entry: int, *, sent: bool) -> Check:
    """Check that a mapped object is there, and as long as it is mapped. Below 0020h it is a gap."""
    of_mapping = "§7.5.2.38" if sent else "§7.5.2.36"
    index, sub, bits = entry >> 16, entry >> 8 & 0xFF, entry & 0xFF
    if index < 0x20:
        return
    answer = yield from slave.read(index, sub)
    place, code, size = f"{index:04X}h:{sub:02X}", aborted(answer), expedited_bytes(answer)
    if code in (abort.NO_OBJECT, abort.NO_SUB) or not answer:
        slave.found(of_mapping, f"{place}, mapped to {name}, is there", ok=False, seen=shown(answer))
    elif sent and size is not None and answer[0] & 1 and 8 * size < bits:
        rule = f"{place} is as long as it is mapped to {name}"
        slave.found(of_mapping, rule, ok=False, seen=f"{8 * size} bits, mapped with {bits}")


def operation(slave: Slave) -> Check:
    """Start the node, and check that its PDOs come as they are set, and in no other NMT state. An RPDO
    without data cannot move anything, and is reported by the node."""
    syncs = yield from _syncs(slave)
    yield from _silent(slave, syncs, "no PDO comes before the node is started")
    slave.is_displaced = True
    frames = (nmt.command(NmtCommand.START, slave.id),)
    if slave.heartbeat_ms is None:
        yield send(*frames)
    else:
        told = yield ProbeStep(frames, is_state(slave, NmtState.OPERATIONAL).fits, REACTION_S)
        words = NmtState.OPERATIONAL.words
        slave.found("§7.2.8.2.1", f"the heartbeat says {words} when it is told so", bool(told))
    answer = yield from slave.read(0x1000)
    slave.found("§7.3.2.2", "operational, SDO is answered", bool(answer), shown(answer))
    for pdo in slave.tpdos:
        yield from _comes(slave, pdo, syncs)
    for pdo in slave.rpdos:
        yield from _is_told(slave, pdo)
    yield send(nmt.command(NmtCommand.ENTER_PRE_OPERATIONAL, slave.id))
    yield from _silent(slave, syncs, "no PDO comes any more when it is pre-operational again")


def _syncs(slave: Slave) -> Generator[ProbeStep, Answers, Iterator[Frame] | None]:
    """SYNC messages that the node waits for; None where it produces them itself."""
    cob_id = yield from slave.number(0x1005)
    overflow = yield from slave.number(0x1019)
    if cob_id is not None and cob_id & _PRODUCES_SYNC:
        return None
    counters = range(1, overflow + 1) if overflow else ()
    data = [bytes((counter,)) for counter in counters] or [b""]
    return cycle([Frame((cob_id or cobid.SYNC) & cobid.COB_ID_MASK, one) for one in data])


def _silent(slave: Slave, syncs: Iterator[Frame] | None, rule: str) -> Check:
    if not slave.tpdos:
        return
    ids = {pdo.cob_id for pdo in slave.tpdos}
    came = yield ProbeStep((next(syncs),) if syncs else (), lambda frame: frame.can_id in ids, _QUIET_S)
    slave.found("§7.3.2.2", rule, not came, f"{came[0].can_id:03X}h" if came else "")


def _comes(slave: Slave, pdo: SetPdo, syncs: Iterator[Frame] | None) -> Check:
    """Check that a TPDO comes as its transmission type says."""
    kind = pdo.transmission_type
    if kind in _SYNCHRONOUS:
        yield from _comes_by_sync(slave, pdo, syncs)
    elif kind in _ON_REQUEST:
        yield from _comes_on_request(slave, pdo, syncs)
    elif kind in _EVENT_DRIVEN and pdo.event_ms:
        yield from _comes_by_timer(slave, pdo)
    else:
        rule = f"{pdo.name} comes as its transmission type says"
        seen = "type not read" if kind is None else f"{kind}: on a change"
        slave.skipped("§7.5.2.37", rule, seen, Verdict.NOT_SEEN)


def _comes_by_sync(slave: Slave, pdo: SetPdo, syncs: Iterator[Frame] | None) -> Check:
    every = pdo.transmission_type or 1
    clause = "§7.2.2.2"
    rule = f"{pdo.name} comes with every {f'{every} SYNCs' if every > 1 else 'SYNC'}"
    if syncs is None or every > _MOST_SYNCS:
        seen = "the node itself makes SYNC" if syncs is None else "so many are not sent"
        slave.skipped(clause, rule, seen, Verdict.NOT_SEEN)
        return
    after: list[int] = []
    for number in range(1, 2 * every + 1):
        came = yield ProbeStep((next(syncs),), _of(pdo), _SYNC_S)
        if came:
            after.append(number)
        if len(after) == 2:
            break
    # Which of the first ones brings it is the node's.
    ok = len(after) == 2 and after[1] - after[0] == every
    slave.found(clause, rule, ok, f"after SYNC {' and '.join(map(str, after))}" if after else "none came")


def _comes_on_request(slave: Slave, pdo: SetPdo, syncs: Iterator[Frame] | None) -> Check:
    clause, rule = "§7.2.2.3", f"{pdo.name} comes when it is asked for"
    if not pdo.on_request:
        slave.skipped(clause, rule, "bit 30 of its COB-ID: not on request")
        return
    frames = (Frame(pdo.cob_id | REMOTE),)
    came = yield ProbeStep((next(syncs), *frames) if syncs else frames, _of(pdo), REACTION_S)
    slave.found(clause, rule, bool(came), "" if came else "no answer")


def _comes_by_timer(slave: Slave, pdo: SetPdo) -> Check:
    """Check that a TPDO comes at least as often as its event timer says, and at most as often as its inhibit
    time allows."""
    period_ms = max(pdo.event_ms, pdo.inhibit_ms)
    rule = f"{pdo.name} comes every {period_ms:g} ms at least, as its event timer says"
    if period_ms > _LONGEST_EVENT_MS:
        slave.skipped("§7.5.2.37", rule, "so long is not waited", Verdict.NOT_SEEN)
        return
    came = yield ProbeStep((), _of(pdo), (_EVENTS + 1) * period_ms / 1000, _EVENTS)
    gaps_ms = [1000 * (after.time - before.time) for before, after in pairwise(came)]
    ok = bool(gaps_ms) and max(gaps_ms) <= (1 + _SLACK) * period_ms
    slave.found("§7.5.2.37", rule, ok, _gaps(gaps_ms))
    if pdo.inhibit_ms and gaps_ms:
        rule = f"{pdo.name} comes every {pdo.inhibit_ms:g} ms at most, as its inhibit time says"
        ok = min(gaps_ms) >= (1 - _SLACK) * pdo.inhibit_ms
        slave.found("§7.5.2.37", rule, ok, _gaps(gaps_ms))


def _gaps(gaps_ms: Sequence[float]) -> str:
    return f"every {min(gaps_ms):.1f} to {max(gaps_ms):.1f} ms" if gaps_ms else "less than two came"


def _is_told(slave: Slave, pdo: SetPdo) -> Check:
    """Check the emergency message after an RPDO without data, where one comes: a slave need not have any."""
    rule = f"{pdo.name} without data is told by an emergency message, 8210h"
    if pdo.bits == 0:
        return

    def fits(frame: Frame) -> bool:
        return frame.can_id == cobid.EMCY + slave.id and frame.data[:2] == _TOO_SHORT

    came = yield ProbeStep((Frame(pdo.cob_id, b""),), fits, slave.timeout_s)
    if came:
        slave.found("§7.2.7.1", rule, ok=True)
    else:
        slave.skipped("§7.2.7.1", rule, "none came")


def _of(pdo: SetPdo) -> Callable[[Frame], bool]:
    return lambda frame: frame.can_id == pdo.cob_id
