"""The leg's one verb: ``step(settings, state, event, now)`` gives the next state and what has come of it.

Pure: times are monotonic seconds, given from outside. A state that is the same afterwards is the same object.

Each step goes one way: first it is found out what happens (here, in ``reports``, ``start``, ``due`` and
``owners``); the table says the next stage and the deed, which is done (``deeds``); and then the other table
says what is sent (``settle``, ``word_table``).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, Final

from bridge.catalogue.points import LIFE_SIGN
from bridge.command.leg import alive, order, owners, reports, start
from bridge.command.leg.deeds import About, happen
from bridge.command.leg.draft import Draft
from bridge.command.leg.due import judge, run_out
from bridge.command.leg.effect import Answer, Effect
from bridge.command.leg.event import (
    ActualWords,
    BridgeGap,
    Connection,
    Event,
    NodeBack,
    StartAnew,
    StatusReport,
    StopsOnSilence,
    Time,
)
from bridge.command.leg.forwarded import Edge, StopRule, Words, judged
from bridge.command.leg.settings import LegSettings
from bridge.command.leg.settle import look_at_way, settle
from bridge.command.leg.state import LegState, RpdoWords, Stage, Timer, Way
from bridge.command.leg.table import Stimulus
from bridge.command.leg.word_table import at_rest, control_word
from bridge.command.messages.event import EventKind
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
    sent = RpdoWords((stopped, *rest))
    return LegState(way=way, timer=timer, word=stopped, sent=sent, setpoints=rest, rest=rest)


def step(settings: LegSettings, state: LegState, event: Event, now: float) -> tuple[LegState, list[Effect]]:
    """Let ``event`` happen ``now``."""
    draft, kind = Draft(settings, state, now), type(event)
    _ON[kind](draft, event)
    if kind is Connection:
        return draft.end(), draft.effects
    settle(draft)
    effects = judged(settings, draft.asked, draft.way, draft.sent, draft.effects)
    if kind is StartAnew:
        reports.on_told_anew(draft)
    after = draft.end()
    return (state if after == state else after), effects


def _on_time(draft: Draft, event: Time) -> None:
    judge(draft)
    if event.way is not None:
        draft.way = event.way
    start.on_time(draft)


def _on_way(draft: Draft, event: Way) -> None:
    draft.way = event


def _on_actual_words(draft: Draft, event: ActualWords) -> None:
    reports.on_actual_words(draft, event.words)


def _on_node_back(draft: Draft, event: NodeBack) -> None:
    happen(draft, Stimulus.NODE_BACK, About(Outcome(Code.CANCELLED, Text.of("node.restarted"))))


def _on_start_anew(draft: Draft, event: StartAnew) -> None:
    happen(draft, Stimulus.ANEW, About(Outcome(Code.CANCELLED, Text.of("start.enable_anew"))))
    draft.trip = draft.trip._replace(burst=None)


def _on_gap(draft: Draft, event: BridgeGap) -> None:
    judge(draft)
    if draft.is_tripped:
        # Still tripped; but a "hold" does not outlive the one who held.
        happen(draft, Stimulus.LEFT)
    else:
        owners.leave(draft)


def _on_own_watch(draft: Draft, event: StopsOnSilence) -> None:
    draft.silence_stops = event.stops


# requests


def _handle(draft: Draft, request: Request) -> None:
    """Do what ``request`` asks and answer it, or refuse it and change nothing."""
    judge(draft)
    try:
        owners.check_authority(draft, request)
        if request.action not in TAKEN_LATE and _is_stale(draft, request):
            raise _stale(draft, request)
        alive.check(draft, request)
        _carry_out(draft, request)
    except Refusal as refusal:
        draft.begin_anew()
        judge(draft)
        who = request.identity.named_beside(draft.owner.identity)
        draft.tell(EventKind.REFUSED, 300, refused(request.action, who, refusal.said))
        outcome = Outcome(refusal.code, refusal.said, forwarded=False)
        draft.effects.append(Answer(outcome, is_refused=True))


def _is_stale(draft: Draft, request: Request) -> bool:
    return is_stale(request, draft.now, draft.timer.timeout_ms)


def _stale(draft: Draft, request: Request) -> Refusal:
    """Refusal of a request that may have waited too long."""
    limit_ms = limit_ms_of(request, draft.timer.timeout_ms)
    return Refusal(Code.STALE, Text.of("request.may_be_old", limit_ms=limit_ms))


def _carry_out(draft: Draft, request: Request) -> None:
    match request.command:
        case Write(values=values):
            _write(draft, request, values)
        case Do(action=Action.KEEP_ALIVE):
            owners.hear(draft, request)
            draft.answer(DONE)
        case Do(action=Action.RESET_FAULT):
            _reset_fault(draft, request)
        case Do(action=action) if action in STOP_ACTIONS:
            _stop(draft, request)
        case Start(direction=direction):
            _start(draft, request, direction)
        case TakeControl(ttl_ms=ttl_ms):
            owners.take_control(draft, request.identity, ttl_ms)
            draft.answer(DONE)
        case Do(action=Action.RELEASE_CONTROL):
            draft.answer(owners.release(draft, request.identity))
        case SetTimeout(timeout_ms=timeout_ms):
            owners.set_timeout(draft, request.identity, timeout_ms)
            draft.answer(DONE)
        case _:
            action = Text.word("action", request.action)
            raise Refusal(Code.UNKNOWN_POINT, Text.of("request.unknown_action", action=action))


# telegrams


def _write(draft: Draft, request: Request, values: Mapping[str, Value]) -> None:
    words = draft.settings.words
    is_owner = request.identity.goes_on_as(draft.owner.identity)
    # A new owner inherits no setpoints.
    kept = draft.setpoints if is_owner else draft.rest
    alive_until = alive.read(draft, request.identity, values.get(LIFE_SIGN))
    if LIFE_SIGN in values:
        values = {name: value for name, value in values.items() if name != LIFE_SIGN}
    telegram = draft.settings.decode(values, kept, control_word(words, draft), draft.way.is_heard)
    word = telegram.control_word
    if word is not None and not words.is_valid(word):
        why = Refusal(Code.NOT_VALID, Text.of("request.data_not_valid", word=word))
        happen(draft, Stimulus.INVALID, About(refusal=why))
    is_late = _is_stale(draft, request)
    if is_late or alive.is_missing(draft, alive_until):
        if word is None or not is_owner or words.enables(word):
            raise _stale(draft, request) if is_late else alive.refusal()
        _take_stale_stop(draft, word, _CAME_LATE if is_late else _IS_LIFELESS)
        return
    owners.own(draft, request)
    alive.note(draft, alive_until)
    if word is not None:
        mask = words.acknowledge_mask
        is_set, was_set = bool(word & mask), draft.edges.bit
        is_edge = is_set and was_set is False
        if is_set is not was_set:
            draft.edges = draft.edges._replace(bit=is_set)
        if is_edge and draft.is_tripped:
            _acknowledge(draft, request, pulse=False)
            # The edge itself goes on to the drive; whatever else the word asks has to be asked anew.
            draft.word |= mask
            draft.asked = Words(word, telegram.setpoints)
            draft.answer(Outcome(Code.OK, Text.of("request.acknowledged")))
            return
        if not is_edge and not draft.word & mask:
            word &= ~mask  # what was sent meanwhile would make an edge of a bit that never fell
    draft.hear(arrival_of(request, draft.now), tuple(values))
    _take(draft, Words(word, telegram.setpoints), values)


def _take(draft: Draft, asked: Words, values: Mapping[str, Value]) -> None:
    """The words of a valid telegram. With one that does not enable, what was ordered before it is not gone to
    any more, nor what comes with a stop of a running drive."""
    look_at_way(draft)
    word, draft.setpoints = asked
    draft.keep_at_rest()
    is_stop = word is not None and not draft.settings.words.enables(word)
    handshake = draft.settings.handshake
    if handshake is not None:
        if is_stop:
            draft.order = order.dropped(draft.order)
        stops_it = is_stop and draft.is_enabled
        if handshake.value in values and not stops_it and not draft.is_tripped:
            position = tuple(draft.setpoints[place] for place in handshake.places)
            draft.order = order.ordered(draft.order, position)
    about = About(_OVERWRITTEN, asked)
    if word is None:
        happen(draft, Stimulus.SETPOINTS, about)
        return
    draft.word, draft.is_ours = word, False
    if is_stop and draft.settings.acknowledge_resumes and not draft.is_tripped:
        draft.is_asked = False
    happen(draft, Stimulus.STOP_WORD if is_stop else Stimulus.ENABLING_WORD, about)


def _take_stale_stop(draft: Draft, word: int, why: Text) -> None:
    """The owner's stop, however long it has waited, or by a program that may be dead; ``why``. It is no sign
    of life, acknowledges nothing and brings no setpoints."""
    acknowledge = draft.settings.words.acknowledge_mask
    draft.stop(word & ~acknowledge | draft.word & acknowledge, is_asked=True)
    about = About(_OVERWRITTEN, Words(word, draft.rest), done=Outcome(Code.OK, why))
    happen(draft, Stimulus.LATE_STOP, about)


# acknowledge, stop, start


def _reset_fault(draft: Draft, request: Request) -> None:
    """A method is an order each time; a register acknowledges where the telegram before it did not."""
    if request.pressed:
        was_pressed = request.identity.goes_on_as(draft.edges.pressed_by)
        draft.edges = draft.edges._replace(pressed_by=request.identity)
        if was_pressed:
            owners.hear(draft, request)
            draft.answer(Outcome(Code.OK, Text.of("request.no_edge"), forwarded=False))
            return
    owners.own(draft, request)
    _acknowledge(draft, request, pulse=True)
    draft.asked = Edge()
    draft.answer(DONE)


def _acknowledge(draft: Draft, request: Request, *, pulse: bool) -> None:
    """Leave the trip, and stop what would go on after a fault of the drive itself. With ``pulse`` an
    acknowledge edge is sent to the drive."""
    was_tripped = draft.is_tripped
    draft.hear(arrival_of(request, draft.now))
    is_reset = pulse and draft.drive in FAULTED
    word = at_rest(draft.settings.words, draft.sent.words[0])
    if draft.settings.reaction.is_silent and was_tripped and draft.trip.burst is None:
        # Nobody has asked for a ramp.
        word = draft.settings.words.disable_voltage(word)
    stimulus = Stimulus.ACKNOWLEDGE_FAULT if is_reset else Stimulus.ACKNOWLEDGE
    happen(draft, stimulus, About(word=word, pulse=pulse))
    if draft.settings.acknowledge_resumes and draft.stage is Stage.INTERLOCKED and not draft.is_asked:
        # Whoever acknowledges means to go on: nothing is active by that.
        happen(draft, Stimulus.RESUME)
    if was_tripped:
        by = str(draft.owner.identity)
        draft.tell(EventKind.WATCHDOG, 200, Text.of("watchdog.acknowledged", who=by))


def _stop(draft: Draft, request: Request) -> None:
    """Stop, by whoever asks. The owner's telegrams go on counting, its old enable does not."""
    who, owner = request.identity, draft.owner
    action = Text.word("action", request.action)
    if who.goes_on_as(owner.identity):
        if not _is_stale(draft, request) and alive.is_there(draft, who):
            owners.hear(draft, request)
    else:
        named = who.named_beside(owner.identity)
        draft.tell(EventKind.OWNER, 400, Text.of("request.by", action=action, who=named))
        if draft.timer.timeout_ms == 0 and owner.identity is not None and owner.stopped_until is None:
            # Whoever is there answers to a stop of its drive.
            draft.owner = owner._replace(stopped_until=draft.now + owners.GONE_S)
    run_out(draft)  # what is silent by now has to be broken
    stop = StopRule(partial(_STOPS[request.action], draft.settings.words))
    ends = Outcome(Code.CANCELLED, Text.of("request.by", action=action, who=str(who)))
    was_sent = _has_been_sent(draft, stop.of(draft.sent.words[0]))
    happen(draft, Stimulus.STOP_AGAIN if was_sent else Stimulus.STOP, About(ends, stop))


