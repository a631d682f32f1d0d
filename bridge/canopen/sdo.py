"""SDO client (CiA 301 §7.2.4): one channel to one server, its queue and its time-outs.

The transfers themselves are generators (``sdo_transfer``, ``sdo_block``). A frame from the server that does
not answer the last request (late, repeated, about another object) is counted and dropped, never taken for an
answer.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, TypeVar

from bridge.canopen import abort
from bridge.canopen.frame import Frame
from bridge.canopen.sdo_block import BlockUse, Learned, read_object, write_object
from bridge.canopen.sdo_queue import Priority, SdoJob, SdoQueue
from bridge.canopen.sdo_transfer import (
    ABORT,
    MUX,
    U32,
    Result,
    SdoError,
    SdoExchange,
    Transfer,
    abort_request,
)

SEGMENTS_AT_ONCE: Final = 8
"""This many frames of a block are sent at once: a block has up to 127, more than a driver's queue holds."""
COMMANDS: Final = frozenset((0x1010, 0x1011))
"""Writing them is a command (store and restore, CiA 301 §7.5.2.13–14): never repeated."""
_COMMAND_S: Final = 10.0
"""A node may take this long for one: it saves all its parameters before it answers."""
_MOST_OWED: Final = 8
"""No more late answers than this are expected, however long a node is silent."""

T = TypeVar("T")


@dataclass(slots=True)
class _Owed:
    """Answers that may still come after we have given up waiting for them or have asked again."""

    index: int
    sub: int
    until: float
    answers: int
    asked_at: float

    def is_about(self, job: SdoJob) -> bool:
        return (self.index, self.sub) == (job.index, job.sub)


