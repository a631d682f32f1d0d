"""Whether the bridge bears what is thrown at it. One judge for all protocols.

The processes are the same and alive, their memory does not grow, each exchange of the good clients is
answered and soon, their drives turn as they say and nobody else's does, the log is short and has no fault of
ours.
"""

from __future__ import annotations

import json
import re
import statistics
import subprocess
import time
from collections.abc import Sequence
from contextlib import suppress
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
MOST_SPIKE_MB: Final = 160.0
"""At any moment above the beginning. A password alone takes 64 MB while it is checked."""
WARM_UP: Final = 0.4
"""Part of the time after which memory is to be flat."""
SILENT_S: Final = 9.0
"""More than the good clients' own patience and the pause between two newcomers."""
UNSERVED_S: Final = 20.0
"""So long a good client may be told to try again and nothing else, also on a busy machine. Its drive's
time-out is 30 s."""
MOST_BUSY: Final = 0.5
"""Part of a good client's exchanges that may be told to try again, however busy the machine is: of the others
the run says too little."""
PROTOCOLS: Final = ("modbus", "opcua", "zenoh")
GOOD_CLIENTS: Final = (*PROTOCOLS, *(f"{name}, newly connected" for name in PROTOCOLS))
LATE_MS: Final = 500.0
MOST_LATE: Final = 0.02
"""Part of a good client's exchanges that may take longer, or be told to try again, while the machine was not
busy."""
FEW_LATE: Final = 3
"""So many may in any case: a newcomer has few exchanges."""
ENDING_S: Final = 0.5
"""Between the end of a front and that of its bus process, where both end."""
STARVED: Final = 0.5
"""Part of the time between two looks for which the main thread of a process of the bridge, or of the good
clients, was ready and did not run. What takes long then is no fault of the bridge."""
_OF_A_WORD_MB: Final = 0.0016
"""Memory that zenoh keeps of each word of a key that somebody has named, at most."""
_PAGE_MB: Final = 4096 / 2**20
_FAMILIES: Final = {6: "lenze/8400-motec", 7: "stoeber/5000", 8: "cia402/velocity"}
"""Families of the nodes that nobody may move."""
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
    """Measurements: milliseconds of each exchange by protocol, memory in MB by process, log lines."""

    answers_ms: dict[str, list[float]] = field(default_factory=dict[str, list[float]])
    busy: dict[str, int] = field(default_factory=dict[str, int])
    """Number of them that were answered by "too late, try again"."""
    judged: dict[str, int] = field(default_factory=dict[str, int])
    """Number that began when the machine was not busy."""
    late: dict[str, int] = field(default_factory=dict[str, int])
    """Number of those that were told to try again, or took long."""
    memory_mb: dict[int, list[float]] = field(default_factory=dict[int, list[float]])
    peak_mb: dict[int, float] = field(default_factory=dict[int, float])
    """Greatest memory of each at any moment, in MB."""
    lines: int = 0

    def told(self) -> list[str]:
        told: list[str] = []
        for name, times in sorted(self.answers_ms.items()):
            ordered = sorted(times)
            p50, p99 = (ordered[int((len(ordered) - 1) * part)] for part in (0.5, 0.99))
            told.append(
                f"good client on {name}: {len(times)} exchanges, {self.busy.get(name, 0)} told to try again; "
                f"{self.late.get(name, 0)} of {self.judged.get(name, 0)} while the machine was not busy "
                f"were late; p50 {p50:.1f} ms, p99 {p99:.1f} ms, max {ordered[-1]:.1f} ms"
            )
        for place, (pid, samples) in enumerate(self.memory_mb.items()):
            who = "bus process" if place == 0 else f"front {place}"
            told.append(
                f"memory of the {who}: {samples[0]:.1f} MB at the beginning, "
                f"{self.peak_mb[pid]:.1f} MB at most, {samples[-1]:.1f} MB at the end; "
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
        self._waits = Waits([*self._pids, rig.good.popen.pid])
        self._busy_until = float("-inf")
        self._first_mb = {pid: restart_peak_mb(pid) for pid in self._pids}
        self._heard = dict.fromkeys(GOOD_CLIENTS, self._began)
        self._served = dict.fromkeys(GOOD_CLIENTS, self._began)
        self._forgiven_until = dict.fromkeys(GOOD_CLIENTS, float("-inf"))
        self._serves_since = self._began
        self._enabling = {node: load_family(name).control_word.enabling for node, name in _FAMILIES.items()}
        # What went on while this was set up is no matter of ours.
        self._words.take()

    def look(self) -> list[str]:
        """Faults now."""
        if self._waits.is_busy():
            self._busy_until = time.monotonic()
        faults = [*self._processes()]
        if not faults:
            faults += self._measure_memory()
        faults += [*self._look_at_log(), *self._look_at_exchanges(), *self._look_at_words()]
        return faults + self._look_at_audit()

    def forgive(self, *names: str) -> None:
        """Forgive whatever end the exchanges of these good clients have that have begun by now."""
        self.look()
        self._serves_since = time.monotonic()
        self._forgiven_until |= dict.fromkeys(names, self._serves_since)

    def serves_again(self) -> bool:
        """Whether every good client has been served since."""
        return all(served > self._serves_since for served in self._served.values())

    def conclude(self) -> list[str]:
        """Faults in the whole."""
        faults = self.look()
        for name in PROTOCOLS:
            if not self.figures.answers_ms.get(name):
                faults.append(f"the good client on {name} has had no answer at all")
        for pid, samples in self.figures.memory_mb.items():
            grown = growth_mb(samples)
            if grown > MOST_GROWTH_MB + self._of_names_mb(pid):
                faults.append(f"memory of process {pid} is not flat: {grown:.1f} MB more after the warm-up")
        for name, busy in self.figures.busy.items():
            count = len(self.figures.answers_ms[name])
            if busy > max(FEW_LATE, MOST_BUSY * count):
                faults.append(f"good client on {name}: {busy} of {count} exchanges were told to try again")
        for name, late in self.figures.late.items():
            judged = self.figures.judged[name]
            if late > max(FEW_LATE, MOST_LATE * judged):
                faults.append(
                    f"good client on {name}: {late} of {judged} exchanges on a machine that was not busy "
                    f"were told to try again, or took more than {LATE_MS:g} ms"
                )
        return faults

    def _processes(self) -> list[str]:
        bus = self._rig.process
        now = [bus.pid, *self._rig.fronts()]
        if now != self._pids:
            # One that ends loses its front first.
            with suppress(subprocess.TimeoutExpired):
                bus.popen.wait(ENDING_S)
        if bus.popen.poll() is not None:
            return [f"the bus process has ended with {bus.popen.returncode}"]
        if now != self._pids:
            return [f"the processes are others: {self._pids} before, {now} now"]
        if self._rig.good.popen.poll() is not None:
            return [f"the good clients have ended: {self._rig.good.output()[-2000:]}"]
        return []

    def _measure_memory(self) -> list[str]:
        faults: list[str] = []
        for pid in self._pids:
            try:
                pages = int(Path(f"/proc/{pid}/statm").read_text(encoding="ascii").split()[1])
                peak = peak_mb(pid)
            except (OSError, IndexError):
                # It has just ended: the next look says so.
                continue
            self.figures.memory_mb.setdefault(pid, []).append(pages * _PAGE_MB)
            self.figures.peak_mb[pid] = peak
            if peak - self._first_mb[pid] > MOST_SPIKE_MB + self._of_names_mb(pid):
                first = self._first_mb[pid]
                faults.append(f"memory of process {pid}: {first:.1f} MB before, {peak:.1f} MB at most")
        return faults

    def _of_names_mb(self, pid: int) -> float:
        """Memory in MB of the distinct keys that zenoh keeps for ever; of no process but its own."""
        with suppress(OSError):
            if b"--role\0zenoh\0" in Path(f"/proc/{pid}/cmdline").read_bytes():
                return self._rig.named_words * _OF_A_WORD_MB
        return 0.0

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
            ended_at, name, took_ms, verdict = line.split(";", 3)
            began_at = float(ended_at) - float(took_ms) / 1000
            self._heard[name] = now
            self.figures.answers_ms.setdefault(name, []).append(float(took_ms))
            if verdict == "busy":
                self.figures.busy[name] = self.figures.busy.get(name, 0) + 1
            elif verdict == "ok":
                self._served[name] = now
            elif began_at > self._forgiven_until[name]:
                faults.append(f"good client on {name}: {verdict} after {took_ms} ms")
            if began_at >= self._busy_until:
                is_late = verdict == "busy" or float(took_ms) > LATE_MS
                self.figures.judged[name] = self.figures.judged.get(name, 0) + 1
                self.figures.late[name] = self.figures.late.get(name, 0) + is_late
        for name in GOOD_CLIENTS:
            if now - self._heard[name] > SILENT_S:
                faults.append(f"good client on {name}: no exchange for {SILENT_S:g} s")
            elif now - self._served[name] > UNSERVED_S:
                faults.append(f"good client on {name}: told to try again for {UNSERVED_S:g} s")
        return faults

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


class Waits:
    """Whether processes got the CPU: for how long their main threads were ready and did not run."""

    def __init__(self, pids: Sequence[int]) -> None:
        self._pids = pids
        self._at = time.monotonic()
        self._before = self._accounts()

    def is_busy(self) -> bool:
        """Whether one of them has waited for too much of the time since this was asked last."""
        begin, self._at = self._at, time.monotonic()
        before, self._before = self._before, self._accounts()
        longest = max((now - before.get(pid, now) for pid, now in self._before.items()), default=0.0)
        return longest > STARVED * (self._at - begin)

    def _accounts(self) -> dict[int, float]:
        accounts: dict[int, float] = {}
        for pid in self._pids:
            with suppress(OSError, IndexError):
                words = Path(f"/proc/{pid}/schedstat").read_text(encoding="ascii").split()
                accounts[pid] = int(words[1]) / 1e9
        return accounts


def unrightful(line: dict[str, Any]) -> str:
    """Fault in a line of the audit log; nothing with what was refused, or asked by who may."""
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


def peak_mb(pid: int) -> float:
    """Greatest memory of a process so far in MB; 0 where it has ended."""
    for line in Path(f"/proc/{pid}/status").read_text(encoding="utf-8").splitlines():
        if line.startswith("VmHWM:"):
            return int(line.split()[1]) / 1024
    return 0.0


def restart_peak_mb(pid: int) -> float:
    """The same from now on, and what it is now (proc_pid_clear_refs(5))."""
    with suppress(OSError):
        Path(f"/proc/{pid}/clear_refs").write_text("5", encoding="ascii")
    return peak_mb(pid)


def growth_mb(samples: list[float]) -> float:
    """Growth in MB from the warm-up to the end, spikes left out."""
    if len(samples) < 10:
        return 0.0
    begin = int(len(samples) * WARM_UP)
    slice_ = max(3, len(samples) // 10)
    return statistics.median(samples[-slice_:]) - statistics.median(samples[begin : begin + slice_])
