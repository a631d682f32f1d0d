"""The deeds of the leg's table: ``happen`` looks the cell up, goes to its stage and does its deed. Nothing
else changes the stage."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final, NamedTuple

from bridge.command.leg import order
from bridge.command.leg.effect import LetGo, StartEnded, Tripped
from bridge.command.leg.forwarded import SENT_BEFORE, Asked, Stop
from bridge.command.leg.state import STARTING, Output, Stage, Start, Trip
from bridge.command.leg.table import TABLE, Deed, Stimulus
from bridge.command.leg.turn import Turn
from bridge.command.leg.words import at_rest
from bridge.command.messages.request import DONE, Code, Outcome
from bridge.command.messages.telegram import Refusal
from bridge.drive import DriveState

BELIEVED_S: Final = 1.0
"""Without a report from a drive that sends only changes, its last one is accepted after this time."""
_PULSE_S: Final = 0.1
"""Length of an acknowledge edge of the bridge's own: longer than any cycle we send with."""
_BURST_S: Final = 0.1
"""Time for which a stop breaks the silence: as long, so that the drive has it for certain; then the drive's
own supervision goes on."""
_RAMP_LIMIT_S: Final = 10.0
"""After that a quick stop by the watchdog is followed by disable voltage in any case: Lenze's holds the motor
for ever, and so does CiA 402's with 605Ah = 5 … 8."""
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


def happen(turn: Turn, stimulus: Stimulus, about: About = _NOTHING) -> None:
    """Go on as the table says. Raises ``Refusal`` where its deed is to refuse."""
    turn.stage, deed = TABLE[turn.stage, stimulus]
    if deed is Deed.NOTHING:
        return
    ends_start = turn.start is not None and turn.stage not in STARTING
    if ends_start:
        turn.effects.append(StartEnded(about.start_ends))
    _DONE_BY[deed](turn, about)
    if ends_start:
        turn.start = None


def start_of(turn: Turn) -> Start:
    """The start that goes on: the deeds of one are in no other cells."""
    assert turn.start is not None
    return turn.start


# what the owner and others ask


def _forward(turn: Turn, about: About) -> None:
    turn.asked = about.asked
    turn.answer(about.done)


def _take(turn: Turn, about: About) -> None:
    turn.answer(Outcome(Code.OK, turn.why_blocked, forwarded=False))


def _refuse(turn: Turn, about: About) -> None:
    assert about.refusal is not None
    raise about.refusal


def _stop_as_asked(turn: Turn, about: About) -> None:
    """A stop by a command, made from the word that is sent. A reaction of the watchdog goes on from it, too:
    after a ramp was begun, somebody may still disable the voltage. Silence is broken for it, once for each
    stop: whoever asks for the same again and again must not keep the drive's own supervision from
    tripping."""
    assert isinstance(about.asked, Stop)
    word = about.asked.of(turn.sent.words[0])
    is_new = word != turn.trip.burst
    turn.stop(word, is_asked=True)
    turn.sent = Output((word, *turn.rest), turn.sent.silent)
    turn.effects.append(LetGo())
    if turn.stage is Stage.BURST and (is_new or turn.trip.burst_until is None):
        turn.trip = turn.trip._replace(burst_until=turn.now + _BURST_S)
    _forward(turn, about)


def _keep_silent(turn: Turn, about: About) -> None:
    turn.answer(Outcome(Code.OK, SENT_BEFORE, forwarded=False))


def _clear(turn: Turn, about: About) -> None:
    turn.trip = Trip()
    if about.pulse:
        turn.pulse_until = turn.now + _PULSE_S


def _clear_and_stop(turn: Turn, about: About) -> None:
    """Stop a drive that would go on after a fault of its own."""
    _clear(turn, about)
    turn.stop(about.word)


# what the bridge does by itself


def _stop(turn: Turn, about: About) -> None:
    turn.stop(turn.settings.words.stop(turn.sent.words[0]))


def _block(turn: Turn, about: About) -> None:
    """The owner's word stays; a position that was ordered is not gone to any more."""
    turn.order = order.dropped(turn.order)


def _react(turn: Turn, about: About) -> None:
    reaction, then_silence_s = turn.settings.reaction, turn.settings.then_silence_s
    turn.drop_setpoints()
    turn.trip = Trip(
        turn.now + _RAMP_LIMIT_S if reaction == "quick_stop" else None,
        turn.now + then_silence_s if then_silence_s and reaction != "silence" else None,
    )
    _hold(turn, about)


def _hold(turn: Turn, about: About) -> None:
    turn.effects.append(Tripped(about.due, turn.owner.identity, turn.timer.timeout_ms))


def _end_ramp(turn: Turn, about: About) -> None:
    turn.trip = turn.trip._replace(ramps_until=None)


def _fall_silent(turn: Turn, about: About) -> None:
    turn.trip = turn.trip._replace(silent_from=None, burst_until=None)


# a start


def _wait(turn: Turn, about: About) -> None:
    """Hold the stop until it is known to be over: to become ready may mean to coast."""
    turn.lead(at_rest(turn.settings.words, turn.sent.words[0]))


def _await_rest(turn: Turn, about: About) -> None:
    turn.start = start_of(turn)._replace(settles_at=None, believed_at=None)


def _make_ready(turn: Turn, about: About) -> None:
    turn.start = start_of(turn)._replace(believed_at=turn.now + BELIEVED_S, leaves_at=None)
    turn.lead(turn.settings.words.ready)


def _begin(turn: Turn, about: About) -> None:
    """Make the drive ready anew: where a stop was on its way, its last report was out of date."""
    turn.lead(turn.settings.words.ready)
    _go_on(turn, about)


def _go_on(turn: Turn, about: About) -> None:
    """The next word for the state that the drive is in."""
    start = start_of(turn)
    turn.start = Start(start.word, start.until)
    if turn.drive in _CAN_BE_ENABLED:
        turn.lead(start.word)
    elif turn.drive is DriveState.SWITCH_ON_INHIBITED:
        turn.lead(turn.settings.words.ready)


def _enable(turn: Turn, about: About) -> None:
    turn.start = start_of(turn)._replace(believed_at=None)
    turn.lead(start_of(turn).word)


def _leave(turn: Turn, about: About) -> None:
    words = turn.settings.words
    turn.lead(words.disable_voltage(words.ready))


def _finish(turn: Turn, about: About) -> None:
    turn.lead(start_of(turn).word | turn.settings.words.begin)


def _give_up(turn: Turn, about: About) -> None:
    turn.stop(at_rest(turn.settings.words, turn.sent.words[0]))


_DONE_BY: Final[Mapping[Deed, Callable[[Turn, About], None]]] = {
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
