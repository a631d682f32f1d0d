"""Judge of a node's outputs: whether they have the values that its last stop gives them. Sans-IO.

docs/explanation/dead-man-chain.md, "Outputs". Nothing comes back of an output by itself, so it is read: by an
SDO upload of its object, or by a TPDO of the node that carries it. Nothing is called ignored that may be
something else, and nothing followed that has not been seen:

- The bound begins when the stop has been handed to the bus, not when it was decided.
- An answer is as old as its question: what was asked, or sent by the node, before the frame has had its time
  on the way says nothing.
- An output that has another value is read again after the bound. Only a question asked then, or a telegram
  received then, makes an ignored stop of it; never mere time.
- A node that was silent may not have heard us: its bound begins anew with its next sign.
- An output that cannot be read leaves the stop forwarded, with the reason.
- Where a TPDO brings an output regularly, that counts, and it is not asked for. One that comes on change
  counts beside the answers.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf
from typing import Final

from bridge.command.stop_check.state import LastStop, StopVerdict
from bridge.mapping.entry_types import ObjectRef
from bridge.text import Said, Text

_AGAIN_S: Final = 1.0
"""Pause before what was ignored, or has not been answered, is read again."""
_UNREAD: Final = Text.of("outputs.unread")
_AWAY: Final = Text.of("outputs.away")


@dataclass(frozen=True, slots=True)
class StoppedOutput:
    """Output called ``name``, and the value that a stop gives it: ``raw``, an integer without sign of
    ``size`` bits. ``told_by`` is the TPDO that brings it regularly, empty where it has to be read."""

    name: str
    object: ObjectRef
    size: int
    raw: int
    told_by: str = ""

    @property
    def place(self) -> str:
        return f"{self.object.index:04X}h:{self.object.sub:02X}"

    def shown(self, raw: int) -> str:
        return f"{raw:0{-(-self.size // 4)}X}h"


@dataclass(frozen=True, slots=True)
class Question:
    """An output that is to be read now; ``stop`` counts the stops, and ``asked_at`` is monotonic seconds."""

    stop: int
    place: int
    output: StoppedOutput
    asked_at: float


@dataclass(frozen=True, slots=True)
class OutputReadback:
    """Content of the node's object, an integer without sign, or ``why`` that is not known: because the node
    said so, or because it was silent."""

    raw: int | None
    why: Said = ""
    was_silent: bool = False


@dataclass(slots=True)
class _Seen:
    """Content of one output ``at`` that time or later, None with the reason where that is not known."""

    raw: int | None = None
    at: float = -inf
    why: Said = ""


class OutputStopCheck:
    """Judge of the outputs of one node, which have one owner and stop together. Times are monotonic seconds.

    ``follows`` is kept while the node is not in operation. ``why`` says why the stop is not followed, or not
    known to be.
    """

    def __init__(self) -> None:
        self.last_stop = LastStop.NONE
        self.follows = True
        self.why: Said = ""
        self.awaits_sending = False
        """Another stop is to be sent, and has not been handed to the bus yet."""
        self.is_owed = False
        """A stop is on the bus that is not known to be followed: reports of the node are of interest."""
        self._sent: tuple[int, ...] | None = None
        self._is_there = False
        self._stop = 0
        """Count of the stops that were judged: an answer that comes late is about another one."""
        self._since: float | None = None
        """Time at which the stop was handed to the bus; None without one, and where the node is not there."""
        self._counts_from = inf
        """Time before which answers and telegrams may be older than the stop."""
        self._until = inf
        self._bound_s = 0.0
        self._outputs: Sequence[StoppedOutput] = ()
        self._seen: list[_Seen] = []
        self._asked: list[int] = []
        """The places of the outputs that have to be read, in turn."""
        self._turn = 0
        self._is_asking = False
        self._was_silent = False
        self._began_at = inf
        """Time at which the first of them was asked for in this turn."""
        self._read_at = inf
        self._disobeyed_at = -inf
        self._verdicts: list[StopVerdict] = []

    @property
    def is_judged(self) -> bool:
        """A stop is on the bus, and the node is in operation."""
        return self._since is not None

    @property
    def is_stuck(self) -> bool:
        """Nothing more will be known of the stop: the node has refused to let its outputs be read."""
        pairs = zip(self._outputs, self._seen, strict=True)
        awaits_tpdo = any(one.told_by and seen.raw is None for one, seen in pairs)
        awaits = self._is_asking or self._read_at < inf or awaits_tpdo
        return self.last_stop is LastStop.FORWARDED and self.is_judged and not awaits

    def sent_for_s(self, now: float) -> float:
        """Time in seconds for which the stop has been on the bus; 0 where it is not, or not judged."""
        return 0.0 if self._since is None or self.awaits_sending else max(0.0, now - self._since)

    # what we do

    def on_settled(self, sent: tuple[int, ...] | None, *, is_there: bool) -> None:
        """Take over the words ``sent`` for a stop from now on, None while an owner's values are sent;
        ``is_there``: the node is in operation."""
        if is_there is not self._is_there:
            self._is_there = is_there
            self._forget()
            if is_there and sent is not None:
                self._begin()
            elif self.last_stop is LastStop.FORWARDED:
                self.why = _AWAY
        if sent == self._sent:
            return
        self._sent = sent
        if sent is not None:
            self._begin()
            return
        self._forget()
        self.last_stop, self.follows, self.why = LastStop.NONE, True, ""

    def on_handed_over(
        self, now: float, outputs: Sequence[StoppedOutput], *, way_s: float, bound_s: float
    ) -> None:
        """Begin the bound: the stop has been handed to the bus by ``now``. ``outputs`` are those that it
        gives a value, which may take ``way_s`` to the node; after ``bound_s`` they have it."""
        if not self.awaits_sending:
            return
        self._forget()
        self._since, self._counts_from = now, now + way_s
        self._bound_s = max(way_s, bound_s)
        self._until = now + self._bound_s
        self._outputs = tuple(outputs)
        self._seen = [_Seen() for _ in outputs]
        self._asked = [place for place, one in enumerate(outputs) if not one.told_by]
        self._read_at = self._counts_from if self._asked else inf
        self.is_owed = True
        self._judge(now)

    def _begin(self) -> None:
        self._forget()
        self.last_stop, self.why = LastStop.FORWARDED, _UNREAD
        self.awaits_sending = self._is_there

    def _forget(self) -> None:
        self.awaits_sending = self.is_owed = False
        self._since = None
        self._counts_from = self._until = self._read_at = inf
        self._outputs, self._seen, self._asked = (), [], []
        self._turn = 0
        self._is_asking = self._was_silent = False
        self._disobeyed_at = -inf
        self._stop += 1
        self._verdicts.clear()

    # what the node says

    def next_reading(self) -> float | None:
        """Time of the next ``question``; None where nothing is to be read, or an answer is awaited."""
        return None if self._is_asking or self._read_at == inf else self._read_at

    def question(self, now: float) -> Question | None:
        """Output that is to be read now. ``on_answer`` gets the answer; then the next may be asked for."""
        if self._is_asking or now < self._read_at:
            return None
        if not self._turn:
            self._began_at = now
        self._is_asking = True
        place = self._asked[self._turn]
        return Question(self._stop, place, self._outputs[place], now)

    def on_answer(self, question: Question, answer: OutputReadback, now: float) -> None:
        if question.stop != self._stop:
            return
        self._is_asking = False
        self._turn += 1
        if self._was_silent and not answer.was_silent:
            self._until = max(self._until, now + self._bound_s)
        self._was_silent = answer.was_silent
        if question.asked_at >= self._seen[question.place].at:
            self._seen[question.place] = _Seen(answer.raw, question.asked_at, answer.why)
        is_over = answer.was_silent or self._turn == len(self._asked)
        self._judge(now)
        if is_over:
            self._turn = 0
            self._read_at = self._next_turn(now)

    def _next_turn(self, now: float) -> float:
        """Time at which the outputs are read again, as far as has been seen; infinite for never."""
        if not self.is_owed:
            return inf
        if self.last_stop is LastStop.IGNORED or self._was_silent:
            return now + _AGAIN_S
        if self._began_at < self._until:
            return max(now, self._until)
        # What the node has refused twice it will refuse again.
        return inf

    def on_pause(self, at: float) -> None:
        """Put off the end of the bound: a TPDO that brings outputs regularly came late, ``at`` that time."""
        self._until = max(self._until, at + self._bound_s)

    def on_told(self, values: Sequence[tuple[ObjectRef, int]], at: float) -> None:
        """Take over these objects of a TPDO received ``at``, as integers without sign."""
        if at < self._counts_from:
            return
        for place, one in enumerate(self._outputs):
            for ref, raw in values:
                if ref == one.object:
                    self._seen[place] = _Seen(raw, at)
        self._judge(at)
        if self._asked and self._disobeyed_at == at < self._until:
            # It has said so once, on change, and says no more.
            self._read_at = min(self._read_at, self._until)

    def _judge(self, at: float) -> None:
        """Judge the stop by what is known of each output."""
        pairs = list(zip(self._outputs, self._seen, strict=True))
        wrong = [(one, seen) for one, seen in pairs if seen.raw not in (None, one.raw)]
        if wrong:
            self._disobeys(wrong, at)
            return
        unseen = next(((one, seen) for one, seen in pairs if seen.raw is None), None)
        if unseen is not None:
            if self.last_stop is LastStop.FORWARDED:
                one, seen = unseen
                self.why = seen.why or (
                    Text.of("quality.no_pdo_of_node", pdo=one.told_by) if one.told_by else _UNREAD
                )
            return
        since = min((seen.at for seen in self._seen), default=at)
        # Not at once: another master's frames and ours may alternate.
        is_quiet = since >= self._disobeyed_at + _AGAIN_S
        if self.last_stop is LastStop.FORWARDED or (self.last_stop is LastStop.IGNORED and is_quiet):
            self._conclude(LastStop.FOLLOWED, at)
        elif self.last_stop is LastStop.FOLLOWED:
            self.is_owed = False

    def _disobeys(self, wrong: Sequence[tuple[StoppedOutput, _Seen]], at: float) -> None:
        latest, seen = max(wrong, key=lambda pair: pair[1].at)
        self._disobeyed_at = max(self._disobeyed_at, seen.at)
        self.is_owed = True
        if self.last_stop is not LastStop.FOLLOWED or seen.at >= self._until:
            self.why = _held(latest, seen.raw or 0)
        if seen.at >= self._until and self.last_stop is not LastStop.IGNORED:
            self._conclude(LastStop.IGNORED, at)

    def _conclude(self, outcome: LastStop, at: float) -> None:
        since = at if self._since is None else self._since
        self._verdicts.append(StopVerdict(outcome, self.last_stop, since, at, again=not self.follows))
        self.last_stop = outcome
        self.follows = outcome is LastStop.FOLLOWED
        self.is_owed = not self.follows
        if self.follows:
            self.why = ""
            self._read_at, self._turn = inf, 0
        elif self._asked:
            self._read_at = min(self._read_at, at + _AGAIN_S)

    # time

    def take_verdicts(self) -> list[StopVerdict]:
        """Verdicts on stops that have ended since the last call."""
        verdicts, self._verdicts = self._verdicts, []
        return verdicts

    def next_deadline(self) -> float | None:
        """Time, already over, of the first verdict that waits to be told; None where none does."""
        return self._verdicts[0].at if self._verdicts else None


def _held(one: StoppedOutput, raw: int) -> Text:
    held, want = one.shown(raw), one.shown(one.raw)
    return Text.of("outputs.held", object=one.place, output=one.name, held=held, want=want)
