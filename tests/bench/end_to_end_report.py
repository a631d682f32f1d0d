"""The end-to-end runs as JSON, as Markdown tables and as plots."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Sequence

from tests.bench.end_to_end_runs import BRIDGES, OURS, PROTOCOLS, Cell, Figure, Run, Spread, ratio, spread
from tests.bench.line_plot import Line, line_plot


def to_json(runs: Sequence[Run], machine: dict[str, object]) -> str:
    return (
        json.dumps({"machine": machine, "runs": [dataclasses.asdict(run) for run in runs]}, indent=1) + "\n"
    )


def _cpu(run: Run) -> float:
    return run.cpu_percent


def _lost(run: Run) -> float:
    return run.lost_percent


def _memory(run: Run) -> float:
    return run.memory_mb


def _us_per_pdo(run: Run) -> float | None:
    return run.us_per_pdo


def _delay(protocol: str, which: str) -> Figure:
    def figure(run: Run) -> float | None:
        return getattr(run.delays[protocol], which)

    return figure


def markdown(runs: Sequence[Run]) -> str:
    """A table for each share of new values, with a row for each rate and bridge."""
    rounds = len({run.round for run in runs})
    parts = [
        f"Medians of {rounds} rounds, least and most in brackets. CPU: all processes of a bridge, in % of a "
        "core. Times ours: CPU per PDO beside ours in the same round. Delays: p50 / p99 / max.\n"
    ]
    for changed in sorted({run.cell.changed for run in runs}, reverse=True):
        rows = [
            [f"{cell.rate:,}", bridge, *_costs(runs, cell, bridge), *_delays(runs, cell, bridge)]
            for cell in _cells(runs, changed)
            for bridge in _bridges(runs)
        ]
        parts += [f"## New values in {changed} % of the PDOs\n", table(_HEADS, rows)]
    late = sum(run.is_late for run in runs)
    if late:
        parts.append(f"In {late} of {len(runs)} runs the plant could not keep its pace.\n")
    return "\n".join(parts)


_HEADS = (
    "PDO/s",
    "bridge",
    "CPU %",
    "lost %",
    "µs per PDO",
    "times ours",
    "MB",
    *(f"{protocol} ms" for protocol in PROTOCOLS),
)


def _cells(runs: Sequence[Run], changed: int) -> list[Cell]:
    rates = {run.cell.rate for run in runs if run.cell.changed == changed}
    return [Cell(rate, changed) for rate in sorted(rates)]


def _bridges(runs: Sequence[Run]) -> list[str]:
    return [bridge for bridge in BRIDGES if any(run.bridge == bridge for run in runs)]


def _costs(runs: Sequence[Run], cell: Cell, bridge: str) -> list[str]:
    cpu, lost, each, memory = (
        _shown(spread(runs, bridge, cell, figure)) for figure in (_cpu, _lost, _us_per_pdo, _memory)
    )
    beside = "" if bridge == OURS else _shown(ratio(runs, cell, bridge, OURS, _us_per_pdo), 2)
    return [cpu, lost, each, beside, memory]


def _delays(runs: Sequence[Run], cell: Cell, bridge: str) -> list[str]:
    """p50, p99 and greatest of each protocol, and how many changes were never seen, if any."""
    shown: list[str] = []
    for protocol in PROTOCOLS:
        found = [
            spread(runs, bridge, cell, _delay(protocol, which)) for which in ("p50_ms", "p99_ms", "max_ms")
        ]
        unseen = spread(runs, bridge, cell, _delay(protocol, "unseen"))
        never = f", {unseen.median:.0f} unseen" if unseen and unseen.most else ""
        shown.append(" / ".join(_median(one) for one in found) + never)
    return shown


def table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [heads, ["---"] * len(heads), *rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def _median(found: Spread | None) -> str:
    return "–" if found is None else f"{found.median:.1f}"


def _shown(found: Spread | None, digits: int = 1) -> str:
    if found is None:
        return "–"
    median = f"{found.median:.{digits}f}"
    if found.least == found.most:
        return median
    return f"{median} ({found.least:.{digits}f}–{found.most:.{digits}f})"


def plots(runs: Sequence[Run]) -> dict[str, str]:
    """SVG by file name: CPU, and the delay to a Modbus register, with the most new values that there are."""
    cells = _cells(runs, max(run.cell.changed for run in runs))
    drawn = {
        "end-to-end-cpu.svg": ("CPU of all processes, % of a core", _cpu, False),
        "end-to-end-modbus.svg": ("PDO to Modbus register, 99 %, ms", _delay("modbus", "p99_ms"), True),
    }
    return {
        name: line_plot(title, "PDOs a second", _lines(runs, cells, figure), log_y=log_y)
        for name, (title, figure, log_y) in drawn.items()
    }


def _lines(runs: Sequence[Run], cells: Sequence[Cell], figure: Figure) -> list[Line]:
    lines: list[Line] = []
    for bridge in _bridges(runs):
        found = [(cell.rate, spread(runs, bridge, cell, figure)) for cell in cells]
        lines.append(Line(bridge, [(rate, one.median) for rate, one in found if one is not None]))
    return lines
