"""What the bridge is to reach, beside what a run of the benchmarks has found."""

from __future__ import annotations

import statistics
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from tests.bench.end_to_end_runs import OURS, Cell, Figure, Run, ratio, spread
from tests.bench.write_to_rpdo import FRONT, Writes

SLOW, FAST = Cell(1000, 100), Cell(8000, 100)


@dataclass(slots=True)
class Found:
    """Of one run. ``numbers`` are those that single benchmarks have recorded."""

    runs: Sequence[Run] = ()
    writes: Sequence[Writes] = ()
    numbers: Mapping[str, float] = field(default_factory=dict[str, float])


@dataclass(frozen=True, slots=True)
class Target:
    """``most`` or else ``least`` is what it is to be, ``of`` what was found, None where nothing was."""

    what: str
    of: Callable[[Found], float | None]
    most: float | None = None
    least: float | None = None
    unit: str = ""

    def row(self, found: Found) -> list[str]:
        bound = self.most if self.most is not None else self.least
        assert bound is not None
        sign = "≤" if self.most is not None else "≥"
        aim, measured = f"{sign} {bound:g}{self.unit}", self.of(found)
        if measured is None:
            return [self.what, aim, "–", "not measured in this run"]
        is_met = measured <= bound if self.most is not None else measured >= bound
        missed = max(measured, bound) / min(measured, bound) if min(measured, bound) > 0 else 0.0
        return [self.what, aim, f"{measured:.3g}{self.unit}", "met" if is_met else f"missed, {missed:.2g} ×"]


def _us_per_pdo(run: Run) -> float | None:
    return run.us_per_pdo


def _beside(cell: Cell, other: str) -> Callable[[Found], float | None]:
    """Our CPU for each PDO that was not lost, in parts of another's."""

    def of(found: Found) -> float | None:
        beside = ratio(found.runs, cell, OURS, other, _us_per_pdo)
        return beside and beside.median

    return of


def _naive_beside(found: Found) -> float | None:
    beside = ratio(found.runs, FAST, "naive", OURS, _us_per_pdo)
    return beside and beside.median


def _ours(cell: Cell, figure: Figure) -> Callable[[Found], float | None]:
    def of(found: Found) -> float | None:
        all_rounds = spread(found.runs, OURS, cell, figure)
        return all_rounds and all_rounds.median

    return of


def _p99(protocol: str) -> Figure:
    return lambda run: run.delays[protocol].p99_ms


def _lost(found: Found) -> float | None:
    ours = [run.lost for run in found.runs if run.bridge == OURS]
    return float(sum(ours)) if ours else None


def _under_load(which: str) -> Callable[[Found], float | None]:
    def of(found: Found) -> float | None:
        runs = [run for run in found.writes if (run.bridge, run.load) == (OURS, FRONT)]
        figures = [getattr(run.delays["modbus"], which) for run in runs]
        return statistics.median(figures) if figures and None not in figures else None

    return of


def _number(name: str) -> Callable[[Found], float | None]:
    return lambda found: found.numbers.get(name)


def _beside_viewers(name: str) -> Callable[[Found], float | None]:
    """What five viewers of the page add, in parts of what it is without."""

    def of(found: Found) -> float | None:
        without, beside = (found.numbers.get(f"{name}, {viewers} viewers") for viewers in (0, 5))
        return beside / without if beside is not None and without else None

    return of


def _evener(than: str) -> Callable[[Found], float | None]:
    def of(found: Found) -> float | None:
        kernel = found.numbers.get("SYNC error p99, kernel, as the bridge uses it, µs")
        other = found.numbers.get(f"SYNC error p99, {than}, µs")
        return other / kernel if kernel and other else None

    return of


