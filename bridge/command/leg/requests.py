"""What a request makes of the leg: who may ask, and what is done at once."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from bridge.command.event import Kind
from bridge.command.freshness import arrival_of, is_stale, limit_ms_of
from bridge.command.leg import order, rules, start
from bridge.command.leg.effect import Answer
from bridge.command.leg.state import Owner, Timer
from bridge.command.leg.table import Deed, Stimulus
from bridge.command.leg.turn import Turn
from bridge.command.request import (
    DONE,
    STOP_ACTIONS,
    Action,
    Code,
    Do,
    Identity,
    Outcome,
    Request,
    Role,
    SetTimeout,
    Start,
    TakeControl,
    Write,
)
from bridge.command.telegram import Refusal
from bridge.drive import FAULTED, DriveState
from bridge.image import Value

_LEASE_MS: Final = (100, 600_000)
_TAKEN_STALE: Final = STOP_ACTIONS | {Action.WRITE, Action.RELEASE_CONTROL}
"""Nothing is too old to stop a drive; whether a write does so is seen when it has been decoded."""
_OVERWRITTEN: Final = Outcome(Code.CANCELLED, "a control word was written meanwhile")


def handle(turn: Turn, request: Request) -> None:
    """Do what ``request`` asks, or refuse it and change nothing."""
    turn.judge()
    try:
        _check_authority(turn, request)
        if request.action not in _TAKEN_STALE and _is_stale(turn, request):
            raise _stale(turn, request)
        if isinstance(request.command, Start):
            _start(turn, request, request.command.direction)
        else:
            turn.effects.append(Answer(_carry_out(turn, request)))
    except Refusal as refusal:
        message = f"{request.action} by {request.identity} refused: {refusal.message}"
        turn.tell(Kind.REFUSED, 300, message)
        refused = Outcome(refusal.code, refusal.message, forwarded=False)
        turn.effects.append(Answer(refused, is_refused=True))


def _check_authority(turn: Turn, request: Request) -> None:
    """Raises ``Refusal`` where somebody else controls the drive. Stopping it is every operator's, unless the
    site file forbids it, and then where the owner is gone."""
    identity, settings = request.identity, turn.settings
    may_stop = settings.stop_by_anyone or _owner_is_gone(turn)
    if request.action in STOP_ACTIONS and may_stop and identity.role >= Role.OPERATOR:
        return
    judge = rules.take_refusal if request.action is Action.TAKE_CONTROL else rules.refusal
    why = judge(settings.control, turn.owner, identity, owner_is_silent=_owner_is_silent(turn))
    if why:
        raise Refusal(Code.NOT_ALLOWED, why)


def _is_stale(turn: Turn, request: Request) -> bool:
    return is_stale(request, turn.now, turn.timer.timeout_ms)


def _stale(turn: Turn, request: Request) -> Refusal:
    """Why it does not count that it can have waited for so long."""
    limit_ms = limit_ms_of(request, turn.timer.timeout_ms)
    return Refusal(Code.STALE, f"may have waited on its way for longer than {limit_ms} ms")


def _owner_is_silent(turn: Turn) -> bool:
    """Without a lease, an owner that has sent no telegram yet holds nobody up either."""
    settings, timer = turn.settings, turn.timer
    is_watched = timer.timeout_ms > 0 and not settings.ignores_errors and not turn.is_tripped
    is_idle = is_watched and timer.heard_at is None and settings.control != "lease"
    return timer.is_silent or is_idle or _owner_is_gone(turn)


def _owner_is_gone(turn: Turn) -> bool:
    """Where no watchdog says so."""
    return turn.timer.timeout_ms == 0 and rules.is_gone(turn.owner, turn.now)


def _carry_out(turn: Turn, request: Request) -> Outcome:
    """What is done at once. Raises ``Refusal`` before anything has changed."""
    match request.command:
        case Write(values=values):
            return _write(turn, request, values)
        case Do(action=Action.KEEP_ALIVE):
            _hear(turn, request)
        case Do(action=Action.RESET_FAULT):
            return _reset_fault(turn, request)
        case Do(action=Action.STOP | Action.QUICK_STOP | Action.DISABLE_VOLTAGE):
            _stop(turn, request)
        case TakeControl(ttl_ms=ttl_ms):
            _take_control(turn, request.identity, ttl_ms)
        case Do(action=Action.RELEASE_CONTROL):
            return _release(turn, request.identity)
        case SetTimeout(timeout_ms=timeout_ms):
            _set_timeout(turn, request.identity, timeout_ms)
        case _:
            raise Refusal(Code.UNKNOWN_POINT, f"a drive knows no {request.action}")
    return DONE


# telegrams


def _write(turn: Turn, request: Request, values: Mapping[str, Value]) -> Outcome:
    words = turn.settings.words
    is_owner = request.identity.is_same(turn.owner.identity)
    # A new owner inherits no setpoints.
    kept = turn.setpoints if is_owner else turn.rest
    telegram = turn.settings.decode(values, kept, turn.control_word)
    word = telegram.control_word
    if word is not None and not words.is_valid(word):
        turn.happens(Stimulus.INVALID)
        raise Refusal(Code.NOT_VALID, f"control word {word:04X}h: the bit 'control data valid' is 0")
    if _is_stale(turn, request):
        if word is None or not is_owner or words.enables(word):
            raise _stale(turn, request)
        return _take_stale_stop(turn, word)
    _own(turn, request)
    if word is not None:
        mask = words.acknowledge_mask
        is_set, was_set = bool(word & mask), turn.edges.bit
        is_edge = is_set and was_set is False
        if is_set is not was_set:
            turn.edges = turn.edges._replace(bit=is_set)
        if is_edge and turn.is_tripped:
            _acknowledge(turn, request, pulse=False)
            # The edge itself goes on to the drive; whatever else the word asks has to be asked anew.
            turn.word |= mask
            return Outcome(Code.OK, "acknowledged; the drive stays stopped", forwarded=False)
        if not is_edge and not turn.word & mask:
            word &= ~mask  # what was sent meanwhile would make an edge of a bit that never fell
    turn.hear(arrival_of(request, turn.now))
    if _take(turn, word, telegram.setpoints, values) is Deed.FORWARD:
        return DONE
    return Outcome(Code.OK, turn.why_blocked, forwarded=False)


def _take(turn: Turn, word: int | None, setpoints: tuple[int, ...], values: Mapping[str, Value]) -> Deed:
    """The words of a valid telegram. With one that does not enable, what was ordered before it is not gone to
    any more, nor what comes with a stop of a running drive."""
    turn.look_at_way()
    turn.setpoints = setpoints
    turn.keep_at_rest()
    is_stop = word is not None and not turn.settings.words.enables(word)
    handshake = turn.settings.handshake
    if handshake is not None:
        if is_stop:
            turn.order = order.dropped(turn.order)
        stops_it = is_stop and turn.drive is DriveState.OPERATION_ENABLED
        if handshake.value in values and not stops_it:
            position = tuple(turn.setpoints[place] for place in handshake.places)
            turn.order = order.ordered(turn.order, position)
    if word is None:
        return turn.happens(Stimulus.SETPOINTS)
    turn.word, turn.is_ours = word, False
    return turn.happens(Stimulus.STOP_WORD if is_stop else Stimulus.ENABLING_WORD, _OVERWRITTEN)


def _take_stale_stop(turn: Turn, word: int) -> Outcome:
    """The owner's stop, however long it has waited. It is no sign of life, acknowledges nothing and brings no
    setpoints."""
    acknowledge = turn.settings.words.acknowledge_mask
    turn.stop(word & ~acknowledge | turn.word & acknowledge, is_asked=True)
    if turn.happens(Stimulus.LATE_STOP, _OVERWRITTEN) is Deed.TAKE:
        return Outcome(Code.OK, turn.why_blocked, forwarded=False)
    return Outcome(Code.OK, "came late, and counts as a stop only")


def _own(turn: Turn, request: Request) -> None:
    """A valid telegram: who sent it owns the drive from now on."""
    identity = request.identity
    if request.pressed is False and identity.is_same(turn.edges.pressed_by):
        turn.edges = turn.edges._replace(pressed_by=None)
    if not identity.is_same(turn.owner.identity):
        _hand_over(turn, identity)
    _renew(turn, arrival_of(request, turn.now))


def _hear(turn: Turn, request: Request) -> None:
    """A valid telegram that says no more than that its sender is there."""
    _own(turn, request)
    turn.hear(arrival_of(request, turn.now))


def _renew(turn: Turn, at: float) -> None:
    """The owner has shown that it is there: its lease runs anew."""
    identity, lease_s, lease_until, absent_until, stopped_until = turn.owner
    if turn.settings.control == "lease":
        lease_until = at + lease_s
    elif absent_until is None and stopped_until is None:
        return
    turn.owner = Owner(identity, lease_s, lease_until)


# owners


def _hand_over(turn: Turn, identity: Identity, lease_s: float | None = None) -> None:
    """Another owner, or a lease taken anew; the drive is stopped where the owner changes."""
    before = turn.owner.identity
    changes = not identity.is_same(before)
    if changes and before is not None:
        turn.leave()
    if lease_s is None or turn.settings.control != "lease":
        lease_s = turn.owner.lease_s
    turn.owner = Owner(identity, lease_s)
    _renew(turn, turn.now)
    if changes:
        turn.tell(Kind.OWNER, 200, f"controlled by {identity}")


def _take_control(turn: Turn, identity: Identity, ttl_ms: int) -> None:
    low, high = _LEASE_MS
    if turn.settings.control == "lease" and not low <= ttl_ms <= high:
        raise Refusal(Code.OUT_OF_RANGE, f"ttl_ms takes {low}…{high}")
    owner = turn.owner.identity
    if owner is not None and not _owner_is_silent(turn) and not identity.is_same(owner):
        turn.tell(Kind.OWNER, 500, f"{identity} takes control away from {owner}")
    _hand_over(turn, identity, ttl_ms / 1000)


def _release(turn: Turn, identity: Identity) -> Outcome:
    if not identity.is_same(turn.owner.identity):
        return Outcome(Code.OK, "not in control")
    turn.tell(Kind.OWNER, 200, f"released by {turn.owner.identity}")
    turn.leave()
    return DONE


def _set_timeout(turn: Turn, identity: Identity, timeout_ms: int) -> None:
    """Another time for as long as the owner owns the drive, counted from its last telegram: setting it is
    none. A trip stays a trip."""
    settings, timer = turn.settings, turn.timer
    if not settings.timeout_writable:
        raise Refusal(Code.NOT_ALLOWED, "the site file does not allow to change fieldbus_timeout_ms")
    if not identity.is_same(turn.owner.identity):
        raise Refusal(Code.NOT_ALLOWED, "only who controls the drive may change fieldbus_timeout_ms")
    low, high = settings.timeout_range_ms
    if not low <= timeout_ms <= high:
        raise Refusal(Code.OUT_OF_RANGE, f"fieldbus_timeout_ms takes {low}…{high} here")
    runs = timeout_ms and timer.heard_at is not None and not timer.is_silent
    deadline = (timer.heard_at or 0.0) + timeout_ms / 1000 if runs else None
    turn.timer = Timer(timeout_ms, timer.heard_at, deadline, timer.is_silent)
    turn.tell(Kind.CONFIGURATION, 400, f"fieldbus_timeout_ms = {timeout_ms}, by {identity}")


# acknowledge, stop, start


def _reset_fault(turn: Turn, request: Request) -> Outcome:
    """A method is an order each time; a register acknowledges where the telegram before it did not."""
    if request.pressed:
        if request.identity.is_same(turn.edges.pressed_by):
            _hear(turn, request)
            return Outcome(Code.OK, "no edge: the telegram before it acknowledged, too", forwarded=False)
        turn.edges = turn.edges._replace(pressed_by=request.identity)
    _own(turn, request)
    _acknowledge(turn, request, pulse=True)
    return DONE


def _acknowledge(turn: Turn, request: Request, *, pulse: bool) -> None:
    was_tripped = turn.is_tripped
    turn.hear(arrival_of(request, turn.now))
    turn.clear(pulse=pulse)
    if was_tripped:
        by = turn.owner.identity
        turn.tell(Kind.WATCHDOG, 200, f"acknowledged by {by}; the drive stays stopped")


def _stop(turn: Turn, request: Request) -> None:
    """Stop, by whoever asks. The owner's telegrams go on counting, its old enable does not."""
    who, action, words = request.identity, request.action, turn.settings.words
    if who.is_same(turn.owner.identity):
        if not _is_stale(turn, request):
            _hear(turn, request)
    else:
        turn.tell(Kind.OWNER, 400, f"{action} by {who}")
        owner = turn.owner
        if turn.timer.timeout_ms == 0 and owner.identity is not None and owner.stopped_until is None:
            # Whoever is there answers to a stop of its drive.
            turn.owner = owner._replace(stopped_until=turn.now + rules.GONE_S)
    changes = {
        Action.STOP: words.stop,
        Action.QUICK_STOP: words.quick_stop,
        Action.DISABLE_VOLTAGE: words.disable_voltage,
    }
    turn.happens(Stimulus.STOP, Outcome(Code.CANCELLED, f"{action} by {who}"))
    turn.stop_as_asked(changes[action](turn.sent.words[0]))


def _start(turn: Turn, request: Request, direction: int) -> None:
    words = turn.settings.words
    bits = {0: 0, 1: words.forward, -1: words.reverse}.get(direction)
    if bits is None:
        raise Refusal(Code.OUT_OF_RANGE, f"direction takes 1, -1 or 0, not {direction}")
    if direction < 0 and not bits:
        # Forward is what such a drive does with a positive setpoint: that needs no bit.
        raise Refusal(Code.OUT_OF_RANGE, "direction -1: here the sign of the setpoint is the direction")
    if turn.is_tripped or turn.drive in FAULTED:
        raise Refusal(Code.ACKNOWLEDGE_FIRST, "acknowledge first")
    if not turn.may_enable:
        raise Refusal(Code.NOT_READY, turn.why_blocked)
    _hear(turn, request)
    start.begin(turn, words.run | bits)
