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
from bridge.command.leg.draft import Draft
from bridge.command.leg.event import Connection
from bridge.command.leg.state import Owner, Timer
from bridge.command.leg.table import Stimulus
from bridge.command.messages.event import EventKind
from bridge.command.messages.freshness import arrival_of
from bridge.command.messages.request import DONE, STOP_ACTIONS, Action, Code, Identity, Outcome, Request, Role
from bridge.command.messages.telegram import Refusal
from bridge.text import Text

_LEASE_MS: Final = (100, 600_000)
GONE_S: Final = 10.0
"""Time in seconds after which an owner without a watchdog that gives no sign holds nobody up any more. Long
enough for one that connects anew for each telegram, and for a person who was stopped."""
_NO_TIMES: Final = [None, None, None]


def refusal(control: str, owner: Owner, identity: Identity, *, is_replaceable: bool) -> Text | None:
    """Reason why ``identity`` may not command the drive now; None where it may."""
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
    """Reason why ``identity`` may not take control now, None where it may. An engineer always may."""
    if control != "lease":
        may_break = identity.role >= Role.ENGINEER and identity.source.label == control
        return None if may_break else refusal(control, owner, identity, is_replaceable=is_replaceable)
    if identity.role < Role.OPERATOR:
        return Text.of("request.may_only_read", who=str(identity))
    if owner.identity is None or is_replaceable or identity.role >= Role.ENGINEER:
        return None
    return None if identity.goes_on_as(owner.identity) else _taken(owner.identity, identity)


def check_authority(draft: Draft, request: Request) -> None:
    """Raises ``Refusal`` where somebody else controls the drive. Stopping it is every operator's, unless the
    site file forbids it, and then where the owner is gone."""
    identity, settings = request.identity, draft.settings
    may_stop = settings.stop_by_anyone or _owner_is_gone(draft)
    if request.action in STOP_ACTIONS and may_stop and identity.role >= Role.OPERATOR:
        return
    judge = _take_refusal if request.action is Action.TAKE_CONTROL else refusal
    is_replaceable = _owner_is_replaceable(draft) or _is_quiet_beside(draft, identity)
    why = judge(settings.control, draft.owner, identity, is_replaceable=is_replaceable)
    if why:
        raise Refusal(Code.NOT_ALLOWED, why)


def _owner_is_replaceable(draft: Draft) -> bool:
    """Without a lease, an owner that has sent no telegram yet holds nobody up either: no time ends that."""
    timer = draft.timer
    is_idle = timer.timeout_ms > 0 and timer.heard_at is None and draft.settings.control != "lease"
    return timer.is_overdue or is_idle or _owner_is_gone(draft)


def _is_quiet_beside(draft: Draft, identity: Identity) -> bool:
    """Another connection of the owner's user asks, and the owner's, which may be half open, has said nothing
    for ``GONE_S`` where no watchdog judges it. A lease has an end of its own."""
    quiet_until = draft.owner.quiet_until
    is_over = quiet_until is not None and draft.now >= quiet_until
    return is_over and identity.is_same(draft.owner.identity)


def _owner_is_gone(draft: Draft) -> bool:
    """True if the owner is gone and no watchdog says so: it has had no connection for ``GONE_S``, or not
    answered to a stop for so long."""
    if draft.timer.timeout_ms:
        return False
    times = draft.owner.absent_until, draft.owner.stopped_until
    return any(time is not None and draft.now >= time for time in times)


def own(draft: Draft, request: Request) -> None:
    """Take a valid telegram: its sender owns the drive from now on."""
    identity, owner = request.identity, draft.owner.identity
    if request.pressed is False and identity.goes_on_as(draft.edges.pressed_by):
        draft.edges = draft.edges._replace(pressed_by=None)
    if owner is None or not identity.goes_on_as(owner):
        _hand_over(draft, identity)
    elif identity.connection != owner.connection:
        draft.owner = draft.owner._replace(identity=identity)
    _renew(draft, arrival_of(request, draft.now))


def hear(draft: Draft, request: Request) -> None:
    """Take a valid telegram that says no more than that its sender is there."""
    own(draft, request)
    draft.hear(arrival_of(request, draft.now))


def _renew(draft: Draft, at: float) -> None:
    """Renew the lease of an owner that has shown that it is there."""
    identity, lease_s, lease_until, *times, alive_until = draft.owner
    if draft.settings.control == "lease":
        lease_until = at + lease_s
    elif draft.timer.timeout_ms and times == _NO_TIMES:
        return
    quiet_until = _quiet_until(draft, at)
    draft.owner = Owner(identity, lease_s, lease_until, quiet_until=quiet_until, alive_until=alive_until)


def _quiet_until(draft: Draft, heard_at: float) -> float | None:
    """The time from which an owner heard last at ``heard_at`` is quiet; None where a watchdog or the end of
    its lease judges that."""
    if draft.timer.timeout_ms or draft.settings.control == "lease":
        return None
    return heard_at + GONE_S


