"""SDO client (CiA 301 §7.2.4): one channel to one server, transfers as generators.

A transfer yields requests and is sent the replies that belong to it. Everything else the server says
— late, doubled, about another object — is counted and passed over, never taken for an answer.
"""

from __future__ import annotations

import struct
from collections import deque
from collections.abc import Callable, Generator
from dataclasses import dataclass
from typing import Final

from bridge.southbound.bus.frame import Frame
from bridge.southbound.canopen import abort

_MUX: Final = struct.Struct("<BHB")
_CODE: Final = struct.Struct("<I")
_ABORT: Final = 0x80
_SEGMENT: Final = 7
MOST_BYTES: Final = 1 << 20
"""Longest value taken from a server: longer ones are a fault of the server, not data."""


class SdoError(Exception):
    """A transfer failed. ``code`` is the abort code, also for a time-out on our side."""

    def __init__(self, index: int, sub: int, code: int, *, by_server: bool) -> None:
        self.index, self.sub, self.code, self.by_server = index, sub, code, by_server
        who = "the node aborted" if by_server else "no valid answer"
        super().__init__(f"{index:04X}h:{sub:02X}: {who}: {abort.text(code)} ({code:08X}h)")


@dataclass(frozen=True, slots=True)
class Exchange:
    """One request and the mark of its reply: ``reply[0] & mask == command`` and, where the reply
    carries it, the multiplexer."""

    request: bytes
    mask: int
    command: int
    with_mux: bool


Transfer = Generator[Exchange, bytes, bytes]
Result = bytes | SdoError


def upload(index: int, sub: int) -> Transfer:
    """Read an object, expedited or segmented; returns its bytes."""
    reply = yield Exchange(_MUX.pack(0x40, index, sub) + bytes(4), 0xE0, 0x40, True)
    command = reply[0]
    if command & 2:  # expedited
        length = 4 - (command >> 2 & 3) if command & 1 else 4
        return reply[4 : 4 + length]
    announced = _CODE.unpack_from(reply, 4)[0] if command & 1 else None
    if announced is not None and announced > MOST_BYTES:
        raise SdoError(index, sub, abort.OUT_OF_MEMORY, by_server=False)
    data = bytearray()
    toggle = 0
    while True:
        reply = yield Exchange(bytes((0x60 | toggle,)) + bytes(7), 0xE0, 0x00, False)
        if reply[0] & 0x10 != toggle:
            raise SdoError(index, sub, abort.TOGGLE, by_server=False)
        data += reply[1 : 8 - (reply[0] >> 1 & 7)]
        if len(data) > MOST_BYTES:
            raise SdoError(index, sub, abort.OUT_OF_MEMORY, by_server=False)
        if reply[0] & 1:
            break
        toggle ^= 0x10
    if announced is not None and len(data) != announced:
        raise SdoError(index, sub, abort.LENGTH_TOO_HIGH, by_server=False)
    return bytes(data)


def download(index: int, sub: int, data: bytes) -> Transfer:
    """Write an object: expedited up to four bytes, segmented above; returns nothing of interest."""
    if 0 < len(data) <= 4:
        command = 0x23 | (4 - len(data)) << 2
        yield Exchange(_MUX.pack(command, index, sub) + data.ljust(4, b"\0"), 0xE0, 0x60, True)
        return b""
    yield Exchange(_MUX.pack(0x21, index, sub) + _CODE.pack(len(data)), 0xE0, 0x60, True)
    toggle = 0
    for start in range(0, max(len(data), 1), _SEGMENT):
        part = data[start : start + _SEGMENT]
        last = start + _SEGMENT >= len(data)
        command = toggle | (_SEGMENT - len(part)) << 1 | last
        reply = yield Exchange(bytes((command,)) + part.ljust(_SEGMENT, b"\0"), 0xE0, 0x20, False)
        if reply[0] & 0x10 != toggle:
            raise SdoError(index, sub, abort.TOGGLE, by_server=False)
        toggle ^= 0x10
    return b""


@dataclass(slots=True)
class _Job:
    index: int
    sub: int
    transfer: Transfer
    done: Callable[[Result], None]


