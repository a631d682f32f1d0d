"""Words that the drive gets: a table of the leg's stage and of the drive's motion.

It stands beside the table of what happens, and ``docs/reference/decision-tables.md`` has both printed.
Nothing that enables a drive gets past it while the watchdog has tripped, the restart interlock is set or the
way to the drive is closed. A stop always does.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from enum import StrEnum
from typing import Final, NamedTuple

from bridge.command.leg.draft import Draft
from bridge.command.leg.state import STARTING, LegState, Motion, RpdoWords, Stage
from bridge.config import StopKind
from bridge.drive import ControlWords

_S = Stage


class WordChoice(StrEnum):
    __hash__ = str.__hash__  # as that of Stage

    WRITTEN = "the owner's word, or the next of a start"
    IN_FORCE = "the owner's word if it stops, else the stop in force; setpoints at rest"
    REACTION = "the reaction's stop"
    BURST = (
        "the stop that was asked for, and no less than the reaction's; "
        "disable voltage where silence would not stop the drive"
    )
    SILENCE = "nothing; disable voltage where that would not stop the drive"
    BEFORE = "what was sent before the trip"


class WordRule(NamedTuple):
    """``may_hold``: a stop by the bridge may be one that holds the motor, as Lenze's quick stop does. One
    that somebody has asked for always may; disable voltage never does."""

    word: WordChoice
    may_hold: bool


_STOPS: Final[Mapping[StopKind, Callable[[ControlWords, int], int]]] = {
    StopKind.STOP: ControlWords.stop,
    StopKind.QUICK_STOP: ControlWords.quick_stop,
    StopKind.DISABLE_VOLTAGE: ControlWords.disable_voltage,
}

MAY_HOLD: Final = {Motion.EXPECTED: True, Motion.SEEN: True, Motion.ENDED: False, Motion.FAULTED: False}
"""A drive that stands must not come under current by a stop."""

_ROWS: Final[Mapping[Iterable[Stage], WordChoice]] = {
    (_S.CLOSED, _S.INTERLOCKED, _S.LET_GO): WordChoice.IN_FORCE,
    (_S.READY, _S.ENABLED, *STARTING): WordChoice.WRITTEN,
    (_S.RAMPING, _S.TRIPPED): WordChoice.REACTION,
    (_S.SILENCED,): WordChoice.SILENCE,
    (_S.BURST,): WordChoice.BURST,
    (_S.HELD,): WordChoice.BEFORE,
}

WORD_TABLE: Final[dict[tuple[Stage, Motion], WordRule]] = {
    (stage, motion): WordRule(word, word is WordChoice.BEFORE or MAY_HOLD[motion])
    for stages, word in _ROWS.items()
    for stage in stages
    for motion in Motion
}


def send(draft: Draft) -> None:
    """Make the words that the drive gets from now on."""
    word, may_hold = WORD_TABLE[draft.stage, draft.motion]
    draft.sent = _MADE[word](draft, may_hold)


def at_rest(words: ControlWords, word: int) -> int:
    """``word`` if it is a stop of some kind, else a stop made from it: an acknowledge turns no ramp into
    coasting."""
    return words.stop(word) if words.enables(word) else word & ~words.acknowledge_mask


def control_word(words: ControlWords, state: Draft | LegState) -> int:
    """The owner's control word, or what was led or stopped with since; the acknowledge bit is always as the
    owner wrote it, so that whoever changes a bit beside it makes no edge of it."""
    return state.word | (words.acknowledge_mask if state.edges.bit else 0)


def _written(draft: Draft, may_hold: bool) -> RpdoWords:
    may_hold = may_hold or draft.is_asked or not draft.is_ours
    return RpdoWords((_marked(draft, draft.word, may_hold), *draft.setpoints))


def _in_force(draft: Draft, may_hold: bool) -> RpdoWords:
    """The owner's later words do not weaken the stop in force, by whomever that is."""
    words, word, is_ours = draft.settings.words, draft.word, draft.is_ours
    if words.enables(word):
        word = at_rest(words, draft.sent.words[0]) | word & words.acknowledge_mask
        is_ours = True
    may_hold = may_hold or draft.is_asked or not is_ours
    return RpdoWords((_marked(draft, word, may_hold), *draft.rest))


def _marked(draft: Draft, word: int, may_hold: bool) -> int:
    """``word`` with the bits that the bridge adds: an acknowledge pulse, and the one that hands over a
    position."""
    words, handshake = draft.settings.words, draft.settings.handshake
    acknowledge = words.acknowledge_mask
    if not may_hold:
        word = words.withhold(word) | word & acknowledge
    if draft.pulse_until is not None:
        word |= acknowledge
    if handshake is not None and draft.order.is_raised and words.enables(word):
        word |= handshake.mask
    return word


def _reaction_word(draft: Draft, may_hold: bool) -> int:
    words = draft.settings.words
    reaction = draft.settings.reaction
    kind = reaction.stop if draft.trip.ramps_until is None else reaction.first
    word = _STOPS[kind](words, draft.sent.words[0])
    return word if may_hold or kind is StopKind.DISABLE_VOLTAGE else words.withhold(word)


def _reaction(draft: Draft, may_hold: bool) -> RpdoWords:
    return RpdoWords((_reaction_word(draft, may_hold), *draft.rest))


def _burst(draft: Draft, may_hold: bool) -> RpdoWords:
    word = _reaction_word(draft, may_hold)
    return RpdoWords(
        (word if draft.silence_stops else draft.settings.words.disable_voltage(word), *draft.rest)
    )


def _silence(draft: Draft, may_hold: bool) -> RpdoWords:
    return _burst(draft, may_hold)._replace(silent=draft.silence_stops)


def _before(draft: Draft, may_hold: bool) -> RpdoWords:
    return draft.sent


_MADE: Final[dict[WordChoice, Callable[[Draft, bool], RpdoWords]]] = {
    WordChoice.WRITTEN: _written,
    WordChoice.IN_FORCE: _in_force,
    WordChoice.REACTION: _reaction,
    WordChoice.BURST: _burst,
    WordChoice.SILENCE: _silence,
    WordChoice.BEFORE: _before,
}
