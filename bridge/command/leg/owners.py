"""Owners of a drive: who may command it, and what becomes of it when another does. The twin of P509/P510
(BU 2500 §7.2).

With ``control`` a protocol, the first identity of that protocol whose valid telegram arrives owns the drive
until it releases it or falls silent. With ``"lease"`` any operator takes the drive for a time and keeps it by
going on; with ``"none"`` nobody commands it.

An owner is one connection: two programs that call themselves the same must not move a drive in turns. Another
connection of the same user is somebody else until the owner's has ended; then it goes on where that was.
"""

from __future__ import annotations

from typing import Final

from bridge.command.leg.deeds import About, happen
from bridge.command.leg.event import Connection
from bridge.command.leg.state import Owner, Timer
from bridge.command.leg.table import Stimulus
from bridge.command.leg.turn import Turn
from bridge.command.messages.event import Kind
from bridge.command.messages.freshness import arrival_of
from bridge.command.messages.request import DONE, STOP_ACTIONS, Action, Code, Identity, Outcome, Request, Role
from bridge.command.messages.telegram import Refusal
from bridge.text import Text

_LEASE_MS: Final = (100, 600_000)
GONE_S: Final = 10.0
"""Without a watchdog: after this an owner that gives no sign holds nobody up any more. Long enough for one
that connects anew for each telegram, and for a person who was stopped."""
_NO_TIMES: Final = [None, None, None]


def refusal(control: str, owner: Owner, identity: Identity, *, is_replaceable: bool) -> Text | None:
    """The reason why ``identity`` may not command the drive now; None where it may."""
    if identity.role < Role.OPERATOR:
        return Text.of("request.may_only_read", who=str(identity))
    if control == "none":
        return Text.of("request.nobody_controls")
    if identity.goes_on_as(owner.identity):
        return None
    if control == "lease":
        if owner.identity is None:
            return Text.of("request.take_control_first")
        return _taken(owner.identity, identity)
    if identity.source.label != control:
        return Text.of("request.controlled_by", owner=control)
    if owner.identity is None or is_replaceable:
        return None
    return _taken(owner.identity, identity)


def _taken(owner: Identity, identity: Identity) -> Text:
    return Text.of("request.controlled_by", owner=owner.named_beside(identity))


def _take_refusal(control: str, owner: Owner, identity: Identity, *, is_replaceable: bool) -> Text | None:
    """The reason why ``identity`` may not take control now, None where it may. An engineer always may."""
    if control != "lease":
        may_break = identity.role >= Role.ENGINEER and identity.source.label == control
        return None if may_break else refusal(control, owner, identity, is_replaceable=is_replaceable)
    if identity.role < Role.OPERATOR:
        return Text.of("request.may_only_read", who=str(identity))
    if owner.identity is None or is_replaceable or identity.role >= Role.ENGINEER:
        return None
    return None if identity.goes_on_as(owner.identity) else _taken(owner.identity, identity)


def check_authority(turn: Turn, request: Request) -> None:
    """Raises ``Refusal`` where somebody else controls the drive. Stopping it is every operator's, unless the
    site file forbids it, and then where the owner is gone."""
    identity, settings = request.identity, turn.settings
    may_stop = settings.stop_by_anyone or _owner_is_gone(turn)
    if request.action in STOP_ACTIONS and may_stop and identity.role >= Role.OPERATOR:
        return
    judge = _take_refusal if request.action is Action.TAKE_CONTROL else refusal
    is_replaceable = _owner_is_replaceable(turn) or _is_quiet_beside(turn, identity)
    why = judge(settings.control, turn.owner, identity, is_replaceable=is_replaceable)
    if why:
        raise Refusal(Code.NOT_ALLOWED, why)


def _owner_is_replaceable(turn: Turn) -> bool:
    """Without a lease, an owner that has sent no telegram yet holds nobody up either: no time ends that."""
    timer = turn.timer
    is_idle = timer.timeout_ms > 0 and timer.heard_at is None and turn.settings.control != "lease"
    return timer.is_overdue or is_idle or _owner_is_gone(turn)


def _is_quiet_beside(turn: Turn, identity: Identity) -> bool:
    """Another connection of the owner's user asks, and the owner's, which may be half open, has said nothing
    for ``GONE_S`` where no watchdog judges it. A lease has an end of its own."""
    quiet_until = turn.owner.quiet_until
    is_over = quiet_until is not None and turn.now >= quiet_until
    return is_over and identity.is_same(turn.owner.identity)


def _owner_is_gone(turn: Turn) -> bool:
    """True if the owner is gone and no watchdog says so: it has had no connection for ``GONE_S``, or not
    answered to a stop for so long."""
    if turn.timer.timeout_ms:
        return False
    times = turn.owner.absent_until, turn.owner.stopped_until
    return any(time is not None and turn.now >= time for time in times)


def own(turn: Turn, request: Request) -> None:
    """A valid telegram: who sent it owns the drive from now on."""
    identity, owner = request.identity, turn.owner.identity
    if request.pressed is False and identity.goes_on_as(turn.edges.pressed_by):
        turn.edges = turn.edges._replace(pressed_by=None)
    if owner is None or not identity.goes_on_as(owner):
        _hand_over(turn, identity)
    elif identity.connection != owner.connection:
        turn.owner = turn.owner._replace(identity=identity)
    _renew(turn, arrival_of(request, turn.now))


