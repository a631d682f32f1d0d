"""From PDOs on the bus to the clients of all protocols: drivebridge beside two reference bridges.

end_to_end.py [--rates 250,1000] [--changed 1,10,100] [--rounds 3] [--seconds 6] [--bridges ours,careful]
              [--json FILE] [--markdown FILE] [--plots FOLDER]

What a figure means: tests/bench/reference/README.md. Each run starts its own bridge, on an end of a pair of
Unix sockets (``tests/bench/pair.py``), with three clients that watch it.
"""

from __future__ import annotations

import argparse
import json
import signal
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from tests.bench import end_to_end_report as report
from tests.bench.delays import summary
from tests.bench.end_to_end_rig import LIMIT_S, NODES, Client, Traffic, rig
from tests.bench.end_to_end_runs import BRIDGES, PROTOCOLS, Cell, Run, machine
from tests.bench.processes import usage
from tests.bench.reference.command_line import Ports

REST_S = 1.0
"""After everybody is there, and after the last PDO."""
MOST_CHANGES = 0x7FFF
RATES = (250, 500, 1000, 2000, 4000, 8000)
CHANGED = (1, 10, 100)


def _watchers(at: Ports, folder: Path) -> dict[str, Client]:
    """Modbus reads one drive, the others follow all."""
    where = {"modbus": (at.modbus, 1), "opcua": (at.opcua, NODES), "zenoh": (at.zenoh, NODES)}
    return {
        protocol: Client(f"watch_{protocol}", (*where[protocol], folder / f"{protocol}.json"), "watching")
        for protocol in PROTOCOLS
    }


def measure(name: str, cell: Cell, round_number: int, seconds: float) -> Run:
    """One run of one bridge."""
    with tempfile.TemporaryDirectory(prefix="end-to-end-") as made:
        folder = Path(made)
        traffic = Traffic(cell.rate, cell.changed, seconds)
        with rig(name, traffic, folder, lambda at: _watchers(at, folder)) as all_of_it:
            time.sleep(REST_S)
            before, begin = usage(all_of_it.bridge.pid), time.monotonic()
            all_of_it.plant.signal(signal.SIGUSR1)
            all_of_it.wait(all_of_it.plant, "all sent", 3 * seconds + LIMIT_S)
            after, took_s = usage(all_of_it.bridge.pid), time.monotonic() - begin
            time.sleep(REST_S)
            for watcher in all_of_it.clients.values():
                watcher.stop()
        told = json.loads((folder / "plant.json").read_text(encoding="utf-8"))
        seen = {protocol: _seen(folder / f"{protocol}.json") for protocol in PROTOCOLS}
    spent_s = after.cpu_s - before.cpu_s
    delivered = told["sent"] - told["lost"]
    return Run(
        name,
        cell,
        round_number,
        cpu_percent=round(100 * spent_s / took_s, 1),
        us_per_pdo=round(spent_s * 1e6 / delivered, 1) if delivered else None,
        memory_mb=round(after.memory_mb, 1),
        processes=after.processes,
        sent=told["sent"],
        lost=told["lost"],
        is_late=told["took_s"] > 1.05 * seconds,
        delays={protocol: summary(told["changes"], values) for protocol, values in seen.items()},
    )


def _seen(path: Path) -> dict[int, list[tuple[float, int]]]:
    """What a watcher saw. Before the first change the values are 0."""
    nodes = json.loads(path.read_text(encoding="utf-8"))
    return {int(node): [(at, value) for at, value in values if value] for node, values in nodes.items()}


def measure_all(cells: Sequence[Cell], bridges: Sequence[str], rounds: int, seconds: float) -> list[Run]:
    """Each cell by all bridges, one directly after the other, in an order that rotates."""
    runs: list[Run] = []
    for round_number in range(rounds):
        for place, cell in enumerate(cells):
            first = (round_number + place) % len(bridges)
            for name in (*bridges[first:], *bridges[:first]):
                runs.append(measure(name, cell, round_number, seconds))
                print(runs[-1].line, flush=True)
    return runs


def numbers(text: str) -> list[int]:
    return [int(number) for number in text.split(",")]


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--rates", type=numbers, default=list(RATES), help="PDOs a second")
    parser.add_argument("--changed", type=numbers, default=list(CHANGED), help="percent of PDOs that are new")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--seconds", type=float, default=6.0)
    parser.add_argument("--bridges", type=lambda text: text.split(","), default=list(BRIDGES))
    for output in ("json", "markdown", "plots"):
        parser.add_argument(f"--{output}", type=Path)
    given = parser.parse_args()
    if max(given.rates) * max(given.changed) / 100 * given.seconds / NODES > MOST_CHANGES:
        parser.error(f"a drive's value can count {MOST_CHANGES} changes: fewer seconds, please")
    if any(100 % changed for changed in given.changed):
        parser.error("the share of new values is one of 1, 2, 4, 5, 10, 20, 25, 50, 100")
    cells = [Cell(rate, changed) for changed in given.changed for rate in given.rates]
    runs = measure_all(cells, given.bridges, given.rounds, given.seconds)
    if given.json:
        given.json.write_text(report.to_json(runs, machine()), encoding="utf-8")
    tables = report.markdown(runs)
    if given.markdown:
        given.markdown.write_text(tables, encoding="utf-8")
    else:
        print(tables)
    if given.plots:
        for name, plot in report.plots(runs).items():
            (given.plots / name).write_text(plot, encoding="utf-8")


if __name__ == "__main__":
    main()
