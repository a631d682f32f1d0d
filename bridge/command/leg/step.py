"""The leg's one verb: ``step(settings, state, event, now)`` gives the next state and what has come of it.

Pure: times are monotonic seconds, given from outside. A state that is the same afterwards is the same object.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from bridge.command.leg import alive, order, owners, start
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
from bridge.command.leg.forwarded import SENT_BEFORE, Edge, Stop, Words, judged
from bridge.command.leg.settings import LegSettings
from bridge.command.leg.state import (
    LegState,
    Motion,
    Output,
    Timer,
    Way,
)
from bridge.command.leg.table import Deed, Stimulus
from bridge.command.leg.turn import Turn, control_word
from bridge.command.messages.event import Kind
from bridge.command.messages.freshness import TAKEN_LATE, arrival_of, is_stale, limit_ms_of
from bridge.command.messages.life_sign import LEAF
from bridge.command.messages.request import (
    DONE,
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
from bridge.drive import FAULTED
from bridge.image import Value
from bridge.text import Text

_OVERWRITTEN: Final = Outcome(Code.CANCELLED, Text.of("start.overwritten"))

_CAME_LATE: Final = Text.of("request.came_late")
_IS_LIFELESS: Final = Text.of("request.came_lifeless")


def initial(settings: LegSettings) -> LegState:
    """Of a bridge that starts: nobody owns the drive, and its node has not been seen."""
    rest = settings.resting or (0,) * settings.setpoints
    stopped = settings.words.stopped
    timer = Timer(settings.timeout_ms)
    way = Way(is_open=False, why="the drive's node is not seen yet")
    sent = Output((stopped, *rest))
    return LegState(way=way, timer=timer, word=stopped, sent=sent, setpoints=rest, rest=rest)


def step(settings: LegSettings, state: LegState, event: Event, now: float) -> tuple[LegState, list[Effect]]:
    """Let ``event`` happen ``now``."""
    turn = Turn(settings, state, now)
    match event:
        case Request():
            _handle(turn, event)
        case Time(way=way):
            turn.judge()
            if way is not None:
                turn.way = way
            start.on_time(turn)
        case Report():
            _report(turn, event)
        case Way():
            turn.way = event
        case ActualWords(words=words):
            _follow(turn, words)
        case NodeBack():
            turn.happens(Stimulus.NODE_BACK, Outcome(Code.CANCELLED, Text.of("node.restarted")))
        case StartAnew():
            _start_anew(turn)
        case BridgeGap():
            _gap(turn)
        case OwnWatch(stops=stops):
            turn.silence_stops = stops
        case Connection():
            owners.on_connection(turn, event)
            return turn.end(), turn.effects
    turn.settle()
    effects = judged(settings, turn.asked, turn.way, turn.sent, turn.effects)
    if isinstance(event, StartAnew):
        # What the drive says from now on is from after all that it was told.
        if turn.motion is Motion.EXPECTED:
            turn.motion = Motion.SEEN
        elif turn.motion is Motion.FAULTED:
            turn.motion = Motion.ENDED
    after = turn.end()
    return (state if after == state else after), effects


def _report(turn: Turn, report: Report) -> None:
    is_news = report.state is not turn.drive
    turn.is_taken = report.is_taken
    turn.reported(report.state)
    if not turn.way.is_heard:
        turn.way = turn.way._replace(is_heard=True)
    start.on_report(turn, report, is_news=is_news)


def _follow(turn: Turn, actual: tuple[int, ...]) -> None:
    rest = list(turn.rest)
    for place, source in turn.settings.follows:
        rest[place] = actual[source]
    turn.rest = tuple(rest)
    turn.keep_at_rest()


def _start_anew(turn: Turn) -> None:
    turn.happens(Stimulus.ANEW, Outcome(Code.CANCELLED, Text.of("start.enable_anew")))
    turn.trip = turn.trip._replace(burst=None)
    turn.stop(turn.settings.words.stop(turn.sent.words[0]))


def _gap(turn: Turn) -> None:
    turn.judge()
    if turn.is_tripped:
        # Still tripped; but a "hold" does not outlive the one who held.
        turn.happens(Stimulus.LEFT)
        turn.stop(turn.settings.words.stop(turn.sent.words[0]))
    else:
        turn.leave()


# what a request makes of the leg


def _handle(turn: Turn, request: Request) -> None:
    """Do what ``request`` asks, or refuse it and change nothing."""
    turn.judge()
    try:
        owners.check_authority(turn, request)
        if request.action not in TAKEN_LATE and _is_stale(turn, request):
            raise _stale(turn, request)
        alive.check(turn, request)
        if isinstance(request.command, Start):
            _start(turn, request, request.command.direction)
        else:
            turn.effects.append(Answer(_carry_out(turn, request)))
    except Refusal as refusal:
        who = request.identity.named_beside(turn.owner.identity)
        turn.tell(Kind.REFUSED, 300, refused(request.action, who, refusal.said))
        outcome = Outcome(refusal.code, refusal.said, forwarded=False)
        turn.effects.append(Answer(outcome, is_refused=True))


def _is_stale(turn: Turn, request: Request) -> bool:
    return is_stale(request, turn.now, turn.timer.timeout_ms)


def _stale(turn: Turn, request: Request) -> Refusal:
    """Why it does not count that it can have waited for so long."""
    limit_ms = limit_ms_of(request, turn.timer.timeout_ms)
    return Refusal(Code.STALE, Text.of("request.may_be_old", limit_ms=limit_ms))


def _carry_out(turn: Turn, request: Request) -> Outcome:
    """What is done at once. Raises ``Refusal`` before anything has changed."""
    match request.command:
        case Write(values=values):
            return _write(turn, request, values)
        case Do(action=Action.KEEP_ALIVE):
            owners.hear(turn, request)
        case Do(action=Action.RESET_FAULT):
            return _reset_fault(turn, request)
        case Do(action=Action.STOP | Action.QUICK_STOP | Action.DISABLE_VOLTAGE):
            return _stop(turn, request)
        case TakeControl(ttl_ms=ttl_ms):
            owners.take_control(turn, request.identity, ttl_ms)
        case Do(action=Action.RELEASE_CONTROL):
            return owners.release(turn, request.identity)
        case SetTimeout(timeout_ms=timeout_ms):
            owners.set_timeout(turn, request.identity, timeout_ms)
        case _:
            action = Text.word("action", request.action)
            raise Refusal(Code.UNKNOWN_POINT, Text.of("request.unknown_action", action=action))
    return DONE


# telegrams


def _write(turn: Turn, request: Request, values: Mapping[str, Value]) -> Outcome:
    words = turn.settings.words
    is_owner = request.identity.goes_on_as(turn.owner.identity)
    # A new owner inherits no setpoints.
    kept = turn.setpoints if is_owner else turn.rest
    alive_until = alive.read(turn, request.identity, values.get(LEAF))
    if LEAF in values:
        values = {name: value for name, value in values.items() if name != LEAF}
    telegram = turn.settings.decode(values, kept, control_word(words, turn))
    word = telegram.control_word
    if word is not None and not words.is_valid(word):
        turn.happens(Stimulus.INVALID)
        raise Refusal(Code.NOT_VALID, Text.of("request.data_not_valid", word=word))
    is_late = _is_stale(turn, request)
    if is_late or alive.is_missing(turn, alive_until):
        if word is None or not is_owner or words.enables(word):
            raise _stale(turn, request) if is_late else alive.refusal()
        return _take_stale_stop(turn, word, _CAME_LATE if is_late else _IS_LIFELESS)
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
            return Outcome(Code.OK, Text.of("request.acknowledged"))
        if not is_edge and not turn.word & mask:
            word &= ~mask  # what was sent meanwhile would make an edge of a bit that never fell
    turn.hear(arrival_of(request, turn.now), tuple(values))
    if _take(turn, word, telegram.setpoints, values) is Deed.FORWARD:
        turn.asked = Words(word, telegram.setpoints)
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
        stops_it = is_stop and turn.is_enabled
        if handshake.value in values and not stops_it and not turn.is_tripped:
            position = tuple(turn.setpoints[place] for place in handshake.places)
            turn.order = order.ordered(turn.order, position)
    if word is None:
        return turn.happens(Stimulus.SETPOINTS)
    turn.word, turn.is_ours = word, False
    if is_stop and turn.settings.acknowledge_resumes and not turn.is_tripped:
        turn.is_asked = False
    return turn.happens(Stimulus.STOP_WORD if is_stop else Stimulus.ENABLING_WORD, _OVERWRITTEN)


def _take_stale_stop(turn: Turn, word: int, why: Text) -> Outcome:
    """The owner's stop, however long it has waited, or by a program that may be dead; ``why``. It is no sign
    of life, acknowledges nothing and brings no setpoints."""
    acknowledge = turn.settings.words.acknowledge_mask
    turn.stop(word & ~acknowledge | turn.word & acknowledge, is_asked=True)
    if turn.happens(Stimulus.LATE_STOP, _OVERWRITTEN) is Deed.TAKE:
        return Outcome(Code.OK, turn.why_blocked, forwarded=False)
    turn.asked = Words(word, turn.rest)
    return Outcome(Code.OK, why)


# acknowledge, stop, start


def _reset_fault(turn: Turn, request: Request) -> Outcome:
    """A method is an order each time; a register acknowledges where the telegram before it did not."""
    if request.pressed:
        was_pressed = request.identity.goes_on_as(turn.edges.pressed_by)
        turn.edges = turn.edges._replace(pressed_by=request.identity)
        if was_pressed:
            owners.hear(turn, request)
            return Outcome(Code.OK, Text.of("request.no_edge"), forwarded=False)
    owners.own(turn, request)
    _acknowledge(turn, request, pulse=True)
    turn.asked = Edge()
    return DONE


def _acknowledge(turn: Turn, request: Request, *, pulse: bool) -> None:
    was_tripped = turn.is_tripped
    turn.hear(arrival_of(request, turn.now))
    turn.clear(pulse=pulse)
    if was_tripped:
        by = str(turn.owner.identity)
        turn.tell(Kind.WATCHDOG, 200, Text.of("watchdog.acknowledged", who=by))


def _stop(turn: Turn, request: Request) -> Outcome:
    """Stop, by whoever asks. The owner's telegrams go on counting, its old enable does not."""
    who, action, words = request.identity, request.action, turn.settings.words
    owner = turn.owner
    if who.goes_on_as(owner.identity):
        if not _is_stale(turn, request) and alive.is_there(turn, who):
            owners.hear(turn, request)
    else:
        named = who.named_beside(owner.identity)
        turn.tell(Kind.OWNER, 400, Text.of("request.by", action=Text.word("action", action), who=named))
        if turn.timer.timeout_ms == 0 and owner.identity is not None and owner.stopped_until is None:
            # Whoever is there answers to a stop of its drive.
            turn.owner = owner._replace(stopped_until=turn.now + owners.GONE_S)
    changes = {
        Action.STOP: words.stop,
        Action.QUICK_STOP: words.quick_stop,
        Action.DISABLE_VOLTAGE: words.disable_voltage,
    }
    turn.run_out()  # what is silent by now has to be broken
    word = changes[action](turn.sent.words[0])
    if turn.has_been_sent(word):
        turn.happens(Stimulus.STOP_AGAIN)
        return Outcome(Code.OK, SENT_BEFORE, forwarded=False)
    by = Text.of("request.by", action=Text.word("action", action), who=str(who))
    turn.happens(Stimulus.STOP, Outcome(Code.CANCELLED, by))
    turn.stop_as_asked(word)
    turn.asked = Stop(changes[action])
    return DONE


def _start(turn: Turn, request: Request, direction: int) -> None:
    words = turn.settings.words
    bits = {0: 0, 1: words.forward, -1: words.reverse}.get(direction)
    if bits is None:
        raise Refusal(Code.OUT_OF_RANGE, Text.of("request.direction_range", direction=direction))
    if direction < 0 and not bits:
        # Forward is what such a drive does with a positive setpoint: that needs no bit.
        raise Refusal(Code.OUT_OF_RANGE, Text.of("request.direction_by_sign"))
    if turn.is_tripped or turn.drive in FAULTED:
        raise Refusal(Code.ACKNOWLEDGE_FIRST, Text.of("request.acknowledge_first"))
    if not turn.may_enable:
        raise Refusal(Code.NOT_READY, turn.why_blocked)
    if turn.way.why_unsent:
        raise Refusal(Code.NOT_READY, turn.way.why_unsent)
    owners.hear(turn, request)
    start.begin(turn, words.run | bits)
