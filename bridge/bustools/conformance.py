"""Conformance test of one node that stands still: requirements of CiA 301 on a slave. Sans-IO.

Each check is a generator: it yields what is sent and which frames are waited for, is sent the frames that
came, and notes its findings. What a check changes it notes in the slave, and the last one puts it back.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from bridge.bustools.task import BusTask
from bridge.canopen import abort, cobid, nmt
from bridge.canopen.frame import Frame
from bridge.canopen.nmt import NmtState
from bridge.canopen.sdo_transfer import ABORT, MUX, U32

REACTION_S: Final = 1.0
"""Longest time for a node to follow an NMT command, seconds."""
_SDO_BYTES: Final = 8
_NOT_THERE: Final = (abort.NO_OBJECT, abort.NO_SUB, abort.UNKNOWN_COMMAND)
"""Abort codes: no such object, no such sub-index, no such service."""


class Verdict(StrEnum):
    PASSED = "passed"
    FAILED = "failed"
    NOT_OFFERED = "not offered"
    """The service is optional, and the node does not have it."""
    NOT_SEEN = "not seen"
    """The rule could not be tried, or the trial decided nothing."""


@dataclass(frozen=True, slots=True)
class RuleResult:
    """Result of one rule. ``clause`` is that of CiA 301; ``seen`` is what the node did."""

    clause: str
    rule: str
    verdict: Verdict
    seen: str = ""


@dataclass(frozen=True, slots=True)
class ProbeStep:
    """Send ``frames``, and wait for ``count`` frames that ``fit``, ``within_s`` at most."""

    frames: tuple[Frame, ...]
    fits: Callable[[Frame], bool]
    within_s: float
    count: int = 1


@dataclass(frozen=True, slots=True)
class SetPdo:
    """A PDO as the node's objects have it: ``bits`` are mapped to it; None where that cannot be read."""

    name: str
    cob_id: int
    bits: int | None
    transmission_type: int | None
    """None where it could not be read."""
    inhibit_ms: float = 0.0
    event_ms: int = 0
    on_request: bool = False
    """True if it is sent on request."""


Answers = list[Frame]
Check = Generator[ProbeStep, Answers, None]


class Slave:
    """The node as the checks see it; ``findings`` is what they have found so far."""

    def __init__(self, node_id: int, timeout_s: float) -> None:
        self.id = node_id
        self.timeout_s = timeout_s
        self.findings: list[RuleResult] = []
        self.tpdos: list[SetPdo] = []
        self.rpdos: list[SetPdo] = []
        """RPDOs that are on."""
        self.heartbeat_ms: int | None = None
        """Value of 1017h before a check changed it; None where it is unchanged."""
        self.is_displaced = False
        """True once a check has started or stopped the node."""
        self.slowest_ms = 0.0
        """Longest time that an SDO answer has taken."""

    def found(self, clause: str, rule: str, ok: bool, seen: str = "") -> None:
        self.findings.append(RuleResult(clause, rule, Verdict.PASSED if ok else Verdict.FAILED, seen))

    def skipped(self, clause: str, rule: str, seen: str, verdict: Verdict = Verdict.NOT_OFFERED) -> None:
        self.findings.append(RuleResult(clause, rule, verdict, seen))

    # SDO, byte by byte

    def request(self, data: bytes) -> Frame:
        return Frame(cobid.SDO_REQUEST + self.id, data.ljust(_SDO_BYTES, b"\0"))

    def is_reply(self, frame: Frame) -> bool:
        return frame.can_id == cobid.SDO_REPLY + self.id

    def ask(self, data: bytes) -> Generator[ProbeStep, Answers, bytes]:
        """The answer to one request, empty where none came."""
        answers = yield ProbeStep((self.request(data),), self.is_reply, self.timeout_s)
        return answers[0].data if answers else b""

    def read(self, index: int, sub: int = 0) -> Generator[ProbeStep, Answers, bytes]:
        """The answer to an initiated upload; what is more than four bytes is broken off."""
        answer = yield from self.ask(b"\x40" + MUX.pack(index, sub))
        if answer and answer[0] & 0xE2 == 0x40:
            yield from self.break_off(index, sub)
        return answer

    def break_off(self, index: int, sub: int) -> Check:
        """An abort of the client, which nobody answers."""
        data = bytes((ABORT,)) + MUX.pack(index, sub) + U32.pack(abort.GENERAL)
        yield ProbeStep((self.request(data),), lambda _: False, 0.0)

    def number(self, index: int, sub: int = 0) -> Generator[ProbeStep, Answers, int | None]:
        return plain((yield from self.read(index, sub)))

    def write(self, index: int, sub: int, data: bytes) -> Generator[ProbeStep, Answers, bytes]:
        """The answer to an expedited download of one to four bytes."""
        command = 0x23 | (4 - len(data)) << 2
        return (yield from self.ask(bytes((command,)) + MUX.pack(index, sub) + data))


