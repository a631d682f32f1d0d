"""The leg's one verb: ``step(settings, state, event, now)`` gives the next state and what has come of it.

Pure: times are monotonic seconds, given from outside. A state that is the same afterwards is the same object.
"""

from __future__ import annotations

from bridge.command.leg import requests, rules, start
from bridge.command.leg.effect import Effect
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
from bridge.command.leg.settings import LegSettings
from bridge.command.leg.state import (
    LegState,
    Motion,
    Output,
    Timer,
    WatchdogState,
    Way,
)
from bridge.command.leg.table import Stimulus
from bridge.command.leg.turn import Turn
from bridge.command.leg.words import if_left, if_tripped
from bridge.command.request import Code, Outcome, Request


def initial(settings: LegSettings) -> LegState:
    """Of a bridge that starts: nobody owns the drive, and its node has not been seen."""
    rest = (0,) * settings.setpoints
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
            requests.handle(turn, event)
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
            turn.happens(Stimulus.NODE_BACK, Outcome(Code.CANCELLED, "the node has restarted"))
        case StartAnew():
            _start_anew(turn)
        case BridgeGap():
            _gap(turn)
        case OwnWatch(stops=stops):
            turn.silence_stops = stops
        case Connection(identity=identity, is_there=is_there):
            if identity.is_same(turn.owner.identity):
                absent_until = None if is_there else now + rules.GONE_S
                turn.owner = turn.owner._replace(absent_until=absent_until)
            return turn.end(), turn.effects
    turn.settle()
    if isinstance(event, StartAnew):
        # What the drive says from now on is from after all that it was told.
        if turn.motion is Motion.EXPECTED:
            turn.motion = Motion.SEEN
        elif turn.motion is Motion.FAULTED:
            turn.motion = Motion.ENDED
    after = turn.end()
    return (state if after == state else after), turn.effects


def _report(turn: Turn, report: Report) -> None:
    is_news = report.state is not turn.drive
    turn.is_taken = report.is_taken
    turn.reported(report.state)
    start.on_report(turn, report, is_news=is_news)


def _follow(turn: Turn, actual: tuple[int, ...]) -> None:
    rest = list(turn.rest)
    for place, source in turn.settings.follows:
        rest[place] = actual[source]
    turn.rest = tuple(rest)
    turn.keep_at_rest()


def _start_anew(turn: Turn) -> None:
    turn.happens(Stimulus.ANEW, Outcome(Code.CANCELLED, "the drive has to be enabled anew"))
    turn.stop(turn.settings.words.stop(turn.sent.words[0]))


def _gap(turn: Turn) -> None:
    turn.judge()
    if turn.is_tripped:
        # Still tripped; but a "hold" does not outlive the one who held.
        turn.happens(Stimulus.LEFT)
        turn.stop(turn.settings.words.stop(turn.sent.words[0]))
    else:
        turn.leave()


# what others may see


def watchdog_state(settings: LegSettings, state: LegState) -> WatchdogState:
    if state.stage.is_tripped:
        return WatchdogState.TRIPPED
    if not state.timer.timeout_ms or settings.ignores_errors:
        return WatchdogState.OFF
    return WatchdogState.IDLE if state.timer.heard_at is None else WatchdogState.RUNNING


def trips_at(settings: LegSettings, state: LegState) -> float | None:
    """When the drive is stopped unless its owner is heard; None where no time does that."""
    return None if state.stage.is_tripped or settings.ignores_errors else state.timer.deadline


def until(settings: LegSettings, state: LegState) -> float | None:
    """Until when what enables the drive may be on the bus, unless its owner is heard; None where no time ends
    it, or where nothing enables it."""
    if not settings.words.enables(state.sent.words[0]):
        return None
    trip = None if settings.reaction == "hold" else trips_at(settings, state)
    lease = state.owner.lease_until
    return lease if trip is None or (lease is not None and lease < trip) else trip


def output_then(settings: LegSettings, state: LegState) -> Output:
    """What is sent from ``until`` on."""
    is_trip = until(settings, state) == trips_at(settings, state)
    return (if_tripped(settings, state) if is_trip else None) or if_left(settings, state)


def next_deadline(state: LegState) -> float | None:
    """When ``Time`` is to happen; None for never."""
    times = (
        state.timer.deadline,
        state.owner.lease_until,
        state.trip.ramps_until,
        state.trip.silent_from,
        state.pulse_until,
        state.order.deadline,
        state.order.rises_at,
    )
    earliest = None if state.start is None else start.next_deadline(state.start)
    for time in times:
        if time is not None and (earliest is None or time < earliest):
            earliest = time
    return earliest
