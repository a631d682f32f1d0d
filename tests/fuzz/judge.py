"""Whether the bridge bears what is thrown at it. One judge for all protocols.

The processes are the same and alive, their memory does not grow, each exchange of the good clients is
answered, their drives turn as they say and nobody else's does, the log is short and has no fault of ours.
"""

from __future__ import annotations

import json
import re
import statistics
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from bridge.mapping import load_family
from tests.fuzz.rig import GOOD, GOOD_RPDOS, Rig

BAD_LINE: Final = re.compile(
    r"Traceback|never retrieved|never awaited|panicked|FATAL|CRITICAL|unexpected: |gave no sign of life"
    r"|\bhung\b|has lost a task|serves again|^00:00:00 ERROR   forged"
)
MOST_LINES: Final = 100
LINES_PER_S: Final = 1.0
"""So many lines may be told at once, and so many a second on top."""
MOST_GROWTH_MB: Final = 24.0
WARM_UP: Final = 0.4
"""Part of the time after which memory is to be flat."""
SILENT_S: Final = 9.0
"""More than the good clients' own patience and the pause between two newcomers."""
_PAGE_MB: Final = 4096 / 2**20
_FAMILIES: Final = {6: "lenze/8400-motec", 7: "stoeber/5000", 8: "cia402/velocity"}
"""Of the nodes that nobody may move."""
_RPDOS: Final = (0x200, 0x300, 0x400, 0x500)
_GOOD_TARGETS: Final = {f"conveyor/{slot}": slot for slot in GOOD_RPDOS.values()}
_NODES: Final = ("pump", "lift", "fan")


