"""The deeds of the leg's table: ``happen`` looks the cell up, goes to its stage and does its deed. Nothing
else changes the stage."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final, NamedTuple

from bridge.command.leg import order
from bridge.command.leg.draft import Draft
from bridge.command.leg.effect import LetGo, StartEnded, Tripped
from bridge.command.leg.forwarded import SENT_BEFORE, Asked, StopRule
from bridge.command.leg.state import STARTING, RpdoWords, Stage, StartProgress, Trip
from bridge.command.leg.table import TABLE, Deed, Stimulus
from bridge.command.leg.word_table import at_rest
from bridge.command.messages.request import DONE, Code, Outcome
from bridge.command.messages.telegram import Refusal
from bridge.drive import DriveState

BELIEVED_S: Final = 1.0
"""Time in seconds after which the last report of a drive that sends only changes is accepted."""
_PULSE_S: Final = 0.1
"""Length of an acknowledge edge of the bridge's own: longer than any cycle we send with."""
_BURST_S: Final = 0.1
"""Time for which a stop breaks the silence: as long, so that the drive has it for certain; then the drive's
own supervision goes on."""
_RAMP_LIMIT_S: Final = 10.0
"""Longest duration of a reaction's ramp, whatever the drive does: Lenze's quick stop holds the motor for
ever, and so does CiA 402's with 605Ah = 5 … 8."""
_CAN_BE_ENABLED: Final = (DriveState.READY, DriveState.SWITCHED_ON, DriveState.OPERATION_ENABLED)
_CANCELLED: Final = Outcome(Code.CANCELLED)


class About(NamedTuple):
    """Facts of an event that its deed needs beside the leg's state."""

    start_ends: Outcome = _CANCELLED
    """The outcome of a start that ends by this."""
    asked: Asked | None = None
    """Words, stop or edge that a request asks for."""
    done: Outcome = DONE
    """Its answer where that is done."""
    refusal: Refusal | None = None
    """The reason why it cannot be done."""
    word: int = 0
    """The stop that an acknowledge leaves behind."""
    pulse: bool = False
    """The acknowledge is sent to the drive by the bridge, not with the owner's word."""
    due: float = 0.0
    """The time at which the time-out was over."""


_NOTHING: Final = About()


def happen(draft: Draft, stimulus: Stimulus, about: About = _NOTHING) -> None:
    """Go on as the table says. Raises ``Refusal`` where its deed is to refuse."""
    draft.stage, deed = TABLE[draft.stage, stimulus]
    if deed is Deed.NOTHING:
        return
    ends_start = draft.start is not None and draft.stage not in STARTING
    if ends_start:
        draft.effects.append(StartEnded(about.start_ends))
    _DONE_BY[deed](draft, about)
    if ends_start:
        draft.start = None


def start_of(draft: Draft) -> StartProgress:
    """The start that goes on: the deeds of one are in no other cells."""
    assert draft.start is not None
    return draft.start


# what the owner and others ask


def _forward(draft: Draft, about: About) -> None:
    draft.asked = about.asked
    draft.answer(about.done)


def _take(draft: Draft, about: About) -> None:
    draft.answer(Outcome(Code.OK, draft.why_blocked, forwarded=False))


def _refuse(draft: Draft, about: About) -> None:
    assert about.refusal is not None
    raise about.refusal


def _stop_as_asked(draft: Draft, about: About) -> None:
    """Stop by a command, with a word made from the one that is sent. A reaction of the watchdog goes on from
    it, too: after a ramp was begun, somebody may still disable the voltage. Silence is broken for it, once
    for each stop: whoever asks for the same again and again must not keep the drive's own supervision from
    tripping."""
    assert isinstance(about.asked, StopRule)
    word = about.asked.of(draft.sent.words[0])
    is_new = word != draft.trip.burst
    draft.stop(word, is_asked=True)
    draft.sent = RpdoWords((word, *draft.rest), draft.sent.silent)
    draft.effects.append(LetGo())
    if draft.stage is Stage.BURST and (is_new or draft.trip.burst_until is None):
        draft.trip = draft.trip._replace(burst_until=draft.now + _BURST_S)
    _forward(draft, about)


def _keep_silent(draft: Draft, about: About) -> None:
    draft.answer(Outcome(Code.OK, SENT_BEFORE, forwarded=False))


