"""Whether what a request asks is on the bus: an answer says *forwarded* only where the words that are sent
say so. Pure."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, NamedTuple

from bridge.command.leg.effect import Answer, Effect
from bridge.command.leg.settings import LegSettings
from bridge.command.leg.state import RpdoWords, Way
from bridge.command.messages.request import Code, Outcome
from bridge.text import Said, Text

SILENT: Final = Text.of("request.silent")
SENT_BEFORE: Final = Text.of("request.sent_before")
_KEPT: Final = Text.of("request.setpoints_at_rest")
_REPLACED: Final = Text.of("request.stop_in_force")


class Words(NamedTuple):
    """A control word, None where none is written, and the setpoints that are to go with it."""

    word: int | None
    setpoints: tuple[int, ...]


class StopRule(NamedTuple):
    """A stop, by the function that makes it of a control word: it leaves one as it is that stops as much."""

    of: Callable[[int], int]


class Edge(NamedTuple):
    """An acknowledge bit of the bridge's own."""


Asked = Words | StopRule | Edge


def why_not(settings: LegSettings, asked: Asked, way: Way, sent: RpdoWords) -> Said:
    """Reason why the bus does not say what is asked, where ``sent`` goes this ``way``; empty where it
    does."""
    if way.why_unsent:
        return way.why_unsent
    if sent.silent:
        return SILENT
    words = settings.words
    word, *setpoints = sent.words
    match asked:
        case StopRule(of=of):
            return "" if of(word) == word & ~words.acknowledge_mask else _REPLACED
        case Edge():
            return "" if word & words.acknowledge_mask else _REPLACED
        case Words(word=wanted, setpoints=values):
            if wanted is not None and (wanted ^ word) & ~_free(settings):
                return _REPLACED
            # With a stop they are nothing.
            is_stop = wanted is not None and not words.enables(wanted)
            return "" if is_stop or values == tuple(setpoints) else _KEPT


def _free(settings: LegSettings) -> int:
    """Bits in which a word may differ: an acknowledge bit counts as an edge only, and the bridge itself adds
    the one that hands over a position."""
    return settings.words.acknowledge_mask | (settings.handshake.mask if settings.handshake else 0)


def judged(
    settings: LegSettings, asked: Asked | None, way: Way, sent: RpdoWords, effects: list[Effect]
) -> list[Effect]:
    """``effects`` of a request with its answer as the bus has it."""
    why = "" if asked is None else why_not(settings, asked, way, sent)
    if not why:
        return effects
    return [_not_forwarded(one, why) if isinstance(one, Answer) else one for one in effects]


def _not_forwarded(answer: Answer, why: Said) -> Answer:
    if answer.is_refused or not answer.outcome.forwarded:
        return answer
    done = answer.outcome.said
    if done:
        why = Text.of("request.and_not_sent", done=done, why=why)
    return Answer(Outcome(Code.OK, why, forwarded=False))