TARGETS: Sequence[Target] = (
    Target("CPU end to end at 1,000 PDO/s beside *careful*", _beside(SLOW, "careful"), most=0.5, unit=" ×"),
    Target("the same at 8,000 PDO/s", _beside(FAST, "careful"), most=0.45, unit=" ×"),
    Target(
        "*naive* beside ours at 8,000 PDO/s, CPU per PDO that was not lost", _naive_beside, least=7, unit=" ×"
    ),
    Target(
        "CPU at 8,000 PDO/s, all protocols, front included",
        _ours(FAST, lambda run: run.cpu_percent),
        most=35,
        unit=" %",
    ),
    *(
        Target(
            f"a single frame, wake-up included, {drives} drives",
            _number(f"single frame, {drives} drives, µs"),
            most=22,
            unit=" µs",
        )
        for drives in (4, 16, 40)
    ),
    Target(
        "zenoh per value, with a subscriber",
        _number("zenoh per value with a subscriber, µs"),
        most=2,
        unit=" µs",
    ),
    Target("the same without one", _number("zenoh per value without one, µs"), most=0.4, unit=" µs"),
    Target("demo at rest, all processes", _number("demo at rest, % of a core"), most=10, unit=" %"),
    Target("front with 244 drives: memory", _number("front with 244 drives, MB"), most=180, unit=" MB"),
    Target(
        "front with 244 drives: CPU of its start",
        _number("front with 244 drives, s of CPU"),
        most=6,
        unit=" s",
    ),
    Target("126 nodes operational", _number("126 nodes operational, s"), most=10, unit=" s"),
    Target("page: first paint", _number("page, first paint, s"), most=0.8, unit=" s"),
    Target("page: loaded for it", _number("page, loaded, kB"), most=600, unit=" kB"),
    Target(
        "page: a value on the screen, p95", _number("page, value on the screen p95, ms"), most=250, unit=" ms"
    ),
    Target(
        "page: frames dropped in 10 s, 500 values at 5 Hz",
        _number("page, frames dropped with 500 values"),
        most=0,
    ),
    Target(
        "page: frames dropped in 10 s, six trends at 20 Hz",
        _number("page, frames dropped with six trends"),
        most=0,
    ),
    Target(
        "page: CPU of its front with 5 viewers",
        _number("page, front with 5 viewers, % of a core"),
        most=20,
        unit=" %",
    ),
    Target(
        "page: SYNC's period error with 5 viewers beside none, p99",
        _beside_viewers("SYNC error p99"),
        most=1.25,
        unit=" ×",
    ),
    Target(
        "page: a silent controller's drive is stopped, with 5 viewers beside none",
        _beside_viewers("stop after silence"),
        most=1.02,
        unit=" ×",
    ),
    Target("PDO → Modbus register at 8,000 PDO/s, p99", _ours(FAST, _p99("modbus")), most=5, unit=" ms"),
    Target(
        "PDO → OPC UA subscriber at 8,000 PDO/s, publishing 50 ms, p99",
        _ours(FAST, _p99("opcua")),
        most=75,
        unit=" ms",
    ),
    Target(
        "OPC UA: 2,000 values at 10 Hz to node-opcua, changes per CPU second beside plain asyncua",
        _number("opcua: changes per CPU second, times asyncua's"),
        least=4,
        unit=" ×",
    ),
    Target(
        "OPC UA: 5,000 values at 2 Hz to five clients, changes told",
        _number("opcua: 5,000 values at 2 Hz to five clients, % told"),
        least=99,
        unit=" %",
    ),
    Target(
        "OPC UA: memory of the server after 100,000 alarm events more",
        _number("opcua: MB more after 100,000 alarm events"),
        most=10,
        unit=" MB",
    ),
    Target(
        "OPC UA: memory of the server after 10,000 clients more",
        _number("opcua: MB more after 10,000 clients"),
        most=5,
        unit=" MB",
    ),
    Target("FC16 → RPDO under the front's worst load, p50", _under_load("p50_ms"), most=1, unit=" ms"),
    Target("the same, p99", _under_load("p99_ms"), most=4, unit=" ms"),
    Target("PDOs that ours lost end to end, at all rates", _lost, most=0),
    Target(
        "SYNC's period error beside python-can's thread, p99",
        _evener("python-can's thread"),
        least=10,
        unit=" ×",
    ),
    Target(
        "the same beside an asyncio task of the bridge",
        _evener("an asyncio task of the bridge's loop"),
        least=10,
        unit=" ×",
    ),
)


def rows(found: Found) -> Iterator[list[str]]:
    for target in TARGETS:
        yield target.row(found)