def plain(answer: bytes) -> int | None:
    """The number of an expedited upload; None for every other answer."""
    size = expedited_bytes(answer)
    return None if size is None else int.from_bytes(answer[4 : 4 + size], "little")


def expedited_bytes(answer: bytes) -> int | None:
    """Length in bytes of an object from an expedited upload; None for every other answer."""
    if len(answer) != _SDO_BYTES or answer[0] & 0xE2 != 0x42:
        return None
    return 4 - (answer[0] >> 2 & 3) if answer[0] & 1 else 4


def aborted(answer: bytes) -> int | None:
    """The code with which a request was aborted; None for every other answer."""
    return U32.unpack_from(answer, 4)[0] if len(answer) == _SDO_BYTES and answer[0] == ABORT else None


def lacking(answer: bytes) -> Verdict:
    """Verdict on a question without a good answer: only a node that says so does not offer it. One that is
    silent, or refuses for another reason, has shown nothing."""
    return Verdict.NOT_OFFERED if aborted(answer) in _NOT_THERE else Verdict.NOT_SEEN


def shown(answer: bytes) -> str:
    """An answer in words."""
    if not answer:
        return "no answer"
    code, size = aborted(answer), expedited_bytes(answer)
    if code is not None:
        return f"abort {code:08X}h, {abort.text(code)}"
    return answer.hex(" ").upper() if size is None else f"{plain(answer):0{2 * size}X}h"


def is_state(slave: Slave, *states: NmtState) -> ProbeStep:
    """Step that waits for a heartbeat with one of these states."""

    def fits(frame: Frame) -> bool:
        one = frame.can_id == cobid.ERROR_CONTROL + slave.id and len(frame.data) == 1
        return one and (not states or nmt.state_of(frame.data[0]) in states)

    return ProbeStep((), fits, REACTION_S)


def send(*frames: Frame) -> ProbeStep:
    """Step that sends and waits for no frame."""
    return ProbeStep(frames, lambda _: False, 0.05)


class Conformance(BusTask):
    """Runs ``checks`` one after the other, and ``last`` after them."""

    def __init__(self, slave: Slave, checks: Iterable[Check], last: Check, now: float) -> None:
        super().__init__()
        self.slave = slave
        self.done = 0
        self.heard: dict[int, set[int]] = {}
        """Lengths of all data frames of the node, by COB-ID."""
        self._checks = [*checks]
        self.total = len(self._checks)
        self._last: Check | None = last
        self._now = now
        self._running: Check | None = None
        self._step: ProbeStep | None = None
        self._since = now
        self._came: Answers = []
        self._next(now)

    def is_finished(self, now: float) -> bool:
        return self._running is None and not self._frames

    def on_frame(self, frame: Frame) -> None:
        self._now = max(self._now, frame.time)
        if not frame.can_id & ~cobid.COB_ID_MASK:
            self.heard.setdefault(frame.can_id, set()).add(len(frame.data))
        if self._step is None or not self._step.fits(frame):
            return
        if self.slave.is_reply(frame):
            self.slave.slowest_ms = max(self.slave.slowest_ms, 1000 * (frame.time - self._since))
        self._came.append(frame)
        if len(self._came) >= self._step.count:
            self._go_on(self._now)

    def on_time(self, now: float) -> None:
        self._now = max(self._now, now)
        while self._step is not None and now >= self._since + self._step.within_s:
            self._go_on(now)

    def next_deadline(self) -> float | None:
        return None if self._step is None else self._since + self._step.within_s

    def _go_on(self, now: float) -> None:
        if self._running is None:
            return
        came, self._came, self._step = self._came, [], None
        try:
            self._begin(self._running.send(came), now)
        except StopIteration:
            self.done += 1
            self._next(now)

    def _next(self, now: float) -> None:
        while True:
            if self._checks:
                self._running = self._checks.pop(0)
            else:
                self._running, self._last = self._last, None
            if self._running is None:
                return
            try:
                self._begin(next(self._running), now)
                return
            except StopIteration:
                self.done += 1

    def _begin(self, step: ProbeStep, now: float) -> None:
        self._step, self._since = step, now
        self._frames += step.frames
