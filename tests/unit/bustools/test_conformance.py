"""``conformance`` finds the faults of a small slave, and puts back what it has changed."""

from __future__ import annotations

import math
import struct

import pytest

from bridge.bustools.conformance import Conformance, Slave, Verdict
from bridge.bustools.conformance_checks import checks, lengths, put_back
from bridge.canopen.frame import REMOTE, Frame

NODE = 5
NAME = b"a drive with a long name"
SYNC, EVERY = 0x80, 3
TPDO_BY_SYNC, TPDO_BY_TIMER, TPDO_ON_REQUEST = 0x180 + NODE, 0x280 + NODE, 0x380 + NODE
TPDOS = (TPDO_BY_SYNC, TPDO_BY_TIMER, TPDO_ON_REQUEST)
WORD = b"\x50\2"
_MUX = struct.Struct("<HB")


class SmallSlave:
    """A slave after CiA 301, but for its ``fault``."""

    def __init__(self, fault: str = "") -> None:
        self.fault = fault
        u32 = {
            (0x1000, 0): 0x192,
            (0x1018, 0): 2,
            (0x1018, 1): 0x38,
            (0x1018, 2): 1,
            (0x1014, 0): 0x80 + NODE,
        }
        u32 |= {(0x1003, 0): 0, (0x1005, 0): SYNC, (0x1400, 1): 0x200 + NODE}
        ids = (TPDO_BY_SYNC | 0x4000_0000, TPDO_BY_TIMER | 0x4000_0000, TPDO_ON_REQUEST)
        u32 |= {(0x1800 + number, 1): can_id for number, can_id in enumerate(ids)}
        # Each carries a word.
        for index, mapped in ((0x1600, 0x6040_0010), *((0x1A00 + n, 0x6041_0010) for n in range(3))):
            u32 |= {(index, 0): 1, (index, 1): mapped}
        self.objects = {place: value.to_bytes(4, "little") for place, value in u32.items()}
        self.objects |= {(0x1001, 0): b"\0", (0x1017, 0): b"\0\0", (0x6041, 0): b"\x50\2"}
        self.objects |= {(0x1400, 2): b"\xff", (0x6040, 0): b"\0\0"}
        self.objects |= {(0x1800, 2): bytes((EVERY,)), (0x1801, 2): b"\xff", (0x1802, 2): b"\xfd"}
        self.objects |= {(0x1801, 3): (300).to_bytes(2, "little"), (0x1801, 5): b"\x64\0"}
        self.objects |= {(0x100C, 0): b"\0\0", (0x100D, 0): b"\0", (0x1008, 0): NAME}
        if fault == "errors":
            self.objects[0x1003, 0] = b"\2\0\0\0"
        if fault == "mapping":
            del self.objects[0x6041, 0]
        self.state, self.toggle, self.guard = 0x7F, 0, 0
        self.left: bytes | None = None
        self.beat_at: float | None = None
        self.timer_at: float | None = None
        self.types = 0
        self.syncs = 0

    @property
    def beat_s(self) -> float:
        period_ms = int.from_bytes(self.objects[0x1017, 0], "little")
        return period_ms / (500 if self.fault == "period" else 1000)

    @property
    def sends_pdos(self) -> bool:
        return self.state == 5 or (self.fault == "early" and self.state == 0x7F)

    def next_at(self) -> float:
        """Time at which it sends by itself."""
        return min(at for at in (self.beat_at, self.timer_at, math.inf) if at is not None)

    def on_time(self, now: float) -> list[Frame]:
        if self.beat_at is not None and now >= self.beat_at:
            self.beat_at = now + self.beat_s if self.beat_s else None
            return [Frame(0x700 + NODE, bytes((self.state,)))]
        if self.timer_at is not None and now >= self.timer_at:
            self.timer_at = now + {"timer": 0.2, "inhibit": 0.01}.get(self.fault, 0.1)
            return [Frame(TPDO_BY_TIMER, WORD)]
        return []

    def on_frame(self, frame: Frame, now: float) -> list[Frame]:
        if frame.can_id == 0 and frame.data[1] == NODE:
            said = self._nmt(frame.data[0])
            if self.state != 5 and self.fault != "late":
                self.timer_at = None
            elif self.timer_at is None and self.state == 5:
                self.timer_at = now
            return said
        if frame.can_id == SYNC and self.sends_pdos:
            self.syncs += 1
            every = EVERY + 1 if self.fault == "every" else EVERY
            return [Frame(TPDO_BY_SYNC, WORD)] if self.syncs % every == 0 or self.state != 5 else []
        if frame.can_id == TPDO_ON_REQUEST | REMOTE and self.sends_pdos and self.fault != "request":
            return [Frame(TPDO_ON_REQUEST, WORD)]
        if frame.can_id == 0x200 + NODE and self.state == 5 and len(frame.data) < 2:
            return [] if self.fault == "untold" else [Frame(0x80 + NODE, b"\x10\x82\x11".ljust(8, b"\0"))]
        if frame.can_id == (0x700 + NODE) | REMOTE:
            self.guard ^= 0 if self.fault == "guarding" else 0x80
            return [Frame(0x700 + NODE, bytes((self.guard ^ 0x80 | self.state,)))]
        if frame.can_id != 0x600 + NODE or (self.state == 4 and self.fault != "stopped"):
            return []
        answer = self._sdo(frame.data)
        if self.beat_at is None and self.beat_s:
            self.beat_at = now + self.beat_s
        return [Frame(0x580 + NODE, answer)] if answer else []

    def _nmt(self, command: int) -> list[Frame]:
        started = 0x7F if self.fault == "operation" else 5
        self.state = {1: started, 2: 4, 0x80: 0x7F, 0x55: 4 if self.fault == "nmt" else self.state}.get(
            command, self.state
        )
        if command == 0x82:
            self.beat_at, self.objects[0x1017, 0] = None, b"\0\0"
            return [] if self.fault == "boot-up" else [Frame(0x700 + NODE, b"\0")]
        return []

    def _sdo(self, data: bytes) -> bytes:
        index, sub = _MUX.unpack_from(data, 1)

        def refuse(code: int) -> bytes:
            self.left = None
            return b"\x80" + data[1:4] + struct.pack("<I", 0x0800_0000 if self.fault == "codes" else code)

        command = data[0] & 0xE0
        if data[0] == 0x80:
            self.left = None
            return data if self.fault == "abort" else b""
        if command == 0x60:
            return self._segment(data, refuse(0x0504_0001) if self.left is None else b"")
        if command not in (0x20, 0x40):
            return refuse(0x0504_0001)
        if (index, sub) not in self.objects:
            return refuse(0x0609_0011 if any(index == one for one, _ in self.objects) else 0x0602_0000)
        if command == 0x20:
            if index == 0x1017:
                if self.fault != "stuck" or data[4:6] != b"\0\0":
                    self.objects[index, sub] = data[4:6]
                return b"\x60" + data[1:4] + bytes(4)
            return b"\x60" + data[1:4] + bytes(4) if self.fault == "read-only" else refuse(0x0601_0002)
        value = self.objects[index, sub]
        if (index, sub) == (0x1000, 0) and self.fault == "changes":
            self.types += 1
            value = self.types.to_bytes(4, "little")
        if len(value) <= 4:
            return bytes((0x43 | (4 - len(value)) << 2,)) + data[1:4] + value.ljust(4, b"\0")
        self.left, self.toggle = value, 0
        return b"\x41" + data[1:4] + struct.pack("<I", len(value) + (self.fault == "announced"))

    def _segment(self, data: bytes, refusal: bytes) -> bytes:
        if self.left is None:
            return refusal
        if data[0] & 0x10 != self.toggle and self.fault != "toggle":
            self.left = None
            return b"\x80" + bytes(3) + struct.pack("<I", 0x0503_0000)
        part, self.left = self.left[:7], self.left[7:] or None
        head = self.toggle | (7 - len(part)) << 1 | (self.left is None)
        self.toggle ^= 0x10
        return bytes((head,)) + part.ljust(7, b"\0")


