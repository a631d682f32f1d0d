"""What was asked of the plant, by whom, and how it ended: every write, accepted or refused.

Sans-IO: requests and outcomes in, entries out. A controller that writes a hundred times a second fills no
disk: its telegrams are told where they change something, and else counted.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final, NamedTuple

from bridge.command.request import Action, Code, Identity, Outcome, Reply, Request, Role, Source
from bridge.image import Image, Value

Values = dict[str, Value]

SUMMARY_S: Final = 60.0
"""How often it is told what was only counted."""
SETPOINTS_S: Final = 1.0
"""Where setpoints alone change, one telegram of each drive is told in this time, at last the newest."""
_MOST_IN_A_SECOND: Final = 20
_MOST_KEYS: Final = 1000
_BRIDGE: Final = Identity(Source.NONE, "drivebridge", Role.ENGINEER)
_READS: Final = "read_"
"""Actions that only read begin with it."""


@dataclass(frozen=True, slots=True)
class Rejection:
    """A write or command that a protocol has refused by itself, so that it never became a request.

    ``code`` is one of the outcomes' where one says it, ``target`` what was addressed, as far as it is known.
    """

    identity: Identity
    target: str
    action: str
    code: str
    message: str
    values: Values = field(default_factory=dict[str, Value])


class Ending(NamedTuple):
    """An outcome, or what a protocol says that it has refused by itself."""

    code: str
    message: str = ""
    forwarded: bool = False


@dataclass(frozen=True, slots=True)
class Entry:
    """One line. ``time`` is when the request came, in monotonic seconds; ``old`` and ``new`` have what it
    was about to change. ``count`` says how many requests like this one are told by it alone."""

    time: float
    identity: Identity
    target: str
    action: str
    ending: Ending
    old: Values = field(default_factory=dict[str, Value])
    new: Values = field(default_factory=dict[str, Value])
    count: int = 1


@dataclass(slots=True)
class _Telegrams:
    """What one drive's owner has written lately."""

    identity: Identity
    new: Values
    ending: Ending
    told_at: float
    begin: float
    told: int
    repeated: int = 0
    waiting: Entry | None = None

    def may_tell(self, now: float) -> bool:
        """Whether one more entry of this second is told at once."""
        if now - self.begin >= 1.0:
            self.begin, self.told = now, 0
        self.told += 1
        return self.told <= _MOST_IN_A_SECOND


@dataclass(slots=True)
class _Others:
    """Requests of one kind within the present second, and those since the last summary that were too many."""

    begin: float
    told: int = 0
    left_out: int = 0
    last: Entry | None = None


