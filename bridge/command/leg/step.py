"""The leg's one verb: ``step(settings, state, event, now)`` gives the next state and what has come of it.

Pure: times are monotonic seconds, given from outside. A state that is the same afterwards is the same object.

Each step goes one way: first it is found out what happens (here, in ``reports``, ``start``, ``due`` and
``owners``); the table says the next stage and the deed, which is done (``deeds``); and then the other table
says what is sent (``settle``, ``words``).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, Final

from bridge.catalogue.points import LIFE_SIGN
from bridge.command.leg import alive, order, owners, reports, start
from bridge.command.leg.deeds import About, happen
from bridge.command.leg.due import judge, run_out
from bridge.command.leg.effect import Answer, Effect
from bridge.command.leg.event import (
    ActualWords,
    BridgeGap,
    Connection,
    Event,
    NodeBack,
    OwnWatch,
    Report,
    StartAnew,
    Time,
)
from bridge.command.leg.forwarded import Edge, Stop, Words, judged
from bridge.command.leg.settings import LegSettings
from bridge.command.leg.settle import look_at_way, settle
from bridge.command.leg.state import LegState, Output, Stage, Timer, Way
from bridge.command.leg.table import Stimulus
from bridge.command.leg.turn import Turn
from bridge.command.leg.words import at_rest, control_word
from bridge.command.messages.event import Kind
from bridge.command.messages.freshness import TAKEN_LATE, arrival_of, is_stale, limit_ms_of
from bridge.command.messages.request import (
    DONE,
    STOP_ACTIONS,
    Action,
    Code,
    Do,
    Outcome,
    Request,
    SetTimeout,
    Start,
    TakeControl,
    Write,
    refused,
)
from bridge.command.messages.telegram import Refusal
from bridge.drive import FAULTED, ControlWords
from bridge.image import Value
from bridge.text import Text

_OVERWRITTEN: Final = Outcome(Code.CANCELLED, Text.of("start.overwritten"))
_CAME_LATE: Final = Text.of("request.came_late")
_IS_LIFELESS: Final = Text.of("request.came_lifeless")
_STOPS: Final[Mapping[Action, Callable[[ControlWords, int], int]]] = {
    Action.STOP: ControlWords.stop,
    Action.QUICK_STOP: ControlWords.quick_stop,
    Action.DISABLE_VOLTAGE: ControlWords.disable_voltage,
}


def initial(settings: LegSettings) -> LegState:
    """State of a bridge that starts: nobody owns the drive, and its node has not been seen."""
    rest = settings.resting or (0,) * settings.setpoints
    stopped = settings.words.stopped
    timer = Timer(settings.timeout_ms)
    way = Way(
        is_open=False, why=Text.of("node.state_of_drives", state=Text.word("node_state", "not seen yet"))
    )
    sent = Output((stopped, *rest))
    return LegState(way=way, timer=timer, word=stopped, sent=sent, setpoints=rest, rest=rest)


def step(settings: LegSettings, state: LegState, event: Event, now: float) -> tuple[LegState, list[Effect]]:
    """Let ``event`` happen ``now``."""
    turn, kind = Turn(settings, state, now), type(event)
    _ON[kind](turn, event)
    if kind is Connection:
        return turn.end(), turn.effects
    settle(turn)
    effects = judged(settings, turn.asked, turn.way, turn.sent, turn.effects)
    if kind is StartAnew:
        reports.on_told_anew(turn)
    after = turn.end()
    return (state if after == state else after), effects


def _on_time(turn: Turn, event: Time) -> None:
    judge(turn)
    if event.way is not None:
        turn.way = event.way
    start.on_time(turn)


def _on_way(turn: Turn, event: Way) -> None:
    turn.way = event


def _on_actual_words(turn: Turn, event: ActualWords) -> None:
    reports.on_actual_words(turn, event.words)


def _on_node_back(turn: Turn, event: NodeBack) -> None:
    happen(turn, Stimulus.NODE_BACK, About(Outcome(Code.CANCELLED, Text.of("node.restarted"))))


def _on_start_anew(turn: Turn, event: StartAnew) -> None:
    happen(turn, Stimulus.ANEW, About(Outcome(Code.CANCELLED, Text.of("start.enable_anew"))))
    turn.trip = turn.trip._replace(burst=None)


def _on_gap(turn: Turn, event: BridgeGap) -> None:
    judge(turn)
    if turn.is_tripped:
        # Still tripped; but a "hold" does not outlive the one who held.
        happen(turn, Stimulus.LEFT)
    else:
        owners.leave(turn)


def _on_own_watch(turn: Turn, event: OwnWatch) -> None:
    turn.silence_stops = event.stops


# requests


def _handle(turn: Turn, request: Request) -> None:
    """Do what ``request`` asks and answer it, or refuse it and change nothing."""
    judge(turn)
    try:
        owners.check_authority(turn, request)
        if request.action not in TAKEN_LATE and _is_stale(turn, request):
            raise _stale(turn, request)
        alive.check(turn, request)
        _carry_out(turn, request)
    except Refusal as refusal:
        turn.begin_anew()
        judge(turn)
        who = request.identity.named_beside(turn.owner.identity)
        turn.tell(Kind.REFUSED, 300, refused(request.action, who, refusal.said))
        outcome = Outcome(refusal.code, refusal.said, forwarded=False)
        turn.effects.append(Answer(outcome, is_refused=True))


def _is_stale(turn: Turn, request: Request) -> bool:
    return is_stale(request, turn.now, turn.timer.timeout_ms)


def _stale(turn: Turn, request: Request) -> Refusal:
    """The refusal of a request that may have waited too long."""
    limit_ms = limit_ms_of(request, turn.timer.timeout_ms)
    return Refusal(Code.STALE, Text.of("request.may_be_old", limit_ms=limit_ms))


def _carry_out(turn: Turn, request: Request) -> None:
    match request.command:
        case Write(values=values):
            _write(turn, request, values)
        case Do(action=Action.KEEP_ALIVE):
            owners.hear(turn, request)
            turn.answer(DONE)
        case Do(action=Action.RESET_FAULT):
            _reset_fault(turn, request)
        case Do(action=action) if action in STOP_ACTIONS:
            _stop(turn, request)
        case Start(direction=direction):
            _start(turn, request, direction)
        case TakeControl(ttl_ms=ttl_ms):
            owners.take_control(turn, request.identity, ttl_ms)
            turn.answer(DONE)
        case Do(action=Action.RELEASE_CONTROL):
            turn.answer(owners.release(turn, request.identity))
        case SetTimeout(timeout_ms=timeout_ms):
            owners.set_timeout(turn, request.identity, timeout_ms)
            turn.answer(DONE)
        case _:
            action = Text.word("action", request.action)
            raise Refusal(Code.UNKNOWN_POINT, Text.of("request.unknown_action", action=action))


# telegrams


def _write(turn: Turn, request: Request, values: Mapping[str, Value]) -> None:
    words = turn.settings.words
    is_owner = request.identity.goes_on_as(turn.owner.identity)
    # A new owner inherits no setpoints.
    kept = turn.setpoints if is_owner else turn.rest
    alive_until = alive.read(turn, request.identity, values.get(LIFE_SIGN))
    if LIFE_SIGN in values:
        values = {name: value for name, value in values.items() if name != LIFE_SIGN}
    telegram = turn.settings.decode(values, kept, control_word(words, turn))
    word = telegram.control_word
    if word is not None and not words.is_valid(word):
        why = Refusal(Code.NOT_VALID, Text.of("request.data_not_valid", word=word))
        happen(turn, Stimulus.INVALID, About(refusal=why))
    is_late = _is_stale(turn, request)
    if is_late or alive.is_missing(turn, alive_until):
        if word is None or not is_owner or words.enables(word):
            raise _stale(turn, request) if is_late else alive.refusal()
        _take_stale_stop(turn, word, _CAME_LATE if is_late else _IS_LIFELESS)
        return
    owners.own(turn, request)
    alive.note(turn, alive_until)
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
            turn.asked = Words(word, telegram.setpoints)
            turn.answer(Outcome(Code.OK, Text.of("request.acknowledged")))
            return
        if not is_edge and not turn.word & mask:
            word &= ~mask  # what was sent meanwhile would make an edge of a bit that never fell
    turn.hear(arrival_of(request, turn.now), tuple(values))
    _take(turn, Words(word, telegram.setpoints), values)


def _take(turn: Turn, asked: Words, values: Mapping[str, Value]) -> None:
    """The words of a valid telegram. With one that does not enable, what was ordered before it is not gone to
    any more, nor what comes with a stop of a running drive."""
    look_at_way(turn)
    word, turn.setpoints = asked
    turn.keep_at_rest()
    is_stop = word is not None and not turn.settings.words.enables(word)
    handshake = turn.settings.handshake
    if handshake is not None:
        if is_stop:
            turn.order = order.dropped(turn.order)
        stops_it = is_stop and turn.is_enabled
        if handshake.value in values and not stops_it and not turn.is_tripped:
            position = tuple(turn.setpoints[place] for place in handshake.places)
            turn.order = order.ordered(turn.order, position)
    about = About(_OVERWRITTEN, asked)
    if word is None:
        happen(turn, Stimulus.SETPOINTS, about)
        return
    turn.word, turn.is_ours = word, False
    if is_stop and turn.settings.acknowledge_resumes and not turn.is_tripped:
        turn.is_asked = False
    happen(turn, Stimulus.STOP_WORD if is_stop else Stimulus.ENABLING_WORD, about)


def _take_stale_stop(turn: Turn, word: int, why: Text) -> None:
    """The owner's stop, however long it has waited, or by a program that may be dead; ``why``. It is no sign
    of life, acknowledges nothing and brings no setpoints."""
    acknowledge = turn.settings.words.acknowledge_mask
    turn.stop(word & ~acknowledge | turn.word & acknowledge, is_asked=True)
    about = About(_OVERWRITTEN, Words(word, turn.rest), done=Outcome(Code.OK, why))
    happen(turn, Stimulus.LATE_STOP, about)


# acknowledge, stop, start


def _reset_fault(turn: Turn, request: Request) -> None:
    """A method is an order each time; a register acknowledges where the telegram before it did not."""
    if request.pressed:
        was_pressed = request.identity.goes_on_as(turn.edges.pressed_by)
        turn.edges = turn.edges._replace(pressed_by=request.identity)
        if was_pressed:
            owners.hear(turn, request)
            turn.answer(Outcome(Code.OK, Text.of("request.no_edge"), forwarded=False))
            return
    owners.own(turn, request)
    _acknowledge(turn, request, pulse=True)
    turn.asked = Edge()
    turn.answer(DONE)


def _acknowledge(turn: Turn, request: Request, *, pulse: bool) -> None:
    """Leave the trip, and stop what would go on after a fault of the drive itself. With ``pulse`` an
    acknowledge edge is sent to the drive."""
    was_tripped = turn.is_tripped
    turn.hear(arrival_of(request, turn.now))
    is_reset = pulse and turn.drive in FAULTED
    word = at_rest(turn.settings.words, turn.sent.words[0])
    if turn.settings.reaction == "silence" and was_tripped and turn.trip.burst is None:
        # Nobody has asked for a ramp.
        word = turn.settings.words.disable_voltage(word)
    stimulus = Stimulus.ACKNOWLEDGE_FAULT if is_reset else Stimulus.ACKNOWLEDGE
    happen(turn, stimulus, About(word=word, pulse=pulse))
    if turn.settings.acknowledge_resumes and turn.stage is Stage.INTERLOCKED and not turn.is_asked:
        # Whoever acknowledges means to go on: nothing is active by that.
        happen(turn, Stimulus.RESUME)
    if was_tripped:
        by = str(turn.owner.identity)
        turn.tell(Kind.WATCHDOG, 200, Text.of("watchdog.acknowledged", who=by))


def _stop(turn: Turn, request: Request) -> None:
    """Stop, by whoever asks. The owner's telegrams go on counting, its old enable does not."""
    who, owner = request.identity, turn.owner
    action = Text.word("action", request.action)
    if who.goes_on_as(owner.identity):
        if not _is_stale(turn, request) and alive.is_there(turn, who):
            owners.hear(turn, request)
    else:
        named = who.named_beside(owner.identity)
        turn.tell(Kind.OWNER, 400, Text.of("request.by", action=action, who=named))
        if turn.timer.timeout_ms == 0 and owner.identity is not None and owner.stopped_until is None:
            # Whoever is there answers to a stop of its drive.
            turn.owner = owner._replace(stopped_until=turn.now + owners.GONE_S)
    run_out(turn)  # what is silent by now has to be broken
    stop = Stop(partial(_STOPS[request.action], turn.settings.words))
    ends = Outcome(Code.CANCELLED, Text.of("request.by", action=action, who=str(who)))
    was_sent = _has_been_sent(turn, stop.of(turn.sent.words[0]))
    happen(turn, Stimulus.STOP_AGAIN if was_sent else Stimulus.STOP, About(ends, stop))