class SdoChannel:
    """One client channel. One transfer runs at a time; others wait, by priority and then in order.

    ``on_frame`` and ``on_time`` take monotonic seconds; ``take_frames`` gives what is to be sent. A
    transfer that fails by time-out or by a damaged answer is repeated ``retries`` times. ``done`` of each
    transfer is called once, possibly before ``read`` or ``write`` returns. ``segment_s`` is the time to
    leave to each frame of a block, so that it does not fill the bus and the driver's queue.
    ``why_no_block`` is what was learned of this server before: it is not asked for block transfer.
    """

    def __init__(
        self,
        request_id: int,
        reply_id: int,
        timeout_s: float,
        *,
        retries: int = 0,
        segment_s: float = 0.001,
        why_no_block: str = "",
    ) -> None:
        self.request_id = request_id
        self.reply_id = reply_id
        self.timeout_s = timeout_s
        self.retries = retries
        self.unmatched = 0
        """Frames on the reply COB-ID that were no answer."""
        self.late = 0
        """Number of those that answered a request which we had given up."""
        self.lateness_s = 0.0
        """Time from its request to the last of these."""
        self._segment_s = segment_s
        self._queue = SdoQueue()
        self._block = BlockUse(bool(why_no_block))
        self._told_of_block = bool(why_no_block)
        self._job: SdoJob | None = None
        self._transfer: Transfer | None = None
        self._exchange: SdoExchange | None = None
        self._deadline: float | None = None
        self._frames: list[Frame] = []
        self._unsent: deque[bytes] = deque()
        self._send_at: float | None = None
        self._owed: _Owed | None = None
        self._asked_at = 0.0
        self._hold_until: float | None = None
        self._left: tuple[SdoJob, float] | None = None
        """The transfer that a flush has ended without a word to the server, and its deadline."""

    @property
    def waiting(self) -> int:
        """Transfers that have not ended yet."""
        return len(self._queue) + (self._job is not None)

    # asking

    def read(
        self,
        index: int,
        sub: int,
        now: float,
        done: Callable[[Result], None],
        *,
        priority: Priority = Priority.COMMAND,
    ) -> SdoJob:
        """Read an object: expedited, segmented or by blocks, as the server offers it."""

        def start(block: BlockUse) -> Transfer:
            return read_object(index, sub, block)

        return self._submit(SdoJob(index, sub, start, done, priority, self.retries, self.timeout_s), now)

    def write(
        self,
        index: int,
        sub: int,
        data: bytes,
        now: float,
        done: Callable[[Result], None],
        *,
        priority: Priority = Priority.COMMAND,
        repeatable: bool = True,
        may_begin: Callable[[], bool] | None = None,
    ) -> SdoJob:
        """Write an object. ``repeatable`` is false if a second write would have a second effect.
        ``may_begin`` is asked when the transfer's turn has come: if it returns false, nothing is sent, and
        the result is an error."""

        def start(block: BlockUse) -> Transfer:
            return write_object(index, sub, data, block)

        is_command = index in COMMANDS
        retries = self.retries if repeatable and not is_command else 0
        timeout_s = max(self.timeout_s, _COMMAND_S) if is_command else self.timeout_s
        return self._submit(SdoJob(index, sub, start, done, priority, retries, timeout_s, may_begin), now)

    def cancel(self, job: SdoJob, now: float) -> bool:
        """End this transfer without calling its ``done``; False if it has ended already."""
        if job is not self._job:
            return self._queue.remove(job)
        self._tell_abort(job, abort.GENERAL)
        self._owe(job, now)
        self._clear()
        self._next(now)
        return True

    def flush(self, now: float) -> None:
        """End all transfers, because the node or the bus is gone. Nothing more is sent; a server that is
        asked again so soon that it may still answer is told then that the transfer has ended."""
        if self._job and self._deadline is not None and not self._frames:
            self._left = self._job, self._deadline
        jobs = [self._job] if self._job else []
        jobs += self._queue
        self._queue.clear()
        self._clear()
        self._frames.clear()
        self._hold_until = None
        self._block = BlockUse(self._block.is_avoided, self._block.learned)
        for job in jobs:
            job.done(SdoError(job.index, job.sub, abort.TIMED_OUT, by_server=False))

    def take_learned(self) -> Learned | None:
        """Reason why the server is not asked for block transfer any more, given once when that was found out;
        else None."""
        if self._told_of_block or self._block.learned is None:
            return None
        self._told_of_block = True
        return self._block.learned

    def forget_block(self) -> None:
        """Another device is there: it is asked for block transfer again."""
        self._block = BlockUse()
        self._told_of_block = False

    def _submit(self, job: SdoJob, now: float) -> SdoJob:
        refused = self._queue.add(job)
        if self._job is None:
            self._next(now)
        if refused:
            refused.done(SdoError(refused.index, refused.sub, abort.BUSY, by_server=False))
        return job

    # frames and time

    def on_frame(self, frame: Frame) -> None:
        """A frame on the reply COB-ID."""
        data, exchange, job, transfer = frame.data, self._exchange, self._job, self._transfer
        if len(data) != 8 or job is None or transfer is None or exchange is None or exchange.reply is None:
            self._pass_over(data, frame.time)
        elif data[0] == ABORT:
            if MUX.unpack_from(data, 1) == (job.index, job.sub):
                code: int = U32.unpack_from(data, 4)[0]
                error = SdoError(job.index, job.sub, code, by_server=True)
                self._resume(transfer.throw, error, frame.time)
            else:
                self._pass_over(data, frame.time)
        elif exchange.reply.fits(data, len(self._unsent)):
            if exchange.reply.mux and self._owed and self._owed.is_about(job):
                self._owed.asked_at = (
                    self._asked_at
                )  # it may have answered the request before: this one's is owed
            self._resume(transfer.send, data, frame.time)
        else:
            self._pass_over(data, frame.time)

    def _pass_over(self, data: bytes, now: float) -> None:
        self.unmatched += 1
        owed = self._owed
        if owed and len(data) == 8 and MUX.unpack_from(data, 1) == (owed.index, owed.sub):
            self.late += 1
            self.lateness_s = now - owed.asked_at
            owed.answers -= 1
            self._owed = owed if owed.answers else None

    def on_time(self, now: float) -> None:
        if self._send_at is not None and now >= self._send_at:
            self._send_some(now)
        job, transfer = self._job, self._transfer
        if job is None or transfer is None:
            if self._hold_until is not None and (now >= self._hold_until or self._owed is None):
                self._next(now)
        elif self._deadline is not None and now >= self._deadline:
            error = SdoError(job.index, job.sub, abort.TIMED_OUT, by_server=False)
            awaited = self._exchange.reply if self._exchange else None
            self._resume(transfer.throw, error, now)
            if self._transfer is transfer and awaited is not None and awaited.mux:
                self._owe(job, now)  # it goes on another way, and that answer may still come

    def next_deadline(self) -> float | None:
        times = (self._send_at, self._hold_until, self._deadline)
        return min((time for time in times if time is not None), default=None)

    def take_frames(self) -> list[Frame]:
        frames, self._frames = self._frames, []
        return frames

    # the transfer that runs

    def _next(self, now: float) -> None:
        """Begin the next transfer. One about an object with an answer outstanding has to wait: it could take
        that answer for its own."""
        self._hold_until = None
        owed = self._owed if self._owed and now < self._owed.until else None
        for job in self._queue:
            if owed is None or not owed.is_about(job):
                self._queue.remove(job)
                self._begin(job, now)
                return
        if owed and len(self._queue):
            self._hold_until = owed.until

    def _begin(self, job: SdoJob, now: float) -> None:
        self._job = job
        if job.may_begin is not None and not job.may_begin():
            self._end(SdoError(job.index, job.sub, abort.GENERAL, by_server=False), now)
            return
        left, self._left = self._left, None
        if left and now < left[1]:
            # A server has one transfer at a time (CiA 301 §7.2.4.1).
            self._tell_abort(left[0], abort.GENERAL)
        transfer = self._transfer = job.start(self._block)
        self._resume(next, transfer, now)

    def _resume(self, step: Callable[[T], SdoExchange], argument: T, now: float) -> None:
        """Resume the transfer and send its frames."""
        transfer = self._transfer
        if transfer is None:
            return
        self._unsent.clear()
        self._send_at = None
        try:
            exchange = step(argument)
            while exchange.reply is None:
                self._frames += [Frame(self.request_id, request) for request in exchange.requests]
                exchange = transfer.send(b"")
        except StopIteration as end:
            self._end(end.value, now)
        except SdoError as error:
            self._fail(error, now)
        else:
            self._exchange = exchange
            self._unsent.extend(exchange.requests)
            self._send_some(now)

    def _send_some(self, now: float) -> None:
        """Send the next frames of the exchange; the time-out begins with the last one."""
        self._asked_at = now
        most = SEGMENTS_AT_ONCE if self._segment_s else len(self._unsent)
        for _ in range(min(most, len(self._unsent))):
            self._frames.append(Frame(self.request_id, self._unsent.popleft()))
        self._send_at = now + SEGMENTS_AT_ONCE * self._segment_s if self._unsent else None
        if self._job:
            self._deadline = now + self._job.timeout_s

    def _fail(self, error: SdoError, now: float) -> None:
        """The transfer has failed: repeat it, or report the failure to the caller."""
        job = self._job
        if job is None:
            return
        if not error.by_server:
            self._tell_abort(job, error.code)
            self._owe(job, now)
        if job.retries_left and error.code in abort.TRANSIENT:
            job.retries_left -= 1
            self._begin(job, now)
        else:
            self._end(error, now)

    def _tell_abort(self, job: SdoJob, code: int) -> None:
        self._frames.append(Frame(self.request_id, abort_request(job.index, job.sub, code)))

    def _owe(self, job: SdoJob, now: float) -> None:
        owed = self._owed if self._owed and self._owed.is_about(job) and self._owed.answers else None
        answers = min(owed.answers + 1, _MOST_OWED) if owed else 1
        asked_at = owed.asked_at if owed else self._asked_at
        self._owed = _Owed(job.index, job.sub, now + job.timeout_s, answers, asked_at)

    def _clear(self) -> None:
        self._job = self._transfer = self._exchange = self._deadline = self._send_at = None

    def _end(self, result: Result, now: float) -> None:
        job = self._job
        self._clear()
        if not isinstance(result, SdoError) and job and self._owed and self._owed.is_about(job):
            # It may have answered the first attempt: then the second's answer is still to come.
            self._owed.until = now + job.timeout_s
        if job is not None:
            job.done(result)
        if self._job is None:
            self._next(now)