def _hand_over(draft: Draft, identity: Identity, lease_s: float | None = None) -> None:
    """Take another owner, or a lease taken anew; the drive is stopped where the owner changes."""
    before = draft.owner.identity
    changes = not identity.goes_on_as(before)
    if changes and before is not None:
        leave(draft)
    if lease_s is None or draft.settings.control != "lease":
        lease_s = draft.owner.lease_s
    draft.owner = Owner(identity, lease_s, alive_until=None if changes else draft.owner.alive_until)
    _renew(draft, draft.now)
    if changes:
        draft.tell(EventKind.OWNER, 200, Text.of("owner.controls", who=identity.named_beside(before)))


def leave(draft: Draft) -> None:
    """Let the owner go; the drive is stopped first."""
    site_ms = draft.settings.timeout_ms
    if draft.timer.timeout_ms != site_ms:
        draft.tell(EventKind.CONFIGURATION, 400, Text.of("owner.timeout_of_site", timeout_ms=site_ms))
    draft.timer = Timer(site_ms)
    happen(draft, Stimulus.LEFT, About(Outcome(Code.CANCELLED, Text.of("start.owner_changed"))))
    draft.owner = Owner(lease_s=draft.owner.lease_s)
    draft.edges = draft.edges._replace(bit=None)


def take_control(draft: Draft, identity: Identity, ttl_ms: int) -> None:
    low, high = _LEASE_MS
    if draft.settings.control == "lease" and not low <= ttl_ms <= high:
        raise Refusal(Code.OUT_OF_RANGE, Text.of("request.ttl_range", low=low, high=high))
    owner = draft.owner.identity
    if owner is not None and not _owner_is_replaceable(draft) and not identity.goes_on_as(owner):
        who, whom = identity.named_beside(owner), owner.named_beside(identity)
        draft.tell(EventKind.OWNER, 500, Text.of("owner.taken_away", who=who, whom=whom))
    _hand_over(draft, identity, ttl_ms / 1000)


def release(draft: Draft, identity: Identity) -> Outcome:
    if not identity.goes_on_as(draft.owner.identity):
        return Outcome(Code.OK, Text.of("request.not_in_control"))
    draft.tell(EventKind.OWNER, 200, Text.of("owner.released", who=str(draft.owner.identity)))
    leave(draft)
    return DONE


def set_timeout(draft: Draft, identity: Identity, timeout_ms: int) -> None:
    """Take another time-out for as long as the owner owns the drive, counted from its last telegram: setting
    it is none. A trip stays a trip."""
    settings, timer = draft.settings, draft.timer
    if not settings.timeout_writable:
        raise Refusal(Code.NOT_ALLOWED, Text.of("request.timeout_fixed"))
    if not identity.goes_on_as(draft.owner.identity):
        raise Refusal(Code.NOT_ALLOWED, Text.of("request.timeout_of_owner"))
    low, high = settings.timeout_range_ms
    if not low <= timeout_ms <= high:
        raise Refusal(Code.OUT_OF_RANGE, Text.of("request.timeout_range", low=low, high=high))
    runs = timeout_ms and timer.heard_at is not None and not timer.is_overdue
    deadline = (timer.heard_at or 0.0) + timeout_ms / 1000 if runs else None
    alive_until = draft.owner.alive_until
    if alive_until is not None:
        alive_until += (timeout_ms - timer.timeout_ms) / 1000
        deadline = deadline and min(deadline, alive_until)
    draft.timer = Timer(timeout_ms, timer.heard_at, deadline, timer.is_overdue)
    quiet_until = _quiet_until(draft, timer.heard_at or draft.now)
    draft.owner = draft.owner._replace(quiet_until=quiet_until, alive_until=alive_until)
    said = Text.of("owner.timeout_set", timeout_ms=timeout_ms, who=str(identity))
    draft.tell(EventKind.CONFIGURATION, 400, said)


def on_connection(draft: Draft, event: Connection) -> None:
    """A connection has begun or ended: no telegram, and no end of control. What its user does next, over any
    connection, goes on where the one that has ended was."""
    identity, owner, pressed_by = event.identity, draft.owner, draft.edges.pressed_by
    if not event.is_there and pressed_by is not None and identity.goes_on_as(pressed_by):
        draft.edges = draft.edges._replace(pressed_by=pressed_by.without_connection())
    if owner.identity is None or not identity.is_same(owner.identity):
        return
    if event.is_there:
        draft.owner = owner._replace(absent_until=None)
        return
    if identity.goes_on_as(owner.identity):
        owner = owner._replace(identity=owner.identity.without_connection())
    if not event.has_others:
        owner = owner._replace(absent_until=draft.now + GONE_S)
    draft.owner = owner