class AuditTrail:
    """Follows requests. ``tell`` gets the entries; without it nothing is followed.

    With ``every_telegram`` nothing is left out.
    """

    def __init__(self, image: Image) -> None:
        self.tell: Callable[[Entry], None] | None = None
        self.every_telegram = False
        self._image = image
        self._telegrams: dict[str, _Telegrams] = {}
        self._others: dict[tuple[str, str, str, str], _Others] = {}
        self._summary_at = float("-inf")

    def follow(self, request: Request, now: float, reply: Reply) -> Reply:
        """A reply to give in place of ``reply``: it notes the outcome first."""
        if self.tell is None or request.action.startswith(_READS):
            return reply
        old = self._held(request)

        def conclude(outcome: Outcome) -> None:
            ending = Ending(outcome.code, outcome.message, outcome.ok and outcome.forwarded)
            who, new = request.identity, _asked(request)
            self._note(Entry(now, who, request.target, request.action, ending, old, new))
            reply(outcome)

        return conclude

    def rejected(self, rejection: Rejection, now: float, count: int = 1) -> None:
        """``count`` of this kind, the last of them ``now``."""
        if self.tell is not None:
            who, ending = rejection.identity, Ending(rejection.code, rejection.message)
            new = rejection.values
            self._note(Entry(now, who, rejection.target, rejection.action, ending, new=new, count=count))

    def stop_ended(self, target: str, outcome: str, message: str, now: float) -> None:
        """A stop that was forwarded has been followed or ignored."""
        if self.tell is not None:
            ending = Ending(Code.OK if outcome == "followed" else outcome, message, forwarded=True)
            self._note_other(Entry(now, _BRIDGE, target, "stop_ended", ending))

    def _held(self, request: Request) -> Values:
        """What the points hold that ``request`` is about to change."""
        top = f"{request.target}/command/"
        match request.action:
            case Action.WRITE:
                names = {leaf: f"{top}{leaf}" for leaf in request.values}
            case Action.SET_TIMEOUT:
                names = {"fieldbus_timeout_ms": f"{request.target}/supervision/fieldbus_timeout_ms"}
            case Action.TAKE_CONTROL | Action.RELEASE_CONTROL:
                names = {"owner": f"{request.target}/supervision/owner"}
            case Action.WRITE_PARAMETER:  # what was read of it last
                names = {request.parameter: f"{request.target}/parameter/{request.parameter}"}
            case _:
                return {}
        index = self._image.index
        held = {leaf: self._image[index[name]] for leaf, name in names.items() if name in index}
        return {leaf: reading.value for leaf, reading in held.items() if reading.quality.has_value}

    # what is told, and what is counted

    def _note(self, entry: Entry) -> None:
        if self.every_telegram:
            self._tell(entry)
        elif entry.ending.code == Code.OK and entry.action in (Action.WRITE, Action.KEEP_ALIVE):
            self._note_telegram(entry)
        else:
            telegrams = self._telegrams.pop(entry.target, None) if entry.ending.code == Code.OK else None
            if telegrams is not None:
                # What follows a stop or a release is no repetition of what went before it.
                self._tell_waiting(entry.target, telegrams)
            self._note_other(entry)

    def _note_telegram(self, entry: Entry) -> None:
        before = self._telegrams.get(entry.target)
        if before is None or not before.identity.is_same(entry.identity):
            if before is not None:
                self._tell_waiting(entry.target, before)
            self._tell(entry)
            self._telegrams[entry.target] = _Telegrams(
                entry.identity, entry.new, entry.ending, entry.time, begin=entry.time, told=1
            )
            return
        goes_on = _goes_on(before, entry)
        new = {**before.new, **entry.new}
        if goes_on and new == before.new:
            before.repeated += 1
            return
        before.new, before.ending = new, entry.ending
        if not goes_on and before.may_tell(entry.time):
            self._tell_waiting(entry.target, before)
            self._tell(entry)
            before.told_at = entry.time
            return
        if before.waiting is not None:
            before.repeated += 1
        before.waiting = entry
        if entry.time - before.told_at >= SETPOINTS_S:
            self._tell_waiting(entry.target, before)

    def _tell_waiting(self, target: str, telegrams: _Telegrams) -> None:
        """The newest setpoints, and how many telegrams went before them untold."""
        entry, telegrams.waiting = telegrams.waiting, None
        if entry is not None:
            self._tell(entry)
            telegrams.told_at = entry.time
        if telegrams.repeated:
            who, ending = telegrams.identity, telegrams.ending
            at = telegrams.told_at if entry is None else entry.time
            self._tell(Entry(at, who, target, "telegrams", ending, count=telegrams.repeated))
            telegrams.repeated = 0

    def _note_other(self, entry: Entry) -> None:
        identity = entry.identity
        kind = entry.action if entry.ending.code == Code.OK else f"{entry.action} refused"
        key = (identity.source.label, identity.user, entry.target, kind)
        if key not in self._others and len(self._others) >= _MOST_KEYS:
            key = ("", "", "", kind)  # somebody who invents names
        others = self._others.setdefault(key, _Others(entry.time))
        if entry.time - others.begin >= 1.0:
            others.begin, others.told = entry.time, 0
        if others.told < _MOST_IN_A_SECOND:
            others.told += 1
            self._tell(entry)
        else:
            others.left_out += entry.count
            others.last = entry

    def on_time(self, now: float) -> None:
        """Tell what has waited long enough; call it about once a second."""
        for telegrams in self._telegrams.values():
            if telegrams.waiting is not None and now - telegrams.told_at >= SETPOINTS_S:
                entry, telegrams.waiting = telegrams.waiting, None
                self._tell(entry)
                telegrams.told_at = now
        if now - self._summary_at >= SUMMARY_S:
            self._summary_at = now
            self.sum_up(now)

    def sum_up(self, now: float) -> None:
        """Tell what was only counted."""
        for target, telegrams in self._telegrams.items():
            self._tell_waiting(target, telegrams)
        for others in self._others.values():
            if others.left_out and others.last is not None:
                last = others.last
                left_out = Entry(
                    now, last.identity, last.target, last.action, last.ending, count=others.left_out
                )
                self._tell(left_out)
        self._others.clear()

    def _tell(self, entry: Entry) -> None:
        if self.tell is not None:
            self.tell(entry)


def _goes_on(before: _Telegrams, entry: Entry) -> bool:
    """Whether this telegram brings nothing but setpoints, from the same controller and to the same end."""
    word = entry.new.get("control_word", before.new.get("control_word"))
    return (
        before.identity.is_same(entry.identity)
        and before.ending == entry.ending
        and before.new.get("control_word") == word
        and entry.new.keys() <= before.new.keys()
    )


def _asked(request: Request) -> Values:
    match request.action:
        case Action.WRITE:
            return dict(request.values)
        case Action.SET_TIMEOUT:
            return {"fieldbus_timeout_ms": request.timeout_ms}
        case Action.TAKE_CONTROL:
            return {"owner": str(request.identity), "ttl_ms": request.ttl_ms}
        case Action.RELEASE_CONTROL:
            return {"owner": ""}
        case Action.START:
            return {"direction": request.direction}
        case Action.WRITE_PARAMETER:
            return {} if request.value is None else {request.parameter: request.value}
        case _:
            return {}
