"""One run: some protocols at a time are thrown at, while the judge looks on."""

from __future__ import annotations

import os
import re
import shutil
import threading
import time
import traceback
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from random import Random
from typing import Final

from tests.fuzz.case import Case, write_cases
from tests.fuzz.judge import Figures, Judge
from tests.fuzz.rig import Rig
from tests.fuzz.targets import Target, make_target
from tests.support.process import REPOSITORY

BUILD: Final = REPOSITORY / "build" / "fuzz"
_KEPT: Final = 400
"""Cases of each protocol that a reproducer has: the last ones before the failure was seen."""
_LOOK_S: Final = 1.0
_END_S: Final = 45.0
_AFTER_S: Final = 2.0
"""Time in seconds to look on after the last throw."""


@dataclass(slots=True)
class Report:
    """Result of a run. ``faults`` is empty where the bridge has borne it."""

    seed: int
    seconds: float
    thrown: dict[str, int]
    faults: list[str]
    figures: Figures
    kept: list[Path] = field(default_factory=list[Path])

    def told(self) -> str:
        lines = [f"{protocol}: {count} cases, seed {self.seed}" for protocol, count in self.thrown.items()]
        lines += self.figures.told()
        for fault in self.faults[:30]:
            lines.append(f"FAULT: {fault}")
        for path in self.kept:
            shown = os.path.relpath(path, REPOSITORY)
            lines.append(f"the last cases are kept: {shown}")
            if path.suffix == ".jsonl":
                protocol = path.name.partition("-")[0]
                lines.append(f"  throw them again: make fuzz PROTOCOL={protocol} REPLAY={shown}")
                lines.append(f"  the whole run again: make fuzz PROTOCOL={protocol} SEED={self.seed}")
        return "\n".join(lines)


class Hand:
    """Throws at one protocol from a thread of its own, until told to stop, or it has thrown all ``cases``, or
    so many as ``most``."""

    def __init__(
        self, protocol: str, target: Target, cases: Sequence[Case] | None = None, most: int | None = None
    ) -> None:
        self.protocol = protocol
        self.thrown = 0
        self._most = most
        self.last: deque[Case] = deque(maxlen=_KEPT)
        self.fault = ""
        self._target = target
        self._left = None if cases is None else deque(cases)
        self._stopped = threading.Event()
        self._thread = threading.Thread(target=self._work, name=f"fuzz-{protocol}", daemon=True)

    def start(self) -> None:
        self._thread.start()

    @property
    def has_ended(self) -> bool:
        return not self._thread.is_alive()

    def stop(self) -> None:
        self._stopped.set()
        self._thread.join(_END_S)
        if self._thread.is_alive():
            self.fault = self.fault or f"the fuzzer of {self.protocol} does not end"

    def _work(self) -> None:
        try:
            while not self._stopped.is_set():
                if self.thrown == self._most or (self._left is not None and not self._left):
                    return
                case = self._target.case() if self._left is None else self._left.popleft()
                self.last.append(case)
                self.thrown += 1
                self._target.throw(case)
        except BaseException:  # noqa: BLE001 - a fuzzer that has ended throws nothing: that is told
            self.fault = f"the fuzzer of {self.protocol} has failed: {traceback.format_exc()}"
        finally:
            self._target.close()


def fuzz(
    rig: Rig,
    protocols: Sequence[str],
    seconds: float,
    seed: int,
    replay: Sequence[Case] | None = None,
    known: str = "",
    most: Mapping[str, int] | None = None,
) -> Report:
    """Throw for so long, or until ``most`` cases of each protocol are thrown, or something is wrong.
    ``replay`` is thrown instead of new cases; faults in which ``known``, a regular expression, is found are
    let pass."""
    judge = Judge(rig)
    hands = [
        Hand(
            protocol,
            make_target(protocol, rig, Random(f"{seed}/{protocol}")),
            replay,
            None if most is None else most[protocol],
        )
        for protocol in protocols
    ]
    begin = time.monotonic()
    faults: list[str] = []

    def unknown(found: list[str]) -> list[str]:
        return [fault for fault in found if not (known and re.search(known, fault))]

    for hand in hands:
        hand.start()
    while time.monotonic() - begin < seconds and not faults and not all(hand.has_ended for hand in hands):
        time.sleep(_LOOK_S)
        faults += unknown(judge.look())
        faults += [hand.fault for hand in hands if hand.fault]
    for hand in hands:
        hand.stop()
    if not faults:
        faults += [hand.fault for hand in hands if hand.fault]
        time.sleep(_AFTER_S)
        faults += unknown(judge.conclude())
    took_s = time.monotonic() - begin
    report = Report(seed, took_s, {hand.protocol: hand.thrown for hand in hands}, faults, judge.figures)
    if faults and replay is None:
        report.kept = keep(rig, hands, seed)
    return report


def keep(rig: Rig, hands: Sequence[Hand], seed: int) -> list[Path]:
    """The last cases of each hand, and the bridge's log, in ``build/fuzz``."""
    BUILD.mkdir(parents=True, exist_ok=True)
    kept: list[Path] = []
    for hand in hands:
        path = BUILD / f"{hand.protocol}-{seed}.jsonl"
        write_cases(path, hand.last)
        kept.append(path)
    log = BUILD / f"{'-'.join(hand.protocol for hand in hands)}-{seed}.log"
    shutil.copyfile(rig.process.log, log)
    return [*kept, log]
