"""The tape: everything outside of the core, as the core sees it. What it gives to the core are inputs, what
it takes are outputs; both are notes of the turn in which they are.

A note is one value that MessagePack has: a float is a look at the clock, a list begins with its kind.
"""

from __future__ import annotations

import random
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Any, Final, TypeVar

import msgspec

from bridge.base import clock
from bridge.base.guard import Guard
from bridge.base.turns import UNHEARD, Turn, Turns
from bridge.can.burstend import Burst
from bridge.can.interface import Bus, BusStatus, ControllerState
from bridge.canopen.frame import Frame
from bridge.command import Event, Identity, Outcome, Rejection, Reply, Request
from bridge.master.standstill import SignalAlarm
from bridge.master.suspend import SuspendWatch
from bridge.mirror import protocol
from bridge.mirror.protocol import Answered, Connected, Malformed, Rejected
from bridge.text import Said

Notes = list[Any]
"""The notes of one turn: its kind, its arguments, then the notes proper."""

_Result = TypeVar("_Result")
_OF_THE_CORE: Final = frozenset((Turn.TAKE_IN, Turn.PUMP))
"""Turns that the core itself begins within others."""
_COUNTS: Final = (
    "outages",
    "tx_errors",
    "rx_errors",
    "frames_lost",
    "frames_received",
    "frames_expired",
    "bits",
    "error_frames",
)
"""Counters of a status, in the order of a note."""
STATUS_EVERY_S: Final = 0.1
"""Counters are noted no more often than this, seconds, and whatever concerns the core at once."""


class Note(StrEnum):
    """Kind of a note."""

    __hash__ = str.__hash__

    # inputs
    FRAMES = "frames"
    FOREIGN = "foreign"
    STATUS = "status"
    RANG = "rang"
    SLEPT = "slept"
    WALL_CLOCK = "wall_clock"
    CHANCE = "chance"
    TURN = "turn"
    """A turn that a server begins in answer to an outcome or an event, within the one that gave it."""
    # outputs
    SEND = "send"
    BURST = "burst"
    END_BURST = "end_burst"
    ACCEPT = "accept"
    WATCH = "watch"
    EVENT = "event"
    OUTCOME = "outcome"
    FAULT = "fault"


class Tape(Turns, ABC):
    """Surroundings of the core of one process: a clock, chance, and by name its buses. ``tell`` takes
    notes of outputs, and ``on_event`` the plant's events."""

    @abstractmethod
    def now(self) -> float:
        """The clock, in monotonic seconds."""

    @abstractmethod
    def epoch_ns(self, at: float) -> int:
        """The wall clock at a monotonic time, in ns."""

    @abstractmethod
    def slept(self) -> float:
        """Seconds for which the machine was suspended since the last call."""

    @abstractmethod
    def chance(self) -> float:
        """A random number from 0 to 1."""

    def reply_of(self, number: int) -> Reply:
        """The reply to the request of this number."""
        return NumberedReply(self, number)

    def answered(self, number: int, outcome: Outcome) -> None:
        self.tell(Note.OUTCOME, number, protocol.encode(Answered(outcome, 0, 0)))

    def on_event(self, event: Event) -> None:
        # The cause is found by what is not of the core.
        self.tell(Note.EVENT, protocol.encode(replace(event, because="")))

    @abstractmethod
    def tell(self, note: Note, *facts: object) -> None:
        """Take a note with its facts."""


@dataclass(frozen=True, slots=True)
class NumberedReply:
    """The reply to a request, known by its number."""

    tape: Tape
    number: int

    def __call__(self, outcome: Outcome) -> None:
        self.tape.answered(self.number, outcome)


def _told(turn: Turn, *arguments: Any) -> list[Any]:
    """The arguments of a turn as a tape has them."""
    match turn, arguments:
        case Turn.SUBMIT, (Request() as request,):
            return [protocol.encode_request(request, 0.0)]
        case Turn.REJECTED, (Rejection() as rejection, at, count):
            return [protocol.encode(Rejected(at or 0.0, count, rejection)), at is None]
        case Turn.CONNECTION, (Identity() as identity, is_there, has_others):
            return [protocol.encode(Connected(identity, is_there, has_others))]
        case Turn.REPORT, (Event() as event,):
            return [protocol.encode(event)]
        case ((Turn.HALT | Turn.COUNT | Turn.LOOK), _):
            return list(arguments)
        case _:
            return []


