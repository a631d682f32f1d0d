"""Effects that each deed of the leg's table has to have: that the table says what is done."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

from bridge.command import Code, Request, Write
from bridge.command.leg.effect import Answer, Effect, StartEnded, Tripped
from bridge.command.leg.event import Event
from bridge.command.leg.state import LegState, Stage
from bridge.command.leg.table import Deed


@dataclass(frozen=True, slots=True)
class Done:
    """A step after its last deed. ``enables``: what is sent does."""

    event: Event
    stage: Stage
    """Stage in which it was asked for."""
    after: LegState
    effects: Sequence[Effect]
    enables: bool

    def answers(self, *, forwarded: bool) -> bool:
        """A telegram was answered so."""
        is_write = isinstance(self.event, Request) and isinstance(self.event.command, Write)
        return is_write and any(
            isinstance(effect, Answer) and not effect.is_refused and effect.outcome.forwarded is forwarded
            for effect in self.effects
        )

    @property
    def is_refused(self) -> bool:
        return any(isinstance(effect, Answer) and effect.is_refused for effect in self.effects)

    @property
    def is_kept(self) -> bool:
        """True if it was taken, and nothing is sent for it."""
        return any(isinstance(effect, Answer) and not effect.outcome.forwarded for effect in self.effects)

    @property
    def is_done(self) -> bool:
        return any(
            isinstance(effect, StartEnded) and effect.outcome.code is Code.OK for effect in self.effects
        )

    @property
    def has_failed(self) -> bool:
        return any(
            isinstance(effect, StartEnded) and effect.outcome.code in (Code.TIMED_OUT, Code.NOT_READY)
            for effect in self.effects
        )

    @property
    def has_tripped(self) -> bool:
        return any(isinstance(effect, Tripped) for effect in self.effects)

    @property
    def waits(self) -> bool:
        return self.after.start is not None and not self.enables


def _is_stopped(done: Done) -> bool:
    return not done.enables and done.after.start is None


def _clears(done: Done) -> bool:
    return done.after.stage is done.stage and any(isinstance(effect, Answer) for effect in done.effects)


def _goes_on(done: Done) -> bool:
    return done.after.start is not None and not done.is_done


HOLDS: Final[dict[Deed, Callable[[Done], bool]]] = {
    Deed.NOTHING: lambda done: True,
    # What it is told as is the oracle's business.
    Deed.FORWARD: lambda done: done.answers(forwarded=True) or done.answers(forwarded=False),
    Deed.TAKE: lambda done: done.answers(forwarded=False),
    Deed.REFUSE: lambda done: done.is_refused,
    Deed.STOP: _is_stopped,
    Deed.STOP_AS_ASKED: _is_stopped,
    Deed.BLOCK: _is_stopped,
    Deed.CLEAR: _clears,
    Deed.CLEAR_STOP: lambda done: not done.enables and any(isinstance(one, Answer) for one in done.effects),
    Deed.REACT: lambda done: done.has_tripped and not done.enables,
    Deed.HOLD: lambda done: done.has_tripped,
    Deed.END_RAMP: lambda done: done.after.trip.ramps_until is None and not done.enables,
    Deed.SILENCE: lambda done: done.after.sent.silent or not done.after.silence_stops,
    Deed.KEEP_SILENT: lambda done: done.after.sent.silent and done.is_kept,
    Deed.WAIT: lambda done: done.waits,
    Deed.AWAIT_REST: lambda done: done.waits,
    Deed.READY: lambda done: done.waits,
    Deed.BEGIN: _goes_on,
    Deed.GO_ON: _goes_on,
    Deed.ENABLE: lambda done: done.enables and done.after.start is not None,
    Deed.LEAVE: lambda done: done.waits,
    Deed.DONE: lambda done: done.is_done and done.enables,
    Deed.GIVE_UP: lambda done: done.has_failed and not done.enables,
}
