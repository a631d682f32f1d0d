"""View of a leg from outside: its watchdog, and the words that it will send by itself, and when."""

from __future__ import annotations

from bridge.catalogue.codes import WatchdogState
from bridge.command.leg import start
from bridge.command.leg.draft import Draft
from bridge.command.leg.due import judge
from bridge.command.leg.settings import LegSettings
from bridge.command.leg.settle import settle
from bridge.command.leg.state import LegState, RpdoWords


def watchdog_state(settings: LegSettings, state: LegState) -> WatchdogState:
    if state.stage.is_tripped:
        return WatchdogState.TRIPPED
    if not state.timer.timeout_ms or settings.ignores_errors:
        return WatchdogState.OFF
    return WatchdogState.IDLE if state.timer.heard_at is None else WatchdogState.RUNNING


def trips_at(settings: LegSettings, state: LegState) -> float | None:
    """Time at which the drive is stopped unless its owner is heard; None for never."""
    return None if state.stage.is_tripped or settings.ignores_errors else state.timer.deadline


def until(settings: LegSettings, state: LegState) -> float | None:
    """Time until which words that enable the drive may be on the bus, unless its owner is heard; None without
    end, and where none enables it."""
    if not settings.words.enables(state.sent.words[0]):
        return None
    trip = None if settings.reaction.holds else trips_at(settings, state)
    lease = state.owner.lease_until
    return lease if trip is None or (lease is not None and lease < trip) else trip


def output_then(settings: LegSettings, state: LegState) -> RpdoWords:
    """Output from ``until`` on, made by the leg itself; the present one where ``until`` is None."""
    at = until(settings, state)
    if at is None:
        return state.sent
    then = Draft(settings, state, at)
    judge(then)
    settle(then)
    return then.sent


def next_deadline(state: LegState) -> float | None:
    """Time at which ``Time`` is to happen; None for never."""
    times = (
        state.timer.deadline,
        state.owner.lease_until,
        state.trip.ramps_until,
        state.trip.silent_from,
        state.trip.burst_until,
        state.pulse_until,
        state.order.deadline,
        state.order.rises_at,
    )
    earliest = None if state.start is None else start.next_deadline(state.start)
    for time in times:
        if time is not None and (earliest is None or time < earliest):
            earliest = time
    return earliest