class RecordingTape(Tape):
    """A tape that gives the core what is outside, and takes notes. ``take`` gets the notes of each turn, in
    MessagePack.

    Nothing is noted while it is not ``is_on``; it goes off by itself at what no tape can hold.
    """

    def __init__(
        self,
        take: Callable[[bytes], None],
        *,
        now: Callable[[], float] = clock.now,
        epoch_ns: Callable[[float], int] = clock.epoch_ns,
        slept: Callable[[], float] = lambda: 0.0,
        chance: Callable[[], float] = random.random,
    ) -> None:
        self.is_on = False
        self.count = 0
        """Number of requests so far."""
        self.last = 0.0
        """Time of the last look at the clock."""
        self.notes: Notes | None = None
        """Notes of the turn that is on."""
        self.replies: dict[int, Reply] = {}
        self._take = take
        self._now = now
        self._epoch_ns = epoch_ns
        self._slept = slept
        self._chance = chance
        self._encode = msgspec.msgpack.Encoder().encode
        self._guard = Guard("note")

    def begin(self, turn: Turn, *arguments: object) -> AbstractContextManager[None]:
        within = self.notes
        if not self.is_on or (within is not None and turn in _OF_THE_CORE):
            return UNHEARD
        try:
            told = _told(turn, *arguments)
        except Malformed:
            self.is_on = False
            return UNHEARD
        if turn is Turn.SUBMIT:
            told.append(self.count + 1)
        if within is not None:
            within.append((Note.TURN, turn, told))
            return UNHEARD
        self.notes = [turn, told]
        return self

    def heard(self, reply: Reply) -> Reply:
        if not self.is_on:
            return reply
        self.count += 1
        self.replies[self.count] = reply
        return self.reply_of(self.count)

    def __enter__(self) -> None:
        """Nothing: the turn has begun."""

    def __exit__(self, kind: object, error: BaseException | None, traceback: object) -> None:
        notes, self.notes = self.notes, None
        if notes is None or (error and not isinstance(error, Exception)):
            return
        if error:
            notes.append((Note.FAULT, type(error).__name__))
        self._end(notes)

    def _end(self, notes: Notes) -> None:
        try:
            turn = self._encode(notes)
        except (ValueError, TypeError, OverflowError):
            self.is_on = False
        else:
            self._take(turn)

    def answered(self, number: int, outcome: Outcome) -> None:
        # Whoever asked gets the outcome, whatever becomes of the note.
        with self._guard:
            super().answered(number, outcome)
        self.replies.pop(number)(outcome)

    def now(self) -> float:
        self.last = at = self._now()
        if self.notes is not None:
            self.notes.append(at)
        return at

    def epoch_ns(self, at: float) -> int:
        return self._noted(Note.WALL_CLOCK, self._epoch_ns(at))

    def slept(self) -> float:
        slept_s = self._slept()
        return self._noted(Note.SLEPT, slept_s) if slept_s else 0.0

    def chance(self) -> float:
        return self._noted(Note.CHANCE, self._chance())

    def _noted(self, note: Note, value: _Result) -> _Result:
        self.tell(note, value)
        return value

    def tell(self, note: Note, *facts: object) -> None:
        if self.notes is not None:
            self.notes.append((note, *facts))


def machine_tape(take: Callable[[bytes], None] = lambda turn: None) -> RecordingTape:
    """The tape with this machine around it."""
    return RecordingTape(take, slept=SuspendWatch(clock.suspended_s).take)


class RecordedAlarm(SignalAlarm):
    """The alarm of a bridge that is recorded."""

    def __init__(self, tape: RecordingTape) -> None:
        super().__init__()
        self._tape = tape

    def ring(self) -> None:
        self._tape.tell(Note.RANG, self.breaks_in)
        super().ring()


class TapedBus:
    """The bus ``bus`` on a tape (``bridge.can.interface.Bus``)."""

    def __init__(self, bus: Bus, tape: RecordingTape) -> None:
        self.name = bus.name
        self._bus = bus
        self._tape = tape
        self._shown: tuple[object, ...] = ()
        self._told_at = 0.0

    @property
    def status(self) -> BusStatus:
        status = self._bus.status
        shown = status.state, status.outages, status.bursts_refused, status.error_frames
        tape = self._tape
        if shown != self._shown or tape.last > self._told_at + STATUS_EVERY_S:
            self._shown, self._told_at = shown, tape.last
            tape.tell(Note.STATUS, self.name, *facts_of(status))
        return status

    def facts(self) -> Sequence[Any]:
        """The status as it is, for a checkpoint."""
        return facts_of(self._bus.status)

    def open(self, wake: Callable[[], None]) -> None:
        self._bus.open(wake)

    def accept(self, can_ids: list[int]) -> None:
        self._tape.tell(Note.ACCEPT, self.name, can_ids)
        self._bus.accept(can_ids)

    def watch(self, can_ids: frozenset[int]) -> None:
        self._tape.tell(Note.WATCH, self.name, sorted(can_ids))
        self._bus.watch(can_ids)

    def take_foreign(self, now: float, *, at_once: bool = False) -> list[Frame]:
        frames = self._bus.take_foreign(now, at_once=at_once)
        self._tape.tell(Note.FOREIGN, self.name, frames)
        return frames

    def drain(self, now: float) -> list[Frame]:
        frames = self._bus.drain(now)
        self._tape.tell(Note.FRAMES, self.name, frames)
        return frames

    def send(self, frame: Frame, now: float, deadline: float) -> None:
        self._tape.tell(Note.SEND, self.name, frame.can_id, frame.data)
        self._bus.send(frame, now, deadline)

    def burst(self, burst: Burst, now: float, *, at_once: bool = False) -> None:
        self._tape.tell(Note.BURST, self.name, burst, at_once)
        self._bus.burst(burst, now, at_once=at_once)

    def end_burst(self, can_id: int) -> None:
        self._tape.tell(Note.END_BURST, self.name, can_id)
        self._bus.end_burst(can_id)

    def next_deadline(self) -> float | None:
        return self._bus.next_deadline()

    def on_time(self, now: float) -> None:
        self._bus.on_time(now)

    def close(self) -> None:
        self._bus.close()


def facts_of(status: BusStatus) -> Sequence[Any]:
    """The fields of a status, for a note."""
    counts = (getattr(status, name) for name in _COUNTS)
    return int(status.state), *counts, status.bursts_refused, msgspec.msgpack.encode(status.last_error)


def apply_facts(status: BusStatus, facts: Sequence[Any]) -> None:
    """The other way round."""
    state, *counts, refused, error = facts
    status.state, status.bursts_refused = ControllerState(state), refused
    for name, count in zip(_COUNTS, counts, strict=True):
        setattr(status, name, count)
    status.note_error(msgspec.msgpack.decode(error, type=Said))
