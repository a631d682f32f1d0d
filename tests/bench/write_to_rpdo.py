"""From a client's write to the RPDO on the bus: drivebridge beside two reference bridges.

write_to_rpdo.py [--writes 300] [--rounds 3] [--bridges ours,careful,naive] [--loads idle,busy,front]
                 [--json FILE]

A client of each protocol writes a drive of its own every 20 ms, all three at the same time; the plant says
when each setpoint came. The bus is that of tests/bench/end_to_end.py. Loads: 100 PDO/s and nothing else;
2,000 PDO/s, all values new; 100 PDO/s and an OPC UA client that browses the whole tree and creates 10,000
items, again and again.
"""

from __future__ import annotations

import argparse
import contextlib
import dataclasses
import json
import signal
import statistics
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from tests.bench.delays import Delays, summary
from tests.bench.end_to_end_rig import Client, Traffic, rig
from tests.bench.end_to_end_runs import BRIDGES, PROTOCOLS, machine
from tests.bench.reference.command_line import Ports

PDOS_PER_S = {"idle": 100, "busy": 2000, "front": 100}
FRONT = "front"
_PLANT_S = 15.0
"""The plant sends for as long as this; the writes are done before."""


@dataclass(frozen=True, slots=True)
class Writes:
    """One bridge under one load, once."""

    bridge: str
    load: str
    round: int
    delays: dict[str, Delays]
    unwritten: dict[str, int]
    """Writes that were never begun, because those before them had not been answered in time."""

    @property
    def line(self) -> str:
        delays = "   ".join(
            f"{protocol} {one.p50_ms}/{one.p99_ms}/{one.max_ms} ms"
            + _missing(one.unseen, self.unwritten[protocol])
            for protocol, one in self.delays.items()
        )
        return f"{self.load:6} {self.bridge:8} {delays}"


def _missing(unseen: int, unwritten: int) -> str:
    return (f", {unseen} never came" if unseen else "") + (f", {unwritten} not written" if unwritten else "")


def _clients(at: Ports, load: str, writes: int, folder: Path) -> dict[str, Client]:
    """Node 1 is written by Modbus, 2 by OPC UA, 3 by zenoh: those may command them."""
    ports = {"modbus": at.modbus, "opcua": at.opcua, "zenoh": at.zenoh}
    clients = {
        protocol: Client(
            "writer", (protocol, ports[protocol], node, writes, folder / f"{protocol}.json"), "there"
        )
        for node, protocol in enumerate(PROTOCOLS, 1)
    }
    if load == FRONT:
        clients[FRONT] = Client("worst_opcua", (at.opcua,), "browsed")
    return clients


def measure(name: str, load: str, round_number: int, writes: int) -> Writes:
    """One run of one bridge."""
    with tempfile.TemporaryDirectory(prefix="write-to-rpdo-") as made:
        folder = Path(made)
        traffic = Traffic(PDOS_PER_S[load], 100, _PLANT_S)
        with rig(name, traffic, folder, lambda at: _clients(at, load, writes, folder)) as all_of_it:
            all_of_it.plant.signal(signal.SIGUSR1)
            writers = [all_of_it.clients[protocol] for protocol in PROTOCOLS]
            for writer in writers:
                writer.signal(signal.SIGUSR1)
            with contextlib.suppress(TimeoutError):
                for writer in writers:
                    all_of_it.wait(writer, "ended", _PLANT_S)
            for writer in writers:
                writer.stop()
        setpoints = json.loads((folder / "plant.json").read_text(encoding="utf-8"))["setpoints"]
        delays: dict[str, Delays] = {}
        unwritten: dict[str, int] = {}
        for node, protocol in enumerate(PROTOCOLS, 1):
            sent = json.loads((folder / f"{protocol}.json").read_text(encoding="utf-8"))
            # What comes after the last write is the bridge's own: its clients have gone.
            seen = [(at, value) for at, value in setpoints[str(node)] if value]
            delays[protocol] = summary([sent], {1: seen})
            unwritten[protocol] = 1 + writes - len(sent)
    return Writes(name, load, round_number, delays, unwritten)


def measure_all(loads: Sequence[str], bridges: Sequence[str], rounds: int, writes: int) -> list[Writes]:
    """Each load on all bridges, one directly after the other, in an order that rotates."""
    runs: list[Writes] = []
    for round_number in range(rounds):
        for place, load in enumerate(loads):
            first = (round_number + place) % len(bridges)
            for name in (*bridges[first:], *bridges[:first]):
                runs.append(measure(name, load, round_number, writes))
                print(runs[-1].line, flush=True)
    return runs


def table(runs: Sequence[Writes]) -> str:
    """Medians over the rounds, as Markdown."""
    lines = ["| load | bridge | " + " | ".join(f"{one}: p50 / p99 / max ms" for one in PROTOCOLS) + " |"]
    lines.append("| --- " * (2 + len(PROTOCOLS)) + "|")
    for load, bridge in dict.fromkeys((run.load, run.bridge) for run in runs):
        found = [run for run in runs if (run.load, run.bridge) == (load, bridge)]
        cells = [_medians(found, protocol) for protocol in PROTOCOLS]
        lines.append(f"| {load} | {bridge} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def _medians(runs: Sequence[Writes], protocol: str) -> str:
    shown: list[str] = []
    found = [run.delays[protocol] for run in runs]
    for figures in zip(*((one.p50_ms, one.p99_ms, one.max_ms) for one in found), strict=True):
        known = [figure for figure in figures if figure is not None]
        shown.append(f"{statistics.median(known):.1f}" if len(known) == len(figures) else "–")
    unwritten = sum(run.unwritten[protocol] for run in runs)
    return " / ".join(shown) + _missing(sum(one.unseen for one in found), unwritten)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--writes", type=int, default=300)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--bridges", type=lambda text: text.split(","), default=list(BRIDGES))
    parser.add_argument("--loads", type=lambda text: text.split(","), default=list(PDOS_PER_S))
    parser.add_argument("--json", type=Path)
    given = parser.parse_args()
    runs = measure_all(given.loads, given.bridges, given.rounds, given.writes)
    print(table(runs))
    if given.json:
        told = {"machine": machine(), "runs": [dataclasses.asdict(run) for run in runs]}
        given.json.write_text(json.dumps(told, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
