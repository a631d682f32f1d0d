"""The figures of one run end to end, and what becomes of those of all rounds."""

from __future__ import annotations

import os
import platform
import statistics
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

from tests.bench.delays import Delays

OURS = "ours"
BRIDGES = (OURS, "careful", "naive")
PROTOCOLS = ("modbus", "opcua", "zenoh")
_LIBRARIES = ("python-can", "canopen", "asyncua", "pymodbus", "eclipse-zenoh")


@dataclass(frozen=True, slots=True)
class Cell:
    """PDOs a second, and how many of a hundred have new values."""

    rate: int
    changed: int


@dataclass(frozen=True, slots=True)
class Run:
    """One bridge, once. CPU and memory are those of all its processes."""

    bridge: str
    cell: Cell
    round: int
    cpu_percent: float
    """Of one core, while PDOs were sent."""
    us_per_pdo: float | None
    """CPU for each PDO that was not lost; None if all were."""
    memory_mb: float
    processes: int
    sent: int
    lost: int
    is_late: bool
    """The plant could not keep its pace: the machine was too busy for this run."""
    delays: dict[str, Delays]

    @property
    def lost_percent(self) -> float:
        return 100 * self.lost / self.sent

    @property
    def line(self) -> str:
        """As it is printed when it is there."""
        delays = "   ".join(
            f"{protocol} {_shown(one.p50_ms)}/{_shown(one.p99_ms)}/{_shown(one.max_ms)} ms"
            + (f" ({one.unseen} unseen)" if one.unseen else "")
            for protocol, one in self.delays.items()
        )
        return (
            f"{self.cell.rate:5}/s {self.cell.changed:3} %  {self.bridge:8} {self.cpu_percent:6.1f} %  "
            f"{_shown(self.us_per_pdo)} µs/PDO  {self.memory_mb:6.1f} MB  "
            f"lost {self.lost_percent:5.1f} %   {delays}" + ("   LATE" if self.is_late else "")
        )


def _shown(figure: float | None) -> str:
    return "–" if figure is None else f"{figure:.1f}"


@dataclass(frozen=True, slots=True)
class Spread:
    """Median of some rounds, the smallest and the largest."""

    median: float
    least: float
    most: float


Figure = Callable[[Run], float | None]


def spread(runs: Sequence[Run], bridge: str, cell: Cell, figure: Figure) -> Spread | None:
    """Over the rounds; None if one of them has no figure or there is none."""
    found = [figure(run) for run in runs if run.bridge == bridge and run.cell == cell]
    known = [one for one in found if one is not None]
    if not known or len(known) < len(found):
        return None
    return Spread(statistics.median(known), min(known), max(known))


def ratio(runs: Sequence[Run], cell: Cell, of: str, to: str, figure: Figure) -> Spread | None:
    """One bridge's figure divided by another's, each pair from one round."""
    pairs: dict[int, dict[str, float | None]] = {}
    for run in runs:
        if run.cell == cell:
            pairs.setdefault(run.round, {})[run.bridge] = figure(run)
    ratios: list[float] = []
    for pair in pairs.values():
        above, below = pair.get(of), pair.get(to)
        if above is None or not below:
            return None
        ratios.append(above / below)
    return Spread(statistics.median(ratios), min(ratios), max(ratios)) if ratios else None


def machine() -> dict[str, object]:
    """What the figures come from."""
    models = [
        line.partition(":")[2].strip()
        for line in Path("/proc/cpuinfo").read_text().splitlines()
        if line.startswith("model name")
    ]
    return {
        "cpu": models[0] if models else platform.machine(),
        "cores": len(os.sched_getaffinity(0)),
        "kernel": platform.release(),
        "python": platform.python_version(),
        "load": os.getloadavg()[0],
        "libraries": {name: version(name) for name in _LIBRARIES},
    }