def tried(device: SmallSlave) -> Slave:
    slave, now = Slave(NODE, 0.5), 100.0
    task = Conformance(slave, checks(slave, reset=True), put_back(slave), now)
    while not task.is_finished(now):
        while frames := task.take_frames():
            for frame in frames:
                for answer in device.on_frame(frame, now):
                    task.on_frame(answer._replace(time=now))
        deadline = task.next_deadline()
        if deadline is None:
            continue
        if device.next_at() <= deadline:
            now = max(now, device.next_at())
            for said in device.on_time(now):
                task.on_frame(said._replace(time=now))
        else:
            now = max(now, deadline)
            task.on_time(now)
    assert task.done == task.total + 1
    lengths(slave, task.heard)
    return slave


def failures(slave: Slave) -> list[str]:
    return [one.rule for one in slave.findings if one.verdict is Verdict.FAILED]


def test_a_slave_after_the_standard_has_no_faults() -> None:
    device = SmallSlave()
    slave = tried(device)
    assert failures(slave) == []
    passed = {one.clause for one in slave.findings if one.verdict is Verdict.PASSED}
    assert {"§7.2.8.3.2.1", "§7.2.8.3.2.2", "§7.2.8.3.3", "§7.2.4.3.6", "§7.5.2.38"} <= passed
    assert {"§7.2.2.2", "§7.2.2.3", "§7.5.2.37", "§7.2.7.1"} <= passed
    seen = {one.rule for one in slave.findings if one.verdict is Verdict.PASSED}
    assert {f"the TPDO on {can_id:03X}h is as long as its mapping, 16 bits" for can_id in TPDOS} <= seen
    assert (device.state, device.objects[0x1017, 0]) == (0x7F, b"\0\0"), "all is as it was"