def _clear(draft: Draft, about: About) -> None:
    draft.trip = Trip()
    if about.pulse:
        draft.pulse_until = draft.now + _PULSE_S


def _clear_and_stop(draft: Draft, about: About) -> None:
    """Stop a drive that would go on after a fault of its own."""
    _clear(draft, about)
    draft.stop(about.word)


# what the bridge does by itself


def _stop(draft: Draft, about: About) -> None:
    draft.stop(draft.settings.words.stop(draft.sent.words[0]))


def _block(draft: Draft, about: About) -> None:
    """Keep the owner's word; a position that was ordered is not gone to any more."""
    draft.order = order.dropped(draft.order)


def _react(draft: Draft, about: About) -> None:
    reaction, then_silence_s = draft.settings.reaction, draft.settings.then_silence_s
    draft.drop_setpoints()
    draft.trip = Trip(
        draft.now + _RAMP_LIMIT_S if reaction.ramp else None,
        draft.now + then_silence_s if then_silence_s and not reaction.is_silent else None,
    )
    _hold(draft, about)


def _hold(draft: Draft, about: About) -> None:
    draft.effects.append(Tripped(about.due, draft.owner.identity, draft.timer.timeout_ms))


def _end_ramp(draft: Draft, about: About) -> None:
    draft.trip = draft.trip._replace(ramps_until=None)


def _fall_silent(draft: Draft, about: About) -> None:
    draft.trip = draft.trip._replace(silent_from=None, burst_until=None)


# a start


def _wait(draft: Draft, about: About) -> None:
    """Hold the stop until it is known to be over: to become ready may mean to coast."""
    draft.lead(at_rest(draft.settings.words, draft.sent.words[0]))


def _await_rest(draft: Draft, about: About) -> None:
    draft.start = start_of(draft)._replace(settles_at=None, believed_at=None)


def _make_ready(draft: Draft, about: About) -> None:
    draft.start = start_of(draft)._replace(believed_at=draft.now + BELIEVED_S, leaves_at=None)
    draft.lead(draft.settings.words.ready)


def _begin(draft: Draft, about: About) -> None:
    """Make the drive ready anew: where a stop was on its way, its last report was out of date."""
    draft.lead(draft.settings.words.ready)
    _go_on(draft, about)


def _go_on(draft: Draft, about: About) -> None:
    """The next word for the state that the drive is in."""
    start = start_of(draft)
    draft.start = StartProgress(start.word, start.until)
    if draft.drive in _CAN_BE_ENABLED:
        draft.lead(start.word)
    elif draft.drive is DriveState.SWITCH_ON_INHIBITED:
        draft.lead(draft.settings.words.ready)


def _enable(draft: Draft, about: About) -> None:
    draft.start = start_of(draft)._replace(believed_at=None)
    draft.lead(start_of(draft).word)


def _leave(draft: Draft, about: About) -> None:
    words = draft.settings.words
    draft.lead(words.disable_voltage(words.ready))


def _finish(draft: Draft, about: About) -> None:
    draft.lead(start_of(draft).word | draft.settings.words.begin)


def _give_up(draft: Draft, about: About) -> None:
    draft.stop(at_rest(draft.settings.words, draft.sent.words[0]))


_DONE_BY: Final[Mapping[Deed, Callable[[Draft, About], None]]] = {
    Deed.FORWARD: _forward,
    Deed.TAKE: _take,
    Deed.REFUSE: _refuse,
    Deed.STOP_AS_ASKED: _stop_as_asked,
    Deed.KEEP_SILENT: _keep_silent,
    Deed.CLEAR: _clear,
    Deed.CLEAR_STOP: _clear_and_stop,
    Deed.STOP: _stop,
    Deed.BLOCK: _block,
    Deed.REACT: _react,
    Deed.HOLD: _hold,
    Deed.END_RAMP: _end_ramp,
    Deed.SILENCE: _fall_silent,
    Deed.WAIT: _wait,
    Deed.AWAIT_REST: _await_rest,
    Deed.READY: _make_ready,
    Deed.BEGIN: _begin,
    Deed.GO_ON: _go_on,
    Deed.ENABLE: _enable,
    Deed.LEAVE: _leave,
    Deed.DONE: _finish,
    Deed.GIVE_UP: _give_up,
}