class Tail:
    """The lines that a file gets from now on."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._place = path.stat().st_size if path.exists() else 0

    def take(self) -> list[str]:
        """Whole lines since the last time."""
        if not self._path.exists():
            return []
        with self._path.open("rb") as file:
            file.seek(self._place)
            data = file.read()
        whole = data.rfind(b"\n") + 1
        self._place += whole
        return data[:whole].decode("utf-8", "replace").splitlines()


@dataclass(slots=True)
class Figures:
    """What was measured: milliseconds of each exchange by protocol, memory in MB by process, log lines."""

    answers_ms: dict[str, list[float]] = field(default_factory=dict[str, list[float]])
    busy: dict[str, int] = field(default_factory=dict[str, int])
    """How many of them were answered by "too late, try again"."""
    memory_mb: dict[int, list[float]] = field(default_factory=dict[int, list[float]])
    lines: int = 0

    def told(self) -> list[str]:
        told: list[str] = []
        for name, times in sorted(self.answers_ms.items()):
            ordered = sorted(times)
            p50, p99 = (ordered[int((len(ordered) - 1) * part)] for part in (0.5, 0.99))
            told.append(
                f"good client on {name}: {len(times)} exchanges, {self.busy.get(name, 0)} told to try again; "
                f"p50 {p50:.1f} ms, p99 {p99:.1f} ms, max {ordered[-1]:.1f} ms"
            )
        for place, samples in enumerate(self.memory_mb.values()):
            who = "bus process" if place == 0 else f"front {place}"
            told.append(
                f"memory of the {who}: {samples[0]:.1f} MB at the beginning, "
                f"{max(samples):.1f} MB at most, {samples[-1]:.1f} MB at the end; "
                f"{growth_mb(samples):+.1f} MB after the warm-up"
            )
        told.append(f"log: {self.lines} lines")
        return told


class Judge:
    """Looks at one running rig. ``look`` is to be called about once a second, ``conclude`` at the end; both
    give what is wrong, in sentences."""

    def __init__(self, rig: Rig) -> None:
        self._rig = rig
        self.figures = Figures()
        self._pids = [rig.process.pid, *rig.fronts()]
        self._log = Tail(rig.process.log)
        self._exchanges = Tail(rig.exchanges)
        self._words = Tail(rig.words)
        self._audit = Tail(rig.audit)
        self._began = time.monotonic()
        self._heard: dict[str, float] = {}
        self._enabling = {node: load_family(name).control_word.enabling for node, name in _FAMILIES.items()}
        # What went on while this was set up is no matter of ours.
        self._words.take()

    def look(self) -> list[str]:
        """What is wrong now."""
        faults = [*self._processes()]
        if not faults:
            self._measure_memory()
        faults += [*self._look_at_log(), *self._look_at_exchanges(), *self._look_at_words()]
        return faults + self._look_at_audit()

    def conclude(self) -> list[str]:
        """What is wrong in the whole."""
        faults = self.look()
        for name in ("modbus", "opcua", "zenoh"):
            if not self.figures.answers_ms.get(name):
                faults.append(f"the good client on {name} has had no answer at all")
        for pid, samples in self.figures.memory_mb.items():
            grown = growth_mb(samples)
            if grown > MOST_GROWTH_MB:
                faults.append(f"memory of process {pid} is not flat: {grown:.1f} MB more after the warm-up")
        return faults

    def _processes(self) -> list[str]:
        if self._rig.process.popen.poll() is not None:
            return [f"the bus process has ended with {self._rig.process.popen.returncode}"]
        now = [self._rig.process.pid, *self._rig.fronts()]
        if now != self._pids:
            return [f"the processes are others: {self._pids} before, {now} now"]
        if self._rig.good.popen.poll() is not None:
            return [f"the good clients have ended: {self._rig.good.output()[-2000:]}"]
        return []

    def _measure_memory(self) -> None:
        for pid in self._pids:
            try:
                pages = int(Path(f"/proc/{pid}/statm").read_text(encoding="ascii").split()[1])
            except (OSError, IndexError):
                # It has just ended: the next look says so.
                continue
            self.figures.memory_mb.setdefault(pid, []).append(pages * _PAGE_MB)

    def _look_at_log(self) -> list[str]:
        lines = self._log.take()
        self.figures.lines += len(lines)
        faults = [f"log: {line[:300]}" for line in lines if BAD_LINE.search(line)]
        most = MOST_LINES + LINES_PER_S * (time.monotonic() - self._began)
        if self.figures.lines > most:
            faults.append(f"the log has {self.figures.lines} lines, the last: {lines[-1:]}")
        return faults

    def _look_at_exchanges(self) -> list[str]:
        faults: list[str] = []
        now = time.monotonic()
        for line in self._exchanges.take():
            _, name, took_ms, verdict = line.split(";", 3)
            self._heard[name] = now
            self.figures.answers_ms.setdefault(name, []).append(float(took_ms))
            if verdict == "busy":
                self.figures.busy[name] = self.figures.busy.get(name, 0) + 1
            elif verdict != "ok":
                faults.append(f"good client on {name}: {verdict} after {took_ms} ms")
        silent = [name for name, heard in self._heard.items() if now - heard > SILENT_S]
        return faults + [f"good client on {name}: no exchange for {SILENT_S:g} s" for name in silent]

    def _look_at_words(self) -> list[str]:
        faults: list[str] = []
        for line in self._words.take():
            _, can_id, data = line.split(" ")
            fault = self._judge_word(int(can_id, 16), bytes.fromhex(data))
            if fault:
                faults.append(f"{fault}: {can_id}h {data}")
        return faults

    def _judge_word(self, can_id: int, data: bytes) -> str:
        if can_id in GOOD_RPDOS:
            # It was turning when we began, and it is to go on: nothing changes at all.
            return f"the telegram of conveyor/{GOOD_RPDOS[can_id]} has changed"
        node = can_id & 0x7F
        if node not in _FAMILIES or can_id & 0x780 not in _RPDOS:
            return ""
        enabling = self._enabling[node]
        word = int.from_bytes(data[:2], "little")
        # Which words are control words is the mapping's; what is first in any RPDO of these families is.
        return f"node {node} is enabled" if word & enabling.mask == enabling.value else ""

    def _look_at_audit(self) -> list[str]:
        lines: list[dict[str, Any]] = [json.loads(line) for line in self._audit.take()]
        return [fault for line in lines if (fault := unrightful(line))]


def unrightful(line: dict[str, Any]) -> str:
    """What is wrong with a line of the audit log; nothing with what was refused, or asked by who may."""
    if line["code"] != "ok" or line["source"] in ("none", "local"):
        return ""
    owner = {"fu1": ("modbus", "127.0.0.1"), "fu2": ("opcua", GOOD), "fu3": ("zenoh", GOOD)}
    target = line["target"]
    if target in _GOOD_TARGETS and (line["source"], line["user"]) != owner[_GOOD_TARGETS[target]]:
        return f"{line['source']}:{line['user']} was let do {line['action']} on {target}"
    moves = ("write", "start", "take_control", "telegrams", "keep_alive")
    if target.split("/")[0] in _NODES and line["action"] in moves:
        return f"{line['source']}:{line['user']} was let do {line['action']} on {target}, which is nobody's"
    return ""


def growth_mb(samples: list[float]) -> float:
    """How much more there is at the end than after the warm-up, spikes left out."""
    if len(samples) < 10:
        return 0.0
    begin = int(len(samples) * WARM_UP)
    slice_ = max(3, len(samples) // 10)
    return statistics.median(samples[-slice_:]) - statistics.median(samples[begin : begin + slice_])
