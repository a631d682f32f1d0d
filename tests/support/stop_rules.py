"""Rules that the judge of a drive's stops has to keep, whatever it is told, with what they remember.

They are written from the shared design (watchdog, "Followed or not") and the page ``dead-man-chain.md``, "A
stop that is not followed", and take nothing from the bridge: words are given by their names. Time is counted
in ticks from now, so that what has been is not positive.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

OFF, RAMP, SILENCE = 1, 2, 2
"""Bounds of a word that takes the voltage, of any other stop, and of silence; in ticks."""
LONGEST = max(OFF + RAMP, SILENCE)
"""Words may alternate: each has its bound, but all together no more."""
LATE = 2
"""Ticks by which a deaf drive may be named later, where the judge is asked only when it wants to be."""
FORGOTTEN = -(LONGEST + LATE)
"""Time of what was before: as long ago as anything."""
BOUNDS = {"OFF": OFF, "RAMP": RAMP, "SILENT": SILENCE}


class Memory(NamedTuple):
    """``words`` are those of the stop that have been handed over since the bound has begun at ``since``,
    empty where none is on the bus. ``left_at`` is when the drive last ceased to say that it is enabled."""

    word: str = "OFF"
    is_there: bool = False
    is_cut_off: bool = False
    is_to_send: bool = False
    words: frozenset[str] = frozenset()
    last_word: str = ""
    since: int = -LONGEST
    says: str = "NOTHING"
    left_at: int = -OFF
    stopping_at: int = -RAMP
    """Time at which the drive has come on a ramp, or was told while it was on one, or was heard again."""
    is_deaf: bool = False
    """The drive has said nothing but *enabled* since the bound began, and each tick had its telegram."""
    has_obeyed: bool = False
    """The drive has said anything else since the stop was handed over, or said so then."""
    outcome: str = "NONE"
    has_ignored: bool = False
    """True if it has ignored a stop since a word that enables, and followed none since."""


@dataclass(frozen=True)
class Told:
    """A verdict by its names, ``at`` and ``since`` in ticks from now."""

    outcome: str
    before: str
    since: float
    at: float
    again: bool
    is_cut_off: bool


def tick(memory: Memory, *, is_heard: bool) -> Memory:
    """A tick later; with a telegram that says what the one before it did, or without one."""

    is_deaf = memory.is_deaf and is_heard
    return memory._replace(
        since=max(memory.since - 1, FORGOTTEN if is_deaf else -LONGEST),
        left_at=max(memory.left_at - 1, -OFF),
        stopping_at=max(memory.stopping_at - 1, -RAMP),
        is_deaf=is_deaf,
    )


def sends(memory: Memory, word: str) -> Memory:
    if word == memory.word:
        return memory
    before, memory = memory.word, memory._replace(word=word, is_to_send=memory.is_there)
    if word == "ENABLES":
        return _over(memory)._replace(outcome="NONE", has_ignored=False)
    return memory._replace(outcome="FORWARDED") if before == "ENABLES" else memory


def handed_over(memory: Memory) -> Memory:
    """The stop in force is on the bus."""
    if not memory.is_to_send:
        return memory
    stopping_at = 0 if memory.word == "OFF" else memory.stopping_at
    memory = memory._replace(is_to_send=False, last_word=memory.word, stopping_at=stopping_at)
    if memory.words:
        return memory._replace(words=memory.words | {memory.word})
    return memory._replace(
        words=frozenset({memory.word}),
        since=0,
        is_deaf=memory.says == "ENABLED",
        has_obeyed=memory.says not in ("ENABLED", "NOTHING"),
    )


def node(memory: Memory, *, is_there: bool) -> Memory:
    memory = memory._replace(is_there=is_there)
    if memory.is_cut_off and not is_there:
        return memory
    memory = _over(memory)._replace(says="NOTHING")
    if not is_there or memory.word == "ENABLES":
        return memory
    return memory._replace(outcome="FORWARDED", is_to_send=True)


def restarted(memory: Memory) -> Memory:
    """The node has started anew: what it was told before is over."""
    return _over(memory)._replace(says="NOTHING", is_there=False) if memory.is_cut_off else memory


def paused(memory: Memory) -> Memory:
    if not memory.words:
        return memory
    kept = frozenset({memory.last_word})
    return memory._replace(since=0, stopping_at=0, words=kept, is_deaf=memory.says == "ENABLED")


def says(memory: Memory, word: str) -> Memory:
    if word == "STOPPING" and memory.says != word:
        memory = memory._replace(stopping_at=0)
    if memory.says == "ENABLED" and word != "ENABLED":
        memory = memory._replace(left_at=0)
    has_obeyed = memory.has_obeyed or word not in ("ENABLED", "NOTHING")
    is_deaf = memory.is_deaf and word == "ENABLED"
    return memory._replace(says=word, has_obeyed=has_obeyed, is_deaf=is_deaf)


def _over(memory: Memory) -> Memory:
    return memory._replace(
        words=frozenset(),
        last_word="",
        since=-LONGEST,
        is_deaf=False,
        has_obeyed=False,
        is_cut_off=False,
        is_to_send=False,
    )


def check_told(memory: Memory, told: Told) -> Memory:
    """A verdict may be given now; gives what is remembered of it."""
    assert memory.words, "nothing is judged before it is on the bus"
    assert told.before == memory.outcome
    assert told.again == memory.has_ignored
    assert told.is_cut_off == memory.is_cut_off
    if told.outcome == "IGNORED":
        _check_ignored(memory, told)
    else:
        _check_followed(memory, told)
    return memory._replace(outcome=told.outcome, has_ignored=told.outcome == "IGNORED")


def _check_ignored(memory: Memory, told: Told) -> None:
    assert told.outcome == "IGNORED" and memory.outcome in ("FORWARDED", "FOLLOWED")
    if memory.is_cut_off:
        assert told.at <= 0
        return
    assert told.at >= memory.since + OFF, "no bound is shorter"
    if memory.says == "HOLDING":
        assert "OFF" in memory.words, "who may hold does nothing wrong"
    elif memory.says == "STOPPING":
        assert "OFF" in memory.words and told.at >= memory.stopping_at + RAMP
    else:
        assert memory.says == "ENABLED", f"nobody ignores a stop by saying {memory.says}"
    if not memory.has_obeyed:
        assert told.at >= memory.since + min(BOUNDS[word] for word in memory.words)


def _check_followed(memory: Memory, told: Told) -> None:
    assert told.outcome == "FOLLOWED" and memory.outcome in ("FORWARDED", "IGNORED")
    assert memory.says not in ("ENABLED", "NOTHING")
    if memory.says == "HOLDING":
        assert memory.last_word != "OFF"
    if memory.outcome == "IGNORED" and not memory.is_cut_off:
        assert memory.left_at <= -OFF, "not at once: another master's words and ours may alternate"


def check_state(memory: Memory, outcome: str, *, follows: bool, is_judged: bool) -> None:
    """Check that what is published fits what is remembered."""
    assert outcome == memory.outcome
    assert follows != memory.has_ignored
    assert is_judged == bool(memory.words and memory.is_there)


def check_looked(memory: Memory, late: int = 0) -> None:
    """The bus has been drained, and the judge has been asked as late as it may be."""
    if memory.is_deaf and memory.since <= -LONGEST - late and memory.is_there:
        assert memory.outcome == "IGNORED", "a drive that is deaf is named"
