"""What a process and all that it has started use, from /proc (proc(5))."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

_TICKS_PER_S = os.sysconf("SC_CLK_TCK")
_PROC = Path("/proc")
_PARENT, _USER, _SYSTEM = 1, 11, 12
"""Fields of ``stat`` behind the name, which may have spaces in it."""


@dataclass(frozen=True, slots=True)
class Usage:
    """CPU seconds so far and memory of some processes. Pages that several share are counted once (PSS)."""

    processes: int
    cpu_s: float
    memory_mb: float


def usage(pid: int) -> Usage:
    """Of ``pid`` and its descendants as they are now."""
    stats = _stats()
    members = [pid, *_descendants(pid, stats)]
    ticks = sum(int(stats[member][_USER]) + int(stats[member][_SYSTEM]) for member in members)
    return Usage(len(members), ticks / _TICKS_PER_S, sum(map(_memory_kb, members)) / 1024)


def children(pid: int) -> list[int]:
    return [child for child, stat in _stats().items() if int(stat[_PARENT]) == pid]


def _stats() -> dict[int, list[str]]:
    stats: dict[int, list[str]] = {}
    for folder in _PROC.iterdir():
        if folder.name.isdigit():
            try:
                stat = (folder / "stat").read_text()
            except OSError:
                continue  # it has just ended
            stats[int(folder.name)] = stat[stat.rindex(")") + 2 :].split()
    return stats


def _descendants(pid: int, stats: dict[int, list[str]]) -> list[int]:
    children = [child for child, stat in stats.items() if int(stat[_PARENT]) == pid]
    return children + [below for child in children for below in _descendants(child, stats)]


def _memory_kb(pid: int) -> int:
    for line in (_PROC / str(pid) / "smaps_rollup").read_text().splitlines():
        if line.startswith("Pss:"):
            return int(line.split()[1])
    return 0
