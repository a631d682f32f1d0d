"""Audit trail of the plant: every write and command, accepted or refused, with its sender and outcome.

Sans-IO: requests and outcomes in, entries out. A controller that writes a hundred times a second must not
fill a disk: its telegrams get an entry if they change something, and are counted otherwise.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Final, NamedTuple

from bridge.base.ratelimit import RateLimit
from bridge.catalogue.points import LIFE_SIGN
from bridge.command.messages.request import (
    Action,
    Code,
    Do,
    Identity,
    Outcome,
    Reply,
    Request,
    Role,
    SetTimeout,
    Source,
    Start,
    TakeControl,
    Write,
    WriteParameter,
)
from bridge.image import Image, Value
from bridge.text import Said, Text, render

Values = dict[str, Value]

IGNORED: Final = "ignored"
"""The outcome of a stop that the drive did not follow."""
SUMMARY_S: Final = 60.0
"""Interval in seconds of the entries for what was only counted."""
SETPOINTS_S: Final = 1.0
"""Interval in seconds of the entries for one drive while only setpoints change; the last one gets its own."""
AT_ONCE: Final = 20
"""Entries written at once; then one in ``REFUSED_EVERY_S`` for all that one client is refused, whatever it
asks for and calls itself, and one in ``DONE_EVERY_S`` for what it does with one drive or node in one way."""
REFUSED_EVERY_S: Final = 3.0
DONE_EVERY_S: Final = 1.0
_MOST_SHARES: Final = 1000
_MOST_SUMS: Final = 4
"""Most pairs of user and target that a summary of one client, action and code tells apart."""
_OTHERS: Final = "others"
_CARRIED_OUT: Final = (Code.OK, Code.TIMED_OUT, Code.CANCELLED, Code.REFUSED_BY_DRIVE, IGNORED)
"""Outcomes of requests that reached a drive or node; the others were refused before."""
_BRIDGE: Final = Identity(Source.NONE, "drivebridge", Role.ENGINEER)
_ACTIONS: Final = frozenset(Action) | {"call"}
_READS: Final = "read_"
"""Prefix of actions that only read."""


@dataclass(frozen=True, slots=True)
class Rejection:
    """A write or command that a protocol has refused by itself, so that it never became a request.

    ``code`` is that of an outcome if one fits, ``target`` what was addressed, as far as known.
    """

    identity: Identity
    target: str
    action: str
    code: str
    said: Said
    values: Values = field(default_factory=dict[str, Value])


class AuditOutcome(NamedTuple):
    """Outcome of a request, or of one that a protocol has refused by itself."""

    code: str
    said: Said = ""
    forwarded: bool = False

    @property
    def message(self) -> str:
        """The message in English."""
        return render(self.said)


@dataclass(frozen=True, slots=True)
class AuditEntry:
    """One line. ``time`` is when the request came, in monotonic seconds; ``old`` and ``new`` are the values
    that it was to replace and to write; ``count`` is the number of like requests that it stands for."""

    time: float
    identity: Identity
    target: str
    action: str
    ending: AuditOutcome
    old: Values = field(default_factory=dict[str, Value])
    new: Values = field(default_factory=dict[str, Value])
    count: int = 1

    @property
    def is_refused(self) -> bool:
        """Refused before it reached anything: anybody can cause any number of these."""
        return self.ending.code not in _CARRIED_OUT


@dataclass(slots=True)
class _Telegrams:
    """Recent telegrams of one drive's owner."""

    identity: Identity
    new: Values
    ending: AuditOutcome
    told_at: float
    repeated: int = 0
    waiting: AuditEntry | None = None


_Sum = tuple[str, Role, str, str, bool] | None
"""User, role, target, action, and whether it was forwarded; None: all others."""


def shared_by(one: Identity, other: Identity) -> Identity:
    """Identity with what two of one protocol have in common. ``user`` is empty unless both are the same user
    with the same role, ``address`` unless both have the same; it has no port where only that differs."""
    is_same = one.is_same(other) and one.role is other.role
    address = one.address
    if address != other.address:
        address = client_of(one) if client_of(one) == client_of(other) else ""
    connection = one.connection if one.connection == other.connection else ""
    return replace(other, user=other.user if is_same else "", address=address, connection=connection)


def _sum_of(one: AuditEntry, other: AuditEntry) -> AuditEntry:
    """One entry for two of one protocol with the same code; fields in which they differ are empty."""
    first, last = one.ending, other.ending
    said = last.said if first.said == last.said else ""
    return replace(
        other,
        identity=shared_by(one.identity, other.identity),
        target=other.target if one.target == other.target else "",
        action=other.action if one.action == other.action else "",
        ending=AuditOutcome(last.code, said, first.forwarded and last.forwarded),
        count=one.count + other.count,
    )


