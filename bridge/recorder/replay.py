"""A replay: the inputs of a recording through the same core, on the clock of the recording. Sans-IO.

The core must look at the clock, ask its buses and send what it did then; the first difference ends the
replay, and names its place.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from hashlib import sha256
from typing import Any, cast

import msgspec

from bridge.base.turns import Turn
from bridge.can.burstend import Burst
from bridge.can.interface import BusStatus
from bridge.canopen.frame import Frame
from bridge.command import Event, PlantView
from bridge.command.plant import Plant
from bridge.master.master import Master
from bridge.master.standstill import StoodStill, WatchdogTimer
from bridge.mirror import protocol
from bridge.mirror.protocol import Connected, Rejected
from bridge.recorder import checkpoint
from bridge.recorder.core_names import Unusable
from bridge.recorder.recording import Segment, notes_of
from bridge.recorder.tape import Note, Notes, Tape, apply_facts

_encode = msgspec.msgpack.encode


class Difference(BaseException):
    """The replay is not what was recorded. ``turn`` is the number of the turn in its segment.

    Nothing in the core may catch it."""

    def __init__(self, why: str) -> None:
        super().__init__(why)
        self.turn = 0
        self.time = 0.0


@dataclass(frozen=True, slots=True)
class Core:
    """The root of all state, as a checkpoint has it."""

    master: Master
    view: PlantView
    plant: Plant


class PlayedAlarm(WatchdogTimer):
    """The alarm of a replay, which rings where it rang."""

    def set(self, seconds: float) -> None:
        self.rang = False

    def ring(self, *, broke_in: bool) -> None:
        self.rang = True
        if broke_in:
            self.breaks_in = False
            raise StoodStill


class PlayingTape(Tape):
    """A tape that gives what was noted, and compares what it is told. ``hash`` is that of all outputs."""

    def __init__(self) -> None:
        self.alarm = PlayedAlarm()
        self.time = 0.0
        """Time of the last look at the clock."""
        self.told = 0
        """Number of outputs that it has been told of."""
        self.hash = sha256()
        self.nested: Callable[[Notes], None] = lambda notes: None
        """Does a turn within one."""
        self._notes: deque[Any] = deque()

    def lay(self, notes: Notes) -> None:
        """Lay the notes of the next turn on it."""
        self._notes = deque(notes)

    def end(self) -> None:
        """Raises ``Difference`` where the turn was longer then."""
        self._ring()
        if self._notes:
            raise Difference(f"the recording goes on with {_said(self._notes[0])}")

    def comes(self, note: Note, bus: str) -> bool:
        """True if a note of this bus comes next."""
        self._ring()
        return self._comes(note) and bool(self._notes[0][1] == bus)

    def _comes(self, note: Note) -> bool:
        first: Any = self._notes[0] if self._notes else 0.0
        return not isinstance(first, float) and bool(first[0] == note)

    def take(self, note: Note, *which: object) -> list[Any]:
        """The facts of the next note, which must be of this kind, after those in ``which``."""
        noted = self._next(note)
        head = 1 + len(which)
        if not isinstance(noted, list) or noted[:head] != [note, *which]:
            raise Difference(f"{_said(noted)} was recorded, and the replay has {note}")
        return cast("list[Any]", noted)[head:]

    def _next(self, wanted: str) -> Any:
        self._ring()
        if not self._notes:
            raise Difference(f"the recorded turn ends where the replay has {wanted}")
        return self._notes.popleft()

    def _ring(self) -> None:
        while self._comes(Note.RANG):
            _, broke_in = self._notes.popleft()
            self.alarm.ring(broke_in=broke_in)

    # Tape

    def now(self) -> float:
        at = self._next("a look at the clock")
        if not isinstance(at, float):
            raise Difference(f"{_said(at)} was recorded, and the replay looks at the clock")
        self.time = at
        return at

    def epoch_ns(self, at: float) -> int:
        return self.take(Note.WALL_CLOCK)[0]

    def slept(self) -> float:
        self._ring()
        return self.take(Note.SLEPT)[0] if self._comes(Note.SLEPT) else 0.0

    def chance(self) -> float:
        return self.take(Note.CHANCE)[0]

    def tell(self, note: Note, *facts: object) -> None:
        told = _encode((note, *facts))
        noted = self._next(note)
        if told != _encode(noted):
            now = msgspec.msgpack.decode(told)
            raise Difference(f"{_said(noted)} was recorded, and the replay has {_said(now)}")
        self.told += 1
        self.hash.update(told)
        if note in (Note.EVENT, Note.OUTCOME):
            while self._comes(Note.TURN):
                self.nested(self._notes.popleft()[1:])


def _said(note: Any) -> str:
    """A note in short."""
    text = "a look at the clock" if isinstance(note, float) else " ".join(map(str, note))
    return text if len(text) < 200 else f"{text[:200]}…"


class PlayedBus:
    """A bus of a replay (``bridge.can.interface.Bus``)."""

    def __init__(self, name: str, tape: PlayingTape, facts: Sequence[Any]) -> None:
        self.name = name
        self._tape = tape
        self._status = BusStatus()
        apply_facts(self._status, facts)

    @property
    def status(self) -> BusStatus:
        if self._tape.comes(Note.STATUS, self.name):
            apply_facts(self._status, self._tape.take(Note.STATUS, self.name))
        return self._status

    def open(self, wake: Callable[[], None]) -> None:
        """Nothing wakes a replay but its recording."""

    def accept(self, can_ids: list[int]) -> None:
        self._tape.tell(Note.ACCEPT, self.name, can_ids)

    def watch(self, can_ids: frozenset[int]) -> None:
        self._tape.tell(Note.WATCH, self.name, sorted(can_ids))

    def take_foreign(self, now: float, *, at_once: bool = False) -> list[Frame]:
        return self._frames(Note.FOREIGN)

    def drain(self, now: float) -> list[Frame]:
        return self._frames(Note.FRAMES)

    def _frames(self, note: Note) -> list[Frame]:
        (frames,) = self._tape.take(note, self.name)
        return [Frame(*frame) for frame in frames]

    def send(self, frame: Frame, now: float, deadline: float) -> None:
        self._tape.tell(Note.SEND, self.name, frame.can_id, frame.data)

    def burst(self, burst: Burst, now: float, *, at_once: bool = False) -> None:
        self._tape.tell(Note.BURST, self.name, burst, at_once)

    def end_burst(self, can_id: int) -> None:
        self._tape.tell(Note.END_BURST, self.name, can_id)

    def next_deadline(self) -> float | None:
        return None

    def on_time(self, now: float) -> None:
        """Nothing: what is due is an output already."""

    def close(self) -> None:
        """There is nothing open."""


class Replay:
    """The replay of one segment. Raises ``Unusable`` where its checkpoint cannot be used."""

    def __init__(self, segment: Segment) -> None:
        if segment.state is None:
            raise Unusable("the segment has no checkpoint")
        self.tape = PlayingTape()
        self.tape.nested = self._do
        self.turns = 0
        """Number of turns that have been played."""
        self._segment = segment
        buses = {name: PlayedBus(name, self.tape, facts) for name, facts in segment.state.buses.items()}
        root = checkpoint.load(segment.state.core, self.tape, buses.__getitem__, self.tape.alarm)
        self.core = Core(*root)
        self.core.master.attach(lambda at: None)

    @property
    def time(self) -> float:
        """Time of the replay in monotonic seconds."""
        return self.tape.time or self._segment.header.began

    def step(self) -> Notes | None:
        """Play one turn; returns its notes, or None at the end. Raises ``Difference``."""
        if self.turns == len(self._segment.turns):
            return None
        notes = notes_of(self._segment.turns[self.turns])
        self.turns += 1
        kind, arguments, *rest = notes
        self.tape.lay(rest)
        try:
            try:
                self._do([kind, arguments])
            except Difference:
                raise
            except Exception as error:  # noqa: BLE001 - as the tape has it
                self.tape.tell(Note.FAULT, type(error).__name__)
            self.tape.end()
        except Difference as difference:
            difference.turn, difference.time = self.turns, self.time
            raise
        return notes

    def _do(self, turn: Notes) -> None:
        kind, arguments = turn
        core = self.core
        match Turn(kind), arguments:
            case Turn.TAKE_IN, _:
                core.master.on_bus()
            case Turn.PUMP, _:
                core.master.wake()
            case Turn.HALT, [now]:
                core.master.halt(now)
            case Turn.STOP_NODES, _:
                core.master.stop_nodes()
            case Turn.SUBMIT, [asked, number]:
                request, _ = protocol.decode_request(asked)
                core.view.submit(request, self.tape.reply_of(number))
            case Turn.REJECTED, [told, is_now]:
                rejected = protocol.decode(Rejected, told)
                core.view.rejected(rejected.rejection, None if is_now else rejected.time_s, rejected.count)
            case Turn.COUNT, [leaf, by]:
                core.view.count(leaf, by)
            case Turn.CONNECTION, [told]:
                one = protocol.decode(Connected, told)
                core.view.on_connection(one.identity, is_there=one.is_there, has_others=one.has_others)
            case Turn.REPORT, [told]:
                core.plant.report(protocol.decode(Event, told))
            case Turn.LOOK, [drive]:
                core.view.look(drive)
            case _:
                raise Difference(f"a turn of an unknown kind: {kind}")
