"""What others may see of a leg: its watchdog, and what it will send by itself, and when."""

from __future__ import annotations

from bridge.command.leg import start, turn
from bridge.command.leg.settings import LegSettings
from bridge.command.leg.state import LegState, Output, WatchdogState


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
    return (_if_tripped(settings, state) if is_trip else None) or _if_left(settings, state)


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


def _if_tripped(settings: LegSettings, state: LegState) -> Output | None:
    """What the drive would get if the watchdog tripped now; None where it goes on with what it has."""
    reaction = settings.reaction
    if reaction == "hold":
        return None
    word = turn.reaction_word(settings, state, is_ramping=reaction == "quick_stop")
    return Output((word, *state.rest), silent=reaction == "silence" and state.silence_stops)


def _if_left(settings: LegSettings, state: LegState) -> Output:
    """What the drive would get if its owner went now."""
    return Output((settings.words.stop(state.sent.words[0]), *state.rest))