@pytest.mark.parametrize(
    ("fault", "rule"),
    [
        ("changes", "1000h:00 is the same when it is read again"),
        ("codes", "reading an object that is not there is refused: 06020000h"),
        ("codes", "an unknown command specifier is refused: 05040001h"),
        ("read-only", "writing a read-only object is refused: 06010002h"),
        ("abort", "an abort is not answered"),
        ("announced", "so many bytes come as were announced"),
        ("toggle", "a wrong toggle bit is refused: 05030000h"),
        ("errors", "1003h has 2 errors, as 1003h:00 says"),
        ("mapping", "6041h:00, mapped to TPDO 1, is there"),
        ("guarding", "guarding is answered, with alternating toggle bit"),
        ("period", "the heartbeat comes every 100 ms where 1017h says so"),
        ("stopped", "stopped, SDO is not answered"),
        ("nmt", "an unknown NMT command changes nothing"),
        ("boot-up", "reset communication ends with a boot-up message"),
        ("early", "no PDO comes before the node is started"),
        ("late", "no PDO comes any more when it is pre-operational again"),
        ("operation", "the heartbeat says operational when it is told so"),
        ("every", "TPDO 1 comes with every 3 SYNCs"),
        ("timer", "TPDO 2 comes every 100 ms at least, as its event timer says"),
        ("inhibit", "TPDO 2 comes every 30 ms at most, as its inhibit time says"),
        ("request", "TPDO 3 comes when it is asked for"),
    ],
)
def test_a_fault_is_found(fault: str, rule: str) -> None:
    assert rule in failures(tried(SmallSlave(fault)))


def test_what_cannot_be_put_back_is_told() -> None:
    slave, device = Slave(NODE, 0.5), SmallSlave("stuck")
    slave.heartbeat_ms, device.objects[0x1017, 0] = 0, b"\x64\0"
    task = Conformance(slave, (), put_back(slave), 0.0)
    while not task.is_finished(0.0):
        for frame in task.take_frames():
            for answer in device.on_frame(frame, 0.0):
                task.on_frame(answer)
    assert failures(slave) == ["1017h holds again what it held"]


def test_a_node_that_is_silent_ends_it_all_the_same() -> None:
    device = SmallSlave()
    device.on_frame = lambda frame, now: []  # type: ignore[method-assign]
    assert failures(tried(device))


def test_a_short_rpdo_that_nobody_tells_is_no_fault() -> None:
    slave = tried(SmallSlave("untold"))
    verdicts = {one.rule: one.verdict for one in slave.findings}
    assert verdicts["RPDO 1 without data is told by an emergency message, 8210h"] is Verdict.NOT_OFFERED
    assert failures(slave) == []


def test_a_mapping_that_cannot_be_read_is_not_judged() -> None:
    device = SmallSlave()
    del device.objects[0x1A01, 0]
    slave = tried(device)
    assert failures(slave) == []
    verdicts = {one.rule: one.verdict for one in slave.findings}
    assert verdicts["what is mapped to TPDO 2 fits into a frame"] is Verdict.NOT_OFFERED
    assert not any(f"the TPDO on {TPDO_BY_TIMER:03X}h" in rule for rule in verdicts)


_MUTE = {
    "1014h is a COB-ID for emergency messages": (0x1014, 0),
    "1003h has as many errors as 1003h:00 says": (0x1003, 0),
    "TPDO 2 has a COB-ID": (0x1801, 1),
    "RPDO 1 has a COB-ID": (0x1400, 1),
    "1008h is read by segments, with alternating toggle bit": (0x1008, 0),
    "1008h is read as a block": (0x1008, 0),
    "the heartbeat comes every 100 ms where 1017h says so": (0x1017, 0),
    "guarding is answered, with alternating toggle bit": (0x100C, 0),
}
NO_OBJECT, NO_SUB, GENERAL, LOCAL = 0x0602_0000, 0x0609_0011, 0x0800_0000, 0x0800_0021


@pytest.mark.parametrize("code", [NO_OBJECT, NO_SUB, GENERAL, LOCAL, None])
@pytest.mark.parametrize("rule", _MUTE)
def test_only_a_node_that_says_so_does_not_offer_it(rule: str, code: int | None) -> None:
    """One that is silent at this object, or refuses it for another reason, has shown nothing."""
    device = SmallSlave()
    whole = device.on_frame

    def on_frame(frame: Frame, now: float) -> list[Frame]:
        is_question = frame.can_id == 0x600 + NODE and frame.data[0] & 0xE0 in (0x40, 0xA0)
        if not is_question or _MUX.unpack_from(frame.data, 1) != _MUTE[rule]:
            return whole(frame, now)
        if code is None:
            return []
        return [Frame(0x580 + NODE, b"\x80" + frame.data[1:4] + struct.pack("<I", code))]

    device.on_frame = on_frame  # type: ignore[method-assign]
    verdicts = {one.rule: one.verdict for one in tried(device).findings}
    assert verdicts[rule] is (Verdict.NOT_OFFERED if code in (NO_OBJECT, NO_SUB) else Verdict.NOT_SEEN)