def hear(turn: Turn, request: Request) -> None:
    """A valid telegram that says no more than that its sender is there."""
    own(turn, request)
    turn.hear(arrival_of(request, turn.now))


def _renew(turn: Turn, at: float) -> None:
    """The owner has shown that it is there: its lease runs anew."""
    identity, lease_s, lease_until, *times, alive_until = turn.owner
    quiet_until = None
    if turn.settings.control == "lease":
        lease_until = at + lease_s
    elif not turn.timer.timeout_ms:
        quiet_until = at + GONE_S
    elif times == _NO_TIMES:
        return
    turn.owner = Owner(identity, lease_s, lease_until, quiet_until=quiet_until, alive_until=alive_until)


def _hand_over(turn: Turn, identity: Identity, lease_s: float | None = None) -> None:
    """Another owner, or a lease taken anew; the drive is stopped where the owner changes."""
    before = turn.owner.identity
    changes = not identity.goes_on_as(before)
    if changes and before is not None:
        leave(turn)
    if lease_s is None or turn.settings.control != "lease":
        lease_s = turn.owner.lease_s
    turn.owner = Owner(identity, lease_s, alive_until=None if changes else turn.owner.alive_until)
    _renew(turn, turn.now)
    if changes:
        turn.tell(Kind.OWNER, 200, Text.of("owner.controls", who=identity.named_beside(before)))


def leave(turn: Turn) -> None:
    """The owner goes; the drive is stopped first."""
    site_ms = turn.settings.timeout_ms
    if turn.timer.timeout_ms != site_ms:
        turn.tell(Kind.CONFIGURATION, 400, Text.of("owner.timeout_of_site", timeout_ms=site_ms))
    turn.timer = Timer(site_ms)
    happen(turn, Stimulus.LEFT, About(Outcome(Code.CANCELLED, Text.of("start.owner_changed"))))
    turn.owner = Owner(lease_s=turn.owner.lease_s)
    turn.edges = turn.edges._replace(bit=None)


def take_control(turn: Turn, identity: Identity, ttl_ms: int) -> None:
    low, high = _LEASE_MS
    if turn.settings.control == "lease" and not low <= ttl_ms <= high:
        raise Refusal(Code.OUT_OF_RANGE, Text.of("request.ttl_range", low=low, high=high))
    owner = turn.owner.identity
    if owner is not None and not _owner_is_replaceable(turn) and not identity.goes_on_as(owner):
        who, whom = identity.named_beside(owner), owner.named_beside(identity)
        turn.tell(Kind.OWNER, 500, Text.of("owner.taken_away", who=who, whom=whom))
    _hand_over(turn, identity, ttl_ms / 1000)


def release(turn: Turn, identity: Identity) -> Outcome:
    if not identity.goes_on_as(turn.owner.identity):
        return Outcome(Code.OK, Text.of("request.not_in_control"))
    turn.tell(Kind.OWNER, 200, Text.of("owner.released", who=str(turn.owner.identity)))
    leave(turn)
    return DONE


def set_timeout(turn: Turn, identity: Identity, timeout_ms: int) -> None:
    """Another time for as long as the owner owns the drive, counted from its last telegram: setting it is
    none. A trip stays a trip."""
    settings, timer = turn.settings, turn.timer
    if not settings.timeout_writable:
        raise Refusal(Code.NOT_ALLOWED, Text.of("request.timeout_fixed"))
    if not identity.goes_on_as(turn.owner.identity):
        raise Refusal(Code.NOT_ALLOWED, Text.of("request.timeout_of_owner"))
    low, high = settings.timeout_range_ms
    if not low <= timeout_ms <= high:
        raise Refusal(Code.OUT_OF_RANGE, Text.of("request.timeout_range", low=low, high=high))
    runs = timeout_ms and timer.heard_at is not None and not timer.is_overdue
    deadline = (timer.heard_at or 0.0) + timeout_ms / 1000 if runs else None
    alive_until = turn.owner.alive_until
    if alive_until is not None:
        alive_until += (timeout_ms - timer.timeout_ms) / 1000
        deadline = deadline and min(deadline, alive_until)
    turn.timer = Timer(timeout_ms, timer.heard_at, deadline, timer.is_overdue)
    judges_by_itself = timeout_ms > 0 or settings.control == "lease"
    quiet_until = None if judges_by_itself else (timer.heard_at or turn.now) + GONE_S
    turn.owner = turn.owner._replace(quiet_until=quiet_until, alive_until=alive_until)
    said = Text.of("owner.timeout_set", timeout_ms=timeout_ms, who=str(identity))
    turn.tell(Kind.CONFIGURATION, 400, said)


def on_connection(turn: Turn, event: Connection) -> None:
    """A connection has begun or ended: no telegram, and no end of control. What its user does next, over any
    connection, goes on where the one that has ended was."""
    identity, owner, pressed_by = event.identity, turn.owner, turn.edges.pressed_by
    if not event.is_there and pressed_by is not None and identity.goes_on_as(pressed_by):
        turn.edges = turn.edges._replace(pressed_by=pressed_by.without_connection())
    if owner.identity is None or not identity.is_same(owner.identity):
        return
    if event.is_there:
        turn.owner = owner._replace(absent_until=None)
        return
    if identity.goes_on_as(owner.identity):
        owner = owner._replace(identity=owner.identity.without_connection())
    if not event.has_others:
        owner = owner._replace(absent_until=turn.now + GONE_S)
    turn.owner = owner
