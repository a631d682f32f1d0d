"""Deadlines of the leg: the ends of the owner's time-out or lease, of a ramp, of the time before a silence,
of a burst."""

from __future__ import annotations

from bridge.command.leg import owners
from bridge.command.leg.deeds import About, happen
from bridge.command.leg.draft import Draft
from bridge.command.leg.effect import Ignored
from bridge.command.leg.table import Stimulus
from bridge.command.messages.event import EventKind
from bridge.command.messages.request import Code, Outcome
from bridge.config import ReactionRule
from bridge.text import Text


def expiry(reaction: ReactionRule) -> Stimulus:
    """Event at the end of the time-out where this is the reaction."""
    if reaction.holds:
        return Stimulus.EXPIRED_HOLD
    if reaction.is_silent:
        return Stimulus.EXPIRED_SILENCE
    return Stimulus.EXPIRED_RAMP if reaction.ramp else Stimulus.EXPIRED_STOP


def judge(draft: Draft) -> None:
    """Find out whether the controller is still there."""
    timer = draft.timer
    if timer.deadline is not None and draft.now >= timer.deadline:
        draft.timer = timer._replace(deadline=None, is_overdue=True)
        if draft.settings.ignores_errors:
            draft.effects.append(Ignored())
        elif not draft.is_tripped:
            ends = Outcome(Code.CANCELLED, Text.of("start.watchdog_tripped"))
            happen(draft, expiry(draft.settings.reaction), About(ends, due=timer.deadline))
    lease_until = draft.owner.lease_until
    if lease_until is not None and draft.now >= lease_until:
        draft.tell(EventKind.OWNER, 300, Text.of("owner.lease_ran_out", who=str(draft.owner.identity)))
        owners.leave(draft)


def run_out(draft: Draft) -> None:
    """End a ramp, a burst or an edge whose time is up, and begin a silence that is due."""
    now = draft.now
    ramps_until, silent_from, burst_until, _ = draft.trip
    if ramps_until is not None and now >= ramps_until:
        happen(draft, Stimulus.RAMP_OVERDUE)
    if silent_from is not None and now >= silent_from:
        happen(draft, Stimulus.SILENCE_DUE)
    if burst_until is not None and now >= burst_until:
        happen(draft, Stimulus.BURST_OVER)
    if draft.pulse_until is not None and now >= draft.pulse_until:
        draft.pulse_until = None