@dataclass(slots=True)
class _Share:
    """Entries with a common limit: how many may be written, and those beyond it since the last summary."""

    limit: RateLimit
    is_new: bool = True
    is_used: bool = True
    left_out: dict[_Sum, AuditEntry] = field(default_factory=dict[_Sum, AuditEntry])
    """Entries beyond the limit, summed by user and target; beyond ``_MOST_SUMS`` all others in one."""

    def allows(self, now: float) -> bool:
        """Whether one more is written at once."""
        self.is_new, self.is_used = False, True
        return self.limit.allows(now)

    def takes(self, entry: AuditEntry) -> bool:
        """Whether an entry is written now; otherwise it is counted."""
        # The first of its kind is written whatever else the client was refused.
        is_new = self.is_new
        if self.allows(entry.time) or is_new:
            return True
        who = entry.identity
        key: _Sum | None = (who.user, who.role, entry.target, entry.action, entry.ending.forwarded)
        if key not in self.left_out and len(self.left_out) >= _MOST_SUMS:
            key = None
        before = self.left_out.get(key)
        self.left_out[key] = _sum_of(before, entry) if before else entry
        return False

    def sum_up(self, now: float) -> list[AuditEntry]:
        """Summaries of the entries left out, one for each user and target, with what is true of all that it
        counts. All but the first are charged to the limit."""
        sums = [replace(one, time=now, old={}, new={}) for one in self.left_out.values()]
        self.limit.charge(max(0, len(sums) - 1))
        self.is_used, self.left_out = False, {}
        return sums


class AuditTrail:
    """Audit trail of all requests, kept while there is a listener."""

    def __init__(self, image: Image) -> None:
        self.tell_to(None)
        self._image = image
        self._telegrams: dict[str, _Telegrams] = {}
        self._shares: dict[tuple[str, ...], _Share] = {}
        self._limits: dict[tuple[str, ...], RateLimit] = {}
        """Limits for refused requests, by client."""
        self._summary_at = float("-inf")

    def tell_to(self, listener: Callable[[AuditEntry], None] | None, *, every_telegram: bool = False) -> None:
        """Pass entries to ``listener`` from now on; None ends that. ``every_telegram``: none is left out."""
        self._listener, self._every_telegram = listener, every_telegram

    def follow(self, request: Request, now: float, reply: Reply) -> Reply:
        """Reply to use in place of ``reply``: it notes the outcome first."""
        if self._listener is None or request.action.startswith(_READS):
            return reply
        old = self._held(request)

        def conclude(outcome: Outcome) -> None:
            ending = AuditOutcome(outcome.code, outcome.said, outcome.ok and outcome.forwarded)
            who, new = request.identity, _asked(request)
            self._note(AuditEntry(now, who, request.target, request.action, ending, old, new))
            reply(outcome)

        return conclude

    def rejected(self, rejection: Rejection, now: float, count: int = 1) -> None:
        """Note ``count`` rejections of this kind, the last of them at ``now``."""
        if self._listener is not None:
            who, ending = rejection.identity, AuditOutcome(rejection.code, rejection.said)
            new = rejection.values
            self._note(AuditEntry(now, who, rejection.target, rejection.action, ending, new=new, count=count))

    def stop_ended(self, target: str, outcome: str, said: Text, now: float) -> None:
        """Note that a stop which was forwarded has been followed or ignored."""
        if self._listener is not None:
            ending = AuditOutcome(Code.OK if outcome == "followed" else outcome, said, forwarded=True)
            self._note_other(AuditEntry(now, _BRIDGE, target, "stop_ended", ending))

    def _held(self, request: Request) -> Values:
        """Present values of the points that ``request`` is about to change."""
        top = f"{request.target}/command/"
        match request.command:
            case Write(values=values):
                names = {leaf: f"{top}{leaf}" for leaf in values if leaf != LIFE_SIGN}
            case SetTimeout():
                names = {"fieldbus_timeout_ms": f"{request.target}/supervision/fieldbus_timeout_ms"}
            case TakeControl() | Do(action=Action.RELEASE_CONTROL):
                names = {"owner": f"{request.target}/supervision/owner"}
            case WriteParameter(parameter=parameter):  # what was read of it last
                names = {parameter: f"{request.target}/parameter/{parameter}"}
            case _:
                return {}
        index = self._image.index
        held = {leaf: self._image[index[name]] for leaf, name in names.items() if name in index}
        return {leaf: reading.value for leaf, reading in held.items() if reading.quality.has_value}

    # what is told, and what is counted

    def _note(self, entry: AuditEntry) -> None:
        if self._every_telegram:
            self._tell(entry)
        elif entry.ending.code == Code.OK and entry.action in (Action.WRITE, Action.KEEP_ALIVE):
            self._note_telegram(entry)
        else:
            telegrams = self._telegrams.pop(entry.target, None) if entry.ending.code == Code.OK else None
            if telegrams is not None:
                # What follows a stop or a release is no repetition of what went before it.
                self._tell_waiting(entry.target, telegrams, self._note_other, entry.time)
            self._note_other(entry)

    def _note_telegram(self, entry: AuditEntry) -> None:
        before = self._telegrams.get(entry.target)
        if before is None or not before.identity.is_same(entry.identity):
            if before is not None:
                self._tell_waiting(entry.target, before, self._note_other, entry.time)
            self._note_other(entry)
            self._telegrams[entry.target] = _Telegrams(entry.identity, entry.new, entry.ending, entry.time)
            return
        goes_on = _goes_on(before, entry)
        new = {**before.new, **entry.new}
        if goes_on and new == before.new:
            before.repeated += 1
            return
        before.new, before.ending = new, entry.ending
        if not goes_on and self._share(entry).allows(entry.time):
            self._tell_waiting(entry.target, before, self._tell, entry.time)
            self._tell(entry)
            before.told_at = entry.time
            return
        if before.waiting is not None:
            before.repeated += 1
        before.waiting = entry
        if entry.time - before.told_at >= SETPOINTS_S:
            self._tell_waiting(entry.target, before, self._tell, entry.time)

    def _tell_waiting(
        self, target: str, telegrams: _Telegrams, tell: Callable[[AuditEntry], None], now: float
    ) -> None:
        """Tell the newest setpoints, and the number of telegrams that have gone untold up to ``now``."""
        entry, telegrams.waiting = telegrams.waiting, None
        if entry is not None:
            tell(entry)
            telegrams.told_at = entry.time
        if telegrams.repeated:
            who, ending = telegrams.identity, telegrams.ending
            tell(AuditEntry(now, who, target, "telegrams", ending, count=telegrams.repeated))
            telegrams.repeated = 0

    def _note_other(self, entry: AuditEntry) -> None:
        if self._share(entry).takes(entry):
            self._tell(entry)

    def _share(self, entry: AuditEntry) -> _Share:
        """Share of an entry. Refused requests are counted by action and code and limited by client: targets
        and names can be made up."""
        client = (entry.identity.source.label, client_of(entry.identity))
        kind = (entry.action if entry.action in _ACTIONS else "", str(entry.ending.code))
        key = (*client, *kind) if entry.is_refused else (*client, *kind, entry.target)
        if key not in self._shares and len(self._shares) >= _MOST_SHARES:
            client = (client[0], _OTHERS)
            key = (*client, *kind)
        share = self._shares.get(key)
        if share is None:
            limit = RateLimit(AT_ONCE, DONE_EVERY_S)
            if entry.is_refused:
                limit = self._limits.setdefault(client, RateLimit(AT_ONCE, REFUSED_EVERY_S))
            share = self._shares[key] = _Share(limit)
        return share

    def on_time(self, now: float) -> None:
        """Write what has waited long enough; call it about once a second."""
        for telegrams in self._telegrams.values():
            if telegrams.waiting is not None and now - telegrams.told_at >= SETPOINTS_S:
                entry, telegrams.waiting = telegrams.waiting, None
                self._tell(entry)
                telegrams.told_at = now
        if now - self._summary_at >= SUMMARY_S:
            self._summary_at = now
            self.sum_up(now)

    def sum_up(self, now: float) -> None:
        """Write what was only counted."""
        for target, telegrams in self._telegrams.items():
            self._tell_waiting(target, telegrams, self._tell, now)
        for key, share in list(self._shares.items()):
            if not share.is_used:
                del self._shares[key]
                continue
            for entry in share.sum_up(now):
                self._tell(entry)
        used = {key[:2] for key in self._shares}
        for client in [client for client in self._limits if client not in used]:
            del self._limits[client]  # a minute has filled it

    def _tell(self, entry: AuditEntry) -> None:
        if self._listener is not None:
            self._listener(entry)


