"""Parts of an explored state that need not be remembered: two states that differ in nothing else have the
same future.

Which parts those are depends on the family's words and on the events of the profile. ``test_leg_space`` shows
that nothing comes of them.
"""

from __future__ import annotations

from collections.abc import Collection

from bridge.command.leg.state import BLOCKED, REACTING, RESTS, LegState, Motion
from bridge.command.leg.word_table import at_rest
from bridge.drive import ControlWords, DriveState
from tests.support.leg_seen import Seen
from tests.support.leg_time import State


class Forgetting:
    """``names`` are the events that happen."""

    def __init__(self, words: ControlWords, names: Collection[str]) -> None:
        self._words = words
        self._has_edges = any("acknowledges" in name for name in names)
        self._has_starts = any("start" in name or name == "drive says: enabled" for name in names)

    def __call__(self, leg: LegState, seen: Seen) -> State:
        if not self._has_edges:
            leg, seen = leg._replace(edges=leg.edges._replace(bit=None)), seen._replace(bit=None)
        if not self._has_starts:
            # Only a start asks which enabling word the drive has followed.
            seen = seen._replace(followed=True)
            if leg.motion is Motion.FAULTED:
                leg = leg._replace(motion=Motion.ENDED)
        if not leg.way.is_open and seen.is_heard:
            # It has to be heard anew.
            leg, seen = leg._replace(way=leg.way._replace(is_heard=False)), seen._replace(is_heard=False)
        if leg.drive is not DriveState.OPERATION_ENABLED and seen.is_acknowledged:
            # It says so anew with its next state.
            leg, seen = leg._replace(is_acknowledged=False), seen._replace(is_acknowledged=False)
        return self._words_of(leg), seen

    def _words_of(self, leg: LegState) -> LegState:
        if leg.stage in REACTING:
            # The reaction is made from what is sent, and what follows it from the reaction.
            return leg._replace(word=0, is_ours=True, is_asked=False, setpoints=leg.rest)
        words, (sent, *_) = self._words, leg.sent.words
        stop = at_rest(words, sent)
        word, is_ours = leg.word, leg.is_ours
        if leg.stage in BLOCKED and words.enables(word):
            # The stop that is in force replaces it.
            word, is_ours = stop | word & words.acknowledge_mask, True
        if leg.stage in BLOCKED and is_ours and not leg.is_asked and leg.motion in RESTS:
            # It stands until it is enabled anew.
            word = words.withhold(word) | word & words.acknowledge_mask
        if words.enables(word) or self._holds(word) or self._holds(stop):
            return leg._replace(word=word, is_ours=is_ours)
        return leg._replace(word=word, is_ours=True, is_asked=False)

    def _holds(self, word: int) -> bool:
        """True if the word would hold the motor of a drive that stands: so it matters whose stop it is."""
        word &= ~self._words.acknowledge_mask
        return self._words.withhold(word) != word
