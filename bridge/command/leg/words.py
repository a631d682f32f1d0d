"""What goes to the drive: the owner's words, or a stop in their place.

Nothing that enables a drive gets past this while the watchdog has tripped, the restart interlock is set or
the way to the drive is closed. A stop always does.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from bridge.command.leg.state import BLOCKED, REACTING, RESTS, Output, Stage
from bridge.drive import ControlWords, DriveState

if TYPE_CHECKING:
    from bridge.command.leg.settings import LegSettings
    from bridge.command.leg.state import LegState
    from bridge.command.leg.turn import Turn


def at_rest(words: ControlWords, word: int) -> int:
    """``word`` if it is a stop of some kind, else a stop made from it."""
    return words.stop(word) if words.enables(word) else word & ~words.acknowledge_mask


def send(turn: Turn) -> None:
    """Make what the drive gets from now on."""
    stage = turn.stage
    if stage in REACTING:
        turn.sent = _reaction(turn)
    elif stage is not Stage.HELD:
        turn.sent = _owners(turn)


def _reaction(turn: Turn) -> Output:
    settings = turn.settings
    is_ramping = turn.trip.ramps_until is not None
    word = _reaction_word(settings, turn, is_ramping=is_ramping)
    is_silent = turn.stage is Stage.SILENCED
    if is_silent and not turn.silence_stops:
        return Output((settings.words.disable_voltage(word), *turn.rest))
    return Output((word, *turn.rest), is_silent)


def _reaction_word(settings: LegSettings, state: Turn | LegState, *, is_ramping: bool) -> int:
    words, word = settings.words, state.sent.words[0]
    if settings.reaction != "stop" and not is_ramping:
        return words.disable_voltage(word)
    stopped = words.stop(word) if settings.reaction == "stop" else words.quick_stop(word)
    return words.withhold(stopped) if state.motion in RESTS else stopped


def _owners(turn: Turn) -> Output:
    words, word, is_ours = turn.settings.words, turn.word, turn.is_ours
    acknowledge = words.acknowledge_mask
    is_blocked = turn.stage in BLOCKED
    if is_blocked and words.enables(word):
        # The stop that is in force, by whomever: what the owner goes on writing does not weaken it.
        word = at_rest(words, turn.sent.words[0]) | word & acknowledge
        is_ours = True
    if turn.drive is DriveState.FAULT and word & acknowledge:
        # It ends with the fault: what was asked for then would hold the motor after it.
        turn.is_asked = False
    if is_ours and turn.motion in RESTS and not turn.is_asked:
        word = words.withhold(word) | word & acknowledge
    if turn.pulse_until is not None:
        word |= acknowledge
    handshake = turn.settings.handshake
    if handshake is not None and turn.order.is_raised and words.enables(word):
        word |= handshake.mask
    return Output((word, *(turn.rest if is_blocked else turn.setpoints)))


def if_tripped(settings: LegSettings, state: LegState) -> Output | None:
    """What the drive would get if the watchdog tripped now; None where it goes on with what it has."""
    reaction = settings.reaction
    if reaction == "hold":
        return None
    word = _reaction_word(settings, state, is_ramping=reaction == "quick_stop")
    return Output((word, *state.rest), silent=reaction == "silence" and state.silence_stops)


def if_left(settings: LegSettings, state: LegState) -> Output:
    """What the drive would get if its owner went now."""
    return Output((settings.words.stop(state.sent.words[0]), *state.rest))
