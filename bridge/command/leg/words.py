"""Words that the drive gets: a table of the leg's stage and of the drive's motion.

It stands beside the table of what happens, and ``docs/reference/decision-tables.md`` has both printed.
Nothing that enables a drive gets past it while the watchdog has tripped, the restart interlock is set or the
way to the drive is closed. A stop always does.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from enum import StrEnum
from typing import Final, NamedTuple

from bridge.command.leg.state import STARTING, LegState, Motion, Output, Stage
from bridge.command.leg.turn import Turn
from bridge.config import Reaction
from bridge.drive import ControlWords

_S = Stage


class Word(StrEnum):
    __hash__ = str.__hash__  # as that of Stage

    WRITTEN = "the owner's word, or the next of a start"
    IN_FORCE = "the owner's word if it stops, else the stop in force; setpoints at rest"
    REACTION = "the reaction's stop"
    BURST = "the stop that was asked for, and no less than the reaction's"
    SILENCE = "nothing; disable voltage where that would not stop the drive"
    BEFORE = "what was sent before the trip"


class Sends(NamedTuple):
    """``may_hold``: a stop by the bridge may be one that holds the motor, as Lenze's quick stop does. One
    that somebody has asked for always may; disable voltage never does."""

    word: Word
    may_hold: bool


class StopKind(StrEnum):
    STOP = "stop"
    QUICK_STOP = "quick stop"
    DISABLE_VOLTAGE = "disable voltage"


REACTION_STOPS: Final[Mapping[Reaction, tuple[StopKind, StopKind]]] = {
    "disable_voltage": (StopKind.DISABLE_VOLTAGE, StopKind.DISABLE_VOLTAGE),
    "quick_stop": (StopKind.QUICK_STOP, StopKind.DISABLE_VOLTAGE),
    "stop": (StopKind.STOP, StopKind.STOP),
    "silence": (StopKind.STOP, StopKind.STOP),
    "hold": (StopKind.STOP, StopKind.STOP),
}
"""The stop of each reaction while its ramp goes on, and after that."""
_STOPS: Final[Mapping[StopKind, Callable[[ControlWords, int], int]]] = {
    StopKind.STOP: ControlWords.stop,
    StopKind.QUICK_STOP: ControlWords.quick_stop,
    StopKind.DISABLE_VOLTAGE: ControlWords.disable_voltage,
}

MAY_HOLD: Final = {Motion.EXPECTED: True, Motion.SEEN: True, Motion.ENDED: False, Motion.FAULTED: False}
"""A drive that stands must not come under current by a stop."""

_ROWS: Final[Mapping[Iterable[Stage], Word]] = {
    (_S.CLOSED, _S.INTERLOCKED, _S.LET_GO): Word.IN_FORCE,
    (_S.READY, _S.ENABLED, *STARTING): Word.WRITTEN,
    (_S.RAMPING, _S.TRIPPED): Word.REACTION,
    (_S.SILENCED,): Word.SILENCE,
    (_S.BURST,): Word.BURST,
    (_S.HELD,): Word.BEFORE,
}

WORD_TABLE: Final[dict[tuple[Stage, Motion], Sends]] = {
    (stage, motion): Sends(word, word is Word.BEFORE or MAY_HOLD[motion])
    for stages, word in _ROWS.items()
    for stage in stages
    for motion in Motion
}


def send(turn: Turn) -> None:
    """Make the words that the drive gets from now on."""
    word, may_hold = WORD_TABLE[turn.stage, turn.motion]
    turn.sent = _MADE[word](turn, may_hold)


def at_rest(words: ControlWords, word: int) -> int:
    """``word`` if it is a stop of some kind, else a stop made from it: an acknowledge turns no ramp into
    coasting."""
    return words.stop(word) if words.enables(word) else word & ~words.acknowledge_mask


def control_word(words: ControlWords, state: Turn | LegState) -> int:
    """The owner's control word, or what was led or stopped with since; the acknowledge bit is always as the
    owner wrote it, so that whoever changes a bit beside it makes no edge of it."""
    return state.word | (words.acknowledge_mask if state.edges.bit else 0)


def _written(turn: Turn, may_hold: bool) -> Output:
    may_hold = may_hold or turn.is_asked or not turn.is_ours
    return Output((_marked(turn, turn.word, may_hold), *turn.setpoints))


def _in_force(turn: Turn, may_hold: bool) -> Output:
    """The owner's later words do not weaken the stop in force, by whomever that is."""
    words, word, is_ours = turn.settings.words, turn.word, turn.is_ours
    if words.enables(word):
        word = at_rest(words, turn.sent.words[0]) | word & words.acknowledge_mask
        is_ours = True
    may_hold = may_hold or turn.is_asked or not is_ours
    return Output((_marked(turn, word, may_hold), *turn.rest))


def _marked(turn: Turn, word: int, may_hold: bool) -> int:
    """``word`` with the bits that the bridge adds: an acknowledge pulse, and the one that hands over a
    position."""
    words, handshake = turn.settings.words, turn.settings.handshake
    acknowledge = words.acknowledge_mask
    if not may_hold:
        word = words.withhold(word) | word & acknowledge
    if turn.pulse_until is not None:
        word |= acknowledge
    if handshake is not None and turn.order.is_raised and words.enables(word):
        word |= handshake.mask
    return word


def _reaction_word(turn: Turn, may_hold: bool) -> int:
    words = turn.settings.words
    ramps, afterwards = REACTION_STOPS[turn.settings.reaction]
    kind = afterwards if turn.trip.ramps_until is None else ramps
    word = _STOPS[kind](words, turn.sent.words[0])
    return word if may_hold or kind is StopKind.DISABLE_VOLTAGE else words.withhold(word)


def _reaction(turn: Turn, may_hold: bool) -> Output:
    return Output((_reaction_word(turn, may_hold), *turn.rest))


def _burst(turn: Turn, may_hold: bool) -> Output:
    word = _reaction_word(turn, may_hold)
    return Output((word if turn.silence_stops else turn.settings.words.disable_voltage(word), *turn.rest))


def _silence(turn: Turn, may_hold: bool) -> Output:
    return _burst(turn, may_hold)._replace(silent=turn.silence_stops)


def _before(turn: Turn, may_hold: bool) -> Output:
    return turn.sent


_MADE: Final[dict[Word, Callable[[Turn, bool], Output]]] = {
    Word.WRITTEN: _written,
    Word.IN_FORCE: _in_force,
    Word.REACTION: _reaction,
    Word.BURST: _burst,
    Word.SILENCE: _silence,
    Word.BEFORE: _before,
}
