"""Judge of one drive's stops: whether it does what the last one asked. ``step(state, event)`` gives the next
state and the verdicts that are to be told now.

Pure: times come with the events. The rules are those of docs/explanation/dead-man-chain.md, "A stop that is
not followed". The reaction to an ignored stop may halt a plant, so nothing is called ignored that may be
something else.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import inf
from typing import Final

from bridge.command.stop_check.event import (
    CutOff,
    Event,
    HandedOver,
    NodeOperational,
    NodeRestarted,
    NodeStopped,
    Sends,
    StatusChange,
    TelegramGap,
    TelegramHeard,
    TimePassed,
)
from bridge.command.stop_check.state import Bounds, LastStop, Says, Sent, StopState, StopVerdict
from bridge.command.stop_check.sums import IgnoredTime, Unfollowed
from bridge.command.stop_check.table import OUTCOME_TABLE, PLACE_TABLE, Evidence, News, OutcomeDeed, PlaceDeed

_LOOK_AGAIN_S: Final = 1.0
"""Interval in seconds at which a drive that is no longer heard is looked at."""
_SOON_S: Final = 0.001


def step(state: StopState, event: Event) -> tuple[StopState, tuple[StopVerdict, ...]]:
    """Let ``event`` happen. Only ``TimePassed`` brings verdicts: the bus has been drained by then."""
    match event:
        case TelegramHeard():
            state = on_telegram(state, event.at, event.speed)
        case StatusChange():
            state = _report(state, event)
        case TimePassed():
            state = _time(state, event)
            verdicts = state.untold
            return (state._replace(untold=()) if verdicts else state), verdicts
        case Sends():
            state = _sends(state, event)
        case HandedOver():
            state = _happens(state, News.HANDED_OVER, event.now, event.bounds)
        case NodeOperational():
            state = _node(state, event)
        case CutOff():
            state = _cut_off(state, event)
        case NodeStopped():
            state = _node_stopped(state, event)
        case NodeRestarted():
            if state.is_cut_off:
                state = _happens(state._replace(is_there=False), News.RESTARTED)
        case TelegramGap():
            state = _happens(state, News.PAUSE, event.at)
    return state, ()


def next_deadline(state: StopState) -> float | None:
    """Time of the next ``TimePassed``, already over where a verdict waits to be told; None for never."""
    at = state.untold[0].at if state.untold else _next_look(state)
    return None if at == inf else at


# the word and the node


def _sends(state: StopState, event: Sends) -> StopState:
    if event.sent is state.sent:
        return state
    was_enabled = state.sent is Sent.ENABLES
    state = state._replace(sent=event.sent)
    if event.sent is Sent.ENABLES:
        return _happens(state, News.ENABLES)
    if was_enabled:
        return _happens(state, News.STOPS if state.is_there else News.STOPS_AWAY)
    return _happens(state, News.STOPS_OTHERWISE if state.is_there else News.STOPS_OTHERWISE_AWAY)


def _node(state: StopState, event: NodeOperational) -> StopState:
    if event.is_there is state.is_there:
        return state
    state = state._replace(is_there=event.is_there)
    if event.is_there:
        return _happens(state, News.BACK)
    return state if state.is_cut_off else _happens(state, News.GONE)


def _cut_off(state: StopState, event: CutOff) -> StopState:
    if not state.is_there or state.sent is Sent.ENABLES or not state.is_informed:
        return state
    is_known_to_stop = state.obeys(event.now) and not state.may_be_enabled
    if state.last_stop is LastStop.IGNORED or is_known_to_stop:
        return state
    state = _happens(state, News.HANDED_OVER, event.now, event.bounds)
    return _happens(state, News.CUT_OFF, event.now, event.bounds)


def _node_stopped(state: StopState, event: NodeStopped) -> StopState:
    if not state.is_cut_off or state.last_stop is LastStop.IGNORED:
        return state
    return _judged(state._replace(says=Says.AT_REST, is_doubted=False), event.now)


def _happens(state: StopState, news: News, now: float = inf, bounds: Bounds | None = None) -> StopState:
    place, deed = PLACE_TABLE[state.place, news]
    before, state = state, _PLACE_DEEDS[deed](state, now, bounds or state.bounds)._replace(place=place)
    begins = state.is_on_bus and not before.obeys(now) and state.obeys(now)
    return _found(state, Evidence.BEGINS_TO_FOLLOW, now) if begins else state


def _nothing(state: StopState, now: float, bounds: Bounds) -> StopState:
    return state


def _forgotten(state: StopState) -> StopState:
    """State in which a stop and what the drive did about it are forgotten, but for what has been summed."""
    return state._replace(
        since=inf,
        until=inf,
        follows_since=inf,
        off_since=inf,
        has_rested=False,
        is_graced=False,
        is_cut_off=False,
        is_doubted=False,
        was_enabled=False,
        has_risen=False,
        look_at=-inf,
        sums=state.sums.end(),
        untold=(),
    )


def _forgive(state: StopState, now: float, bounds: Bounds) -> StopState:
    return _forgotten(state)._replace(last_stop=LastStop.NONE, follows=True)


def _forget(state: StopState, now: float, bounds: Bounds) -> StopState:
    return _forgotten(state)._replace(sums=Unfollowed(), says=Says.NOTHING)


def _begin(state: StopState, now: float, bounds: Bounds) -> StopState:
    return state._replace(last_stop=LastStop.FORWARDED, was_enabled=True)


def _begin_anew(state: StopState, now: float, bounds: Bounds) -> StopState:
    return _forget(state, now, bounds)._replace(last_stop=LastStop.FORWARDED)


def _bound(state: StopState, now: float, bounds: Bounds) -> StopState:
    until = now + bounds.of(state.sent)
    return _sent(state._replace(since=now, until=until), now, bounds)


def _change_bound(state: StopState, now: float, bounds: Bounds) -> StopState:
    sent, until = state.sent, now + bounds.of(state.sent)
    if sent is Sent.OFF:
        is_on = state.last_stop is LastStop.FOLLOWED and state.says in (Says.STOPPING, Says.HOLDING)
        state = state._replace(until=until if is_on else min(state.until, until))
    elif sent is Sent.RAMP and not state.has_rested:
        # The word before it may have been replaced before the drive had it. Alternating words cannot
        # postpone the end indefinitely.
        last = state.since + bounds.off_s + bounds.ramp_s
        later = until if state.until == inf else max(state.until, min(until, last))
        state = state._replace(until=later)
    return _sent(state, now, bounds)


def _sent(state: StopState, now: float, bounds: Bounds) -> StopState:
    state = state._replace(bounds=bounds, on_bus=state.sent, look_at=-inf)
    if state.sent is not Sent.SILENT:
        state = state._replace(off_since=now if state.sent is Sent.OFF else inf)
    return _summing(state)


def _last_report(state: StopState, now: float, bounds: Bounds) -> StopState:
    until = now + bounds.ramp_s if state.until == inf else state.until
    is_doubted = state.says is Says.AT_REST
    return state._replace(is_cut_off=True, is_doubted=is_doubted, until=until, look_at=-inf)


def _bound_anew(state: StopState, now: float, bounds: Bounds) -> StopState:
    bound_s = bounds.off_s if state.has_rested else bounds.of(state.on_bus)
    off_since = now if state.on_bus is Sent.OFF else inf
    return _summing(
        state._replace(since=now, until=now + bound_s, off_since=off_since, stopping_since=now, look_at=-inf)
    )


def _summing(state: StopState) -> StopState:
    on_from = state.off_since + state.bounds.seen_off_s
    return state._replace(sums=state.sums.begin(on_from, state.since + state.bounds.seen_s))


_PLACE_DEEDS: Final[Mapping[PlaceDeed, Callable[[StopState, float, Bounds], StopState]]] = {
    PlaceDeed.NOTHING: _nothing,
    PlaceDeed.FORGIVE: _forgive,
    PlaceDeed.BEGIN: _begin,
    PlaceDeed.BEGIN_ANEW: _begin_anew,
    PlaceDeed.BOUND: _bound,
    PlaceDeed.CHANGE_BOUND: _change_bound,
    PlaceDeed.FORGET: _forget,
    PlaceDeed.LAST_REPORT: _last_report,
    PlaceDeed.BOUND_ANEW: _bound_anew,
}


# the drive


def on_telegram(state: StopState, at: float, speed: float | None) -> StopState:
    """State after a ``TelegramHeard``. The stop check of a drive calls it without that event: telegrams are
    so many that making one for each shows in the cost of a PDO."""
    is_older = state.is_on_bus and at < state.since
    if is_older or state.says is not Says.ENABLED or state.sent is Sent.SILENT:
        return state
    bounds, before = state.bounds, state.sums
    sums, summed = before.seen(at, speed, off_s=bounds.off_s, ramp_s=bounds.ramp_s)
    if sums is not before:
        state = state.summed(sums)
    return state if summed is None else _found(state, Evidence.SUMMED, at, summed)


def _report(state: StopState, event: StatusChange) -> StopState:
    says, at, before = event.says, event.at, state.says
    has_obeyed = state.is_informed and state.obeys(at)
    has_risen = state.has_risen or says not in (Says.AT_REST, Says.NOTHING)
    state = state._replace(says=says, is_doubted=False, has_risen=has_risen)
    if says is Says.STOPPING and before is not says:
        state = state._replace(stopping_since=at)
    if says in (Says.STOPPING, Says.AT_REST) or (says is Says.HOLDING and state.on_bus is not Sent.OFF):
        # Also where the next word enables already.
        state = state._replace(sums=state.sums.obeyed())
    if not state.is_on_bus or at < state.since or says is Says.NOTHING:
        return state
    if not state.obeys(at):
        if state.on_bus is Sent.RAMP:
            again = Evidence.PUSHED if before is Says.HOLDING else Evidence.ENABLED_AGAIN
            state = _found(state, again, at)
        return _judged(state, at)
    if state.last_stop is not LastStop.IGNORED:
        return _judged(state, at)
    return state if has_obeyed else _found(state, Evidence.BEGINS_TO_FOLLOW, at)


def _judged(state: StopState, at: float) -> StopState:
    """Judge by a telegram received ``at``, which says what is known of the drive."""
    if state.obeys(at):
        return _found(state, Evidence.FOLLOWS, at)
    return _found(state, Evidence.RUNS_ON_LATE if at >= state.until else Evidence.RUNS_ON, at)


def _found(state: StopState, finding: Evidence, at: float, summed: IgnoredTime | None = None) -> StopState:
    outcome, deeds = OUTCOME_TABLE[state.last_stop, finding]
    for deed in deeds:
        state = _OUTCOME_DEEDS[deed](state, at, outcome, summed)
    return state


def _count(state: StopState, at: float, outcome: LastStop, summed: IgnoredTime | None) -> StopState:
    return state._replace(follows_since=at)


def _count_no_more(state: StopState, at: float, outcome: LastStop, summed: IgnoredTime | None) -> StopState:
    return state._replace(follows_since=inf)


def _rest(state: StopState, at: float, outcome: LastStop, summed: IgnoredTime | None) -> StopState:
    """Note that the ramp of a drive at rest has ended: enabled again, it has until the short bound."""
    if state.says is not Says.AT_REST or state.has_rested or state.may_rise:
        return state
    return state._replace(has_rested=True, until=min(state.until, state.since + state.bounds.off_s))


def _grant_ramp(state: StopState, at: float, outcome: LastStop, summed: IgnoredTime | None) -> StopState:
    return state._replace(until=at + state.bounds.ramp_s)


def _grant_short(state: StopState, at: float, outcome: LastStop, summed: IgnoredTime | None) -> StopState:
    if state.is_graced:
        return state
    return state._replace(is_graced=True, until=max(state.until, at + state.bounds.off_s))


def _tell(state: StopState, at: float, outcome: LastStop, summed: IgnoredTime | None) -> StopState:
    verdict = StopVerdict(
        outcome, state.last_stop, state.since, at, not state.follows, state.is_cut_off, summed
    )
    follows = outcome is LastStop.FOLLOWED
    untold = (*state.untold, verdict)
    return state._replace(last_stop=outcome, follows=follows, follows_since=inf, untold=untold)


_Change = Callable[[StopState, float, LastStop, IgnoredTime | None], StopState]
_OUTCOME_DEEDS: Final[Mapping[OutcomeDeed, _Change]] = {
    OutcomeDeed.COUNT: _count,
    OutcomeDeed.COUNT_NO_MORE: _count_no_more,
    OutcomeDeed.REST: _rest,
    OutcomeDeed.GRANT_RAMP: _grant_ramp,
    OutcomeDeed.GRANT_SHORT: _grant_short,
    OutcomeDeed.TELL: _tell,
}


# time


def _time(state: StopState, event: TimePassed) -> StopState:
    now, heard_at, pause_s = event
    if not state.is_on_bus or not state.is_informed:
        return state
    # Of a drive that sends changes alone, what it said before the stop is true to the short bound.
    old = state.since + state.bounds.off_s if pause_s is None else state.since
    at = now if pause_s is None or state.is_cut_off else heard_at
    if at is not None and at >= old:
        state = _judged(state, at)
    if now >= state.follows_since + state.bounds.off_s and state.obeys(now):
        # Not at once: another master's words and ours may alternate.
        state = _found(state, Evidence.CALM, now)
    if now >= _next_look(state):
        state = state._replace(look_at=_next_telegram(state, event))
    return state


def _next_telegram(state: StopState, event: TimePassed) -> float:
    """Time at which more will be known: nothing that the drive has said so far decides it."""
    now, heard_at, pause_s = event
    if pause_s is None:
        return max(state.since + state.bounds.off_s, now + _SOON_S)
    if heard_at is not None and now < heard_at + pause_s:
        return now + pause_s
    return now + _LOOK_AGAIN_S


def _next_look(state: StopState) -> float:
    """Time at which another outcome is due if the drive says nothing else."""
    if not state.is_on_bus or not state.is_informed:
        return inf
    return max(_due(state), state.look_at)


def _due(state: StopState) -> float:
    if state.last_stop is LastStop.IGNORED:
        return state.follows_since + state.bounds.off_s
    if not state.obeys(state.since):
        return state.until
    if state.last_stop is LastStop.FORWARDED:
        return state.since
    if state.says is Says.STOPPING:
        return max(state.until, state.stopping_limit)
    return inf
