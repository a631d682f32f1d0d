"""Judgement of a recorded trace by the site file: the witness's, and silences. Sans-IO."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from math import inf

from bridge.bustools.silence_watch import Bound, SilenceWatch
from bridge.canopen.frame import Frame
from bridge.cli.finding_text import times_of
from bridge.witness.bus_judge import BusJudge
from bridge.witness.findings import Alarm, Finding, Stop
from bridge.witness.plan import WatchedBus

_TICK_S = 0.05
"""Longest time of the trace between two looks at the time."""


@dataclass(slots=True)
class _Kept:
    """The finding to be shown of those that say the same, its place in the file, and how many there were."""

    finding: Alarm | Stop
    place: str
    times: int = 1


class TraceJudge:
    """Judge of one bus. The trace does not show who sent a frame, nor telegrams of owners: a silent
    controller is not judged.

    ``watched`` is what the witness knows of the bus, None where it does not know its drives.
    """

    def __init__(self, watched: WatchedBus | None, silences: Mapping[int, Bound]) -> None:
        self._judge = BusJudge(watched, asks=False) if watched else None
        self._identifiers = frozenset(self._judge.identifiers if self._judge else ())
        self._silences = SilenceWatch(silences)
        self._kept: dict[tuple[str, ...], _Kept] = {}
        self._looked = -inf
        self._begin: float | None = None

    def on_frame(self, frame: Frame, place: str) -> None:
        """Take the next frame; ``place`` says where in the file it stands, such as "line 12"."""
        if self._begin is None:
            self._begin = frame.time
        self._silences.on_frame(frame, place)
        if self._judge is None:
            return
        if frame.time - self._looked >= _TICK_S:
            self._look(frame.time, place)
        if frame.can_id in self._identifiers:
            self._judge.on_frame(frame.can_id, frame.data, frame.time)
            self._take(place)

    def verdict(self, end: float) -> tuple[list[str], list[str]]:
        """Sentences of what is wrong up to the ``end`` of the trace, and of the stops that were in time. Call
        it once."""
        if self._begin is None:
            return [], []
        if self._judge:
            self._look(end, "at the end")
        wrong, right = list[str](), list[str]()
        for _, kept in sorted(self._kept.items()):
            (right if _is_right(kept.finding) else wrong).append(self._said(kept))
        return self._silences.said(self._begin, end) + wrong, right

    def _look(self, now: float, place: str) -> None:
        """Let the witness look at what has lasted for too long, up to ``now``."""
        assert self._judge
        self._looked = now
        self._judge.on_time(now)
        self._take(place)

    def _take(self, place: str) -> None:
        assert self._judge
        for finding in self._judge.take_findings():
            key = _same(finding)
            if key is None or not isinstance(finding, Alarm | Stop):
                continue
            kept = self._kept.get(key)
            if kept is None:
                self._kept[key] = _Kept(finding, place)
                continue
            kept.times += 1
            if _is_slower(finding, kept.finding):
                kept.finding, kept.place = finding, place

    def _said(self, kept: _Kept) -> str:
        finding, begin = kept.finding, self._begin or 0.0
        at = f"{finding.time - begin:.3f} s"
        if isinstance(finding, Alarm):
            often = f", {kept.times} times in all" if kept.times > 1 else ""
            return f"{kept.place}: {finding.source}: {finding.kind} at {at}: {finding.message}{often}"
        often = f", the slowest of {kept.times}" if kept.times > 1 else ""
        return f"{kept.place}: {finding.drive}: {finding.cause} at {at}{times_of(finding)}{often}"


def _same(finding: Finding) -> tuple[str, ...] | None:
    """Findings with one key are shown once."""
    match finding:
        case Alarm():
            return finding.source, finding.kind, _without_times(finding.message)
        case Stop():
            return finding.drive, finding.cause, "" if finding.is_in_time else "late"
        case _:
            return None


def _without_times(message: str) -> str:
    """The message without the milliseconds, which differ each time."""
    return re.sub(r"\d+ ms", "ms", message)


def _is_right(finding: Alarm | Stop) -> bool:
    return isinstance(finding, Stop) and finding.is_in_time


def _is_slower(finding: Alarm | Stop, kept: Alarm | Stop) -> bool:
    """True if it is to be shown instead: of stops the slowest is, of alarms the first."""
    return (
        isinstance(finding, Stop)
        and isinstance(kept, Stop)
        and (finding.drive_ms or 0) > (kept.drive_ms or 0)
    )