class SdoChannel:
    """One client channel. One transfer at a time; the others wait in order, commands before polls.

    ``on_frame`` and ``on_time`` take monotonic seconds; ``take_frames`` gives what is to be sent.
    """

    def __init__(self, request_id: int, reply_id: int, timeout_s: float) -> None:
        self.request_id = request_id
        self.reply_id = reply_id
        self.timeout_s = timeout_s
        self.unmatched = 0
        self.last_abort = 0
        """Code of the last transfer that the server aborted or did not answer."""
        self._urgent: deque[_Job] = deque()
        self._patient: deque[_Job] = deque()
        self._job: _Job | None = None
        self._exchange: Exchange | None = None
        self._deadline: float | None = None
        self._frames: list[Frame] = []

    @property
    def waiting(self) -> int:
        """Transfers that have not ended yet."""
        return len(self._urgent) + len(self._patient) + (self._job is not None)

    def read(
        self, index: int, sub: int, now: float, done: Callable[[Result], None], *, urgent: bool = True
    ) -> None:
        self._submit(_Job(index, sub, upload(index, sub), done), now, urgent)

    def write(
        self,
        index: int,
        sub: int,
        data: bytes,
        now: float,
        done: Callable[[Result], None],
        *,
        urgent: bool = True,
    ) -> None:
        self._submit(_Job(index, sub, download(index, sub, data), done), now, urgent)

    def _submit(self, job: _Job, now: float, urgent: bool) -> None:
        (self._urgent if urgent else self._patient).append(job)
        if self._job is None:
            self._next(now)

    def on_frame(self, frame: Frame) -> None:
        """A frame on the reply COB-ID."""
        data, exchange, job = frame.data, self._exchange, self._job
        if exchange is None or job is None or len(data) != 8:
            self.unmatched += 1
            return
        _, index, sub = _MUX.unpack_from(data)
        same = index == job.index and sub == job.sub
        if data[0] == _ABORT:
            if same:
                code = _CODE.unpack_from(data, 4)[0]
                self._end(SdoError(job.index, job.sub, code, by_server=True), frame.time)
            else:
                self.unmatched += 1
            return
        if data[0] & exchange.mask != exchange.command or (exchange.with_mux and not same):
            self.unmatched += 1
            return
        self._advance(data, frame.time)

    def on_time(self, now: float) -> None:
        if self._deadline is not None and now >= self._deadline and self._job is not None:
            self._fail_here(SdoError(self._job.index, self._job.sub, abort.TIMED_OUT, by_server=False), now)

    def next_deadline(self) -> float | None:
        return self._deadline

    def take_frames(self) -> list[Frame]:
        frames, self._frames = self._frames, []
        return frames

    def flush(self, now: float) -> None:
        """End everything that waits: the node or the bus is gone. Nothing more is sent."""
        jobs = [job for job in (self._job, *self._urgent, *self._patient) if job is not None]
        self._urgent.clear()
        self._patient.clear()
        self._job = self._exchange = self._deadline = None
        self._frames.clear()
        for job in jobs:
            job.done(SdoError(job.index, job.sub, abort.TIMED_OUT, by_server=False))

    def _next(self, now: float) -> None:
        while self._job is None and (self._urgent or self._patient):
            self._job = (self._urgent or self._patient).popleft()
            self._advance(None, now)

    def _advance(self, reply: bytes | None, now: float) -> None:
        job = self._job
        if job is None:
            return
        try:
            self._exchange = next(job.transfer) if reply is None else job.transfer.send(reply)
        except StopIteration as end:
            self._end(end.value, now)
        except SdoError as error:
            self._fail_here(error, now)
        else:
            self._frames.append(Frame(self.request_id, self._exchange.request))
            self._deadline = now + self.timeout_s

    def _fail_here(self, error: SdoError, now: float) -> None:
        """We give up: tell the server, then the one who asked."""
        self._frames.append(
            Frame(self.request_id, _MUX.pack(_ABORT, error.index, error.sub) + _CODE.pack(error.code))
        )
        self._end(error, now)

    def _end(self, result: Result, now: float) -> None:
        job, self._job, self._exchange, self._deadline = self._job, None, None, None
        if isinstance(result, SdoError):
            self.last_abort = result.code
        if job is not None:
            job.done(result)
        self._next(now)
