"""``make proof-mutants``: the proof has to find each seeded fault, and none in the program as it is.

The bridge alone is of the tree with the mutant. It is started anew for each; drives, owners and witnesses
stay. Several machines share the work by making folders in one that all of them have.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from tests.proof.fault import Fault
from tests.proof.faults import FAULTS
from tests.proof.mutants import Mutant, Tree
from tests.proof.rig import NotStopped, Rig, Stuck
from tests.proof.rounds import run_round

Say = Callable[[str], None]

_FIRST_TIMES: Final = 3
"""How often the fault is injected that is tried first: ``make proof`` injects each fault fifty times."""
_MOST_IN_VAIN: Final = 3
_MOST_VOID: Final = 4
"""Rounds in which the machine was in the way, after which one counts as having found nothing."""
PATIENCE_S: Final = 20.0
"""A plant that does not come back sooner is stuck."""
_NONE: Final = "(none)"


@dataclass(frozen=True, slots=True)
class Kill:
    """How a mutant was found: the fault, and the judgement; both empty where it was not."""

    mutant: str
    breaks: str
    fault: str
    judgement: str
    seconds: float
    rounds: int


class Share:
    """What one machine takes no other does."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def take(self, name: str) -> bool:
        try:
            (self._folder / name.replace("/", "_")).mkdir(parents=True)
        except FileExistsError:
            return False
        return True


def order(first: str, faults: Sequence[Fault] = FAULTS) -> Iterator[Fault]:
    """The one that is tried first, several times; then all others."""
    possible = [fault for fault in faults if fault.is_here]
    yield from [fault for fault in possible if fault.name == first] * _FIRST_TIMES
    # What takes a new process comes last.
    rest = [fault for fault in possible if fault.name != first]
    yield from sorted(rest, key=lambda fault: fault.new_process)


def judge(rig: Rig, fault: Fault, say: Say) -> str:
    """What one round of this fault finds; empty where it finds nothing. One in which the machine was in the
    way has found nothing either way, and is made again. What it excuses each time, word by word, is none of
    its doing."""
    excused: list[set[str]] = []
    for _ in range(_MOST_VOID):
        before = len(rig.excused)
        found = _judge_twice(rig, fault, say)
        if found is not None:
            return found
        excused.append(set(rig.excused[before:]))
    return min(set.intersection(*excused), default="")


def _judge_twice(rig: Rig, fault: Fault, say: Say) -> str | None:
    """A plant that does not come back may be the machine's doing: that counts the second time."""
    try:
        return _judge(rig, fault, say)
    except (Stuck, AssertionError) as error:
        say(f"{fault.name}, once more: {error}")
    try:
        rig.mend()
        rig.run_all()
        return _judge(rig, fault, say)
    except (Stuck, AssertionError) as error:
        return str(error).splitlines()[0]


def _judge(rig: Rig, fault: Fault, say: Say) -> str | None:
    """None where nothing could be judged."""
    in_vain = len(rig.stopped_in_vain)
    try:
        samples = run_round(rig, fault, say)
    except NotStopped as error:
        return str(error)
    except ProcessLookupError:
        return "the bridge has ended"
    for sample in samples:
        if sample.verdict == "failed":
            return f"{sample.drive} ({sample.protocol}): {sample.complaint}"
    if len(rig.stopped_in_vain) - in_vain > _MOST_IN_VAIN:
        return f"{len(rig.stopped_in_vain) - in_vain} drives stopped that it does not concern"
    is_void = any(sample.verdict == "void" for sample in samples)
    # Of what is judged by yes or no, a no that the machine may have brought about is left out.
    is_left_out = bool(fault.examine) and len(samples) < len(fault.subjects)
    return None if is_void or is_left_out or not samples else ""


def hunt(rig: Rig, tree: Tree, mutant: Mutant, say: Say) -> Kill:
    """Let the bridge have this fault, and try until it is found."""
    began = time.monotonic()

    def kill(fault: str, judgement: str, rounds: int) -> Kill:
        seconds = time.monotonic() - began
        say(f"{mutant.name}: {judgement or 'SURVIVED'} [{fault}]")
        return Kill(mutant.name, mutant.breaks, fault, judgement, round(seconds, 1), rounds)

    tree.hold(mutant)
    try:
        rig.mend()
        rig.run_all()
    except (Stuck, AssertionError) as error:
        # What does not even start is found by anybody: the mutant is none.
        say(f"{mutant.name} does not come up: {error}")
        return kill("", "", 0)
    rounds = 0
    for rounds, fault in enumerate(order(mutant.first), start=1):
        judgement = judge(rig, fault, say)
        if judgement:
            return kill(fault.name, judgement, rounds)
    return kill("", "", rounds)


def try_unchanged(rig: Rig, share: Share, say: Say) -> list[str]:
    """What is found in the program as it is, by the faults that no other machine tries."""
    alarms: list[str] = []
    for fault in order(_NONE):
        if share.take(f"none, {fault.name}") and (found := judge(rig, fault, say)):
            alarms.append(f"{fault.name}: {found}")
            say(f"FALSE ALARM: {alarms[-1]}")
            # What does not come back has a second chance in the next round.
            with suppress(Stuck, AssertionError):
                rig.mend()
                rig.run_all()
    return alarms
