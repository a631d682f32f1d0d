"""Deadlines of the leg: the end of the owner's time-out or lease, of a ramp, of what comes before a
silence, of a burst."""

from __future__ import annotations

from typing import Final

from bridge.command.leg import owners
from bridge.command.leg.deeds import About, happen
from bridge.command.leg.effect import Ignored
from bridge.command.leg.table import Stimulus
from bridge.command.leg.turn import Turn
from bridge.command.messages.event import Kind
from bridge.command.messages.request import Code, Outcome
from bridge.config import Reaction
from bridge.text import Text

_EXPIRED: Final[dict[Reaction, Stimulus]] = {
    "disable_voltage": Stimulus.EXPIRED_DISABLE,
    "stop": Stimulus.EXPIRED_DISABLE,
    "quick_stop": Stimulus.EXPIRED_QUICK_STOP,
    "silence": Stimulus.EXPIRED_SILENCE,
    "hold": Stimulus.EXPIRED_HOLD,
}


def judge(turn: Turn) -> None:
    """Find out whether the controller is still there."""
    timer = turn.timer
    if timer.deadline is not None and turn.now >= timer.deadline:
        turn.timer = timer._replace(deadline=None, is_overdue=True)
        if turn.settings.ignores_errors:
            turn.effects.append(Ignored())
        elif not turn.is_tripped:
            ends = Outcome(Code.CANCELLED, Text.of("start.watchdog_tripped"))
            happen(turn, _EXPIRED[turn.settings.reaction], About(ends, due=timer.deadline))
    lease_until = turn.owner.lease_until
    if lease_until is not None and turn.now >= lease_until:
        turn.tell(Kind.OWNER, 300, Text.of("owner.lease_ran_out", who=str(turn.owner.identity)))
        owners.leave(turn)


def run_out(turn: Turn) -> None:
    """End what has its time only."""
    now = turn.now
    ramps_until, silent_from, burst_until, _ = turn.trip
    if ramps_until is not None and now >= ramps_until:
        happen(turn, Stimulus.RAMP_OVERDUE)
    if silent_from is not None and now >= silent_from:
        happen(turn, Stimulus.SILENCE_DUE)
    if burst_until is not None and now >= burst_until:
        happen(turn, Stimulus.BURST_OVER)
    if turn.pulse_until is not None and now >= turn.pulse_until:
        turn.pulse_until = None