def client_of(identity: Identity) -> str:
    """Origin of a request: the client's address without its port, empty where the protocol does not know it.
    Names that clients give themselves do not count."""
    address = identity.address
    if address.startswith("["):
        return address[1:].partition("]")[0]
    return address.partition(":")[0] if address.count(":") == 1 else address


def _goes_on(before: _Telegrams, entry: AuditEntry) -> bool:
    """Whether this telegram of the same controller brings only new setpoints, with the same outcome."""
    asked = _control_word(before.new)
    return (
        before.ending == entry.ending
        and (_control_word(entry.new) or asked) == asked
        and entry.new.keys() <= before.new.keys()
    )


def _control_word(values: Values) -> Values:
    """The control word among the values, and its bits."""
    return {leaf: value for leaf, value in values.items() if leaf.partition(".")[0] == "control_word"}


def _asked(request: Request) -> Values:
    match request.command:
        case Write(values=values):
            # A token of the life sign changes each second, and orders nothing.
            return {leaf: value for leaf, value in values.items() if leaf != LIFE_SIGN}
        case SetTimeout(timeout_ms=timeout_ms):
            return {"fieldbus_timeout_ms": timeout_ms}
        case TakeControl(ttl_ms=ttl_ms):
            return {"owner": str(request.identity), "ttl_ms": ttl_ms}
        case Do(action=Action.RELEASE_CONTROL):
            return {"owner": ""}
        case Start(direction=direction):
            return {"direction": direction}
        case WriteParameter(parameter=parameter, value=value):
            return {parameter: value}
        case _:
            return {}