def _has_been_sent(draft: Draft, word: int) -> bool:
    """This stop has broken the silence before, and nothing is sent any more."""
    is_silent = draft.stage is Stage.SILENCED and draft.silence_stops
    return is_silent and word == draft.trip.burst


def _start(draft: Draft, request: Request, direction: int) -> None:
    words = draft.settings.words
    runs = {0: words.run, 1: words.run | words.forward, -1: words.run | words.reverse}
    word = runs.get(direction)
    if word is None:
        raise Refusal(Code.OUT_OF_RANGE, Text.of("request.direction_range", direction=direction))
    if direction < 0 and not words.reverse:
        # Forward is what such a drive does with a positive setpoint: that needs no bit.
        raise Refusal(Code.OUT_OF_RANGE, Text.of("request.direction_by_sign"))
    look_at_way(draft)
    refusal = _why_not_started(draft)
    owners.hear(draft, request)
    start.begin(draft, word, refusal)


def _why_not_started(draft: Draft) -> Refusal:
    """Told where the table refuses the start."""
    if draft.is_tripped or draft.drive in FAULTED:
        return Refusal(Code.ACKNOWLEDGE_FIRST, Text.of("request.acknowledge_first"))
    return Refusal(Code.NOT_READY, draft.way.why_unsent if draft.may_enable else draft.why_blocked)


_ON: Final[dict[type[Event], Callable[[Draft, Any], None]]] = {
    Request: _handle,
    Time: _on_time,
    StatusReport: reports.on_report,
    Way: _on_way,
    ActualWords: _on_actual_words,
    NodeBack: _on_node_back,
    StartAnew: _on_start_anew,
    BridgeGap: _on_gap,
    StopsOnSilence: _on_own_watch,
    Connection: owners.on_connection,
}