def _has_been_sent(turn: Turn, word: int) -> bool:
    """This stop has broken the silence before, and nothing is sent any more."""
    is_silent = turn.stage is Stage.SILENCED and turn.silence_stops
    return is_silent and word == turn.trip.burst


def _start(turn: Turn, request: Request, direction: int) -> None:
    words = turn.settings.words
    bits = {0: 0, 1: words.forward, -1: words.reverse}.get(direction)
    if bits is None:
        raise Refusal(Code.OUT_OF_RANGE, Text.of("request.direction_range", direction=direction))
    if direction < 0 and not bits:
        # Forward is what such a drive does with a positive setpoint: that needs no bit.
        raise Refusal(Code.OUT_OF_RANGE, Text.of("request.direction_by_sign"))
    look_at_way(turn)
    refusal = _why_not_started(turn)
    owners.hear(turn, request)
    start.begin(turn, words.run | bits, refusal)


def _why_not_started(turn: Turn) -> Refusal:
    """Told where the table refuses the start."""
    if turn.is_tripped or turn.drive in FAULTED:
        return Refusal(Code.ACKNOWLEDGE_FIRST, Text.of("request.acknowledge_first"))
    return Refusal(Code.NOT_READY, turn.way.why_unsent if turn.may_enable else turn.why_blocked)


_ON: Final[dict[type[Event], Callable[[Turn, Any], None]]] = {
    Request: _handle,
    Time: _on_time,
    Report: reports.on_report,
    Way: _on_way,
    ActualWords: _on_actual_words,
    NodeBack: _on_node_back,
    StartAnew: _on_start_anew,
    BridgeGap: _on_gap,
    OwnWatch: _on_own_watch,
    Connection: owners.on_connection,
}
