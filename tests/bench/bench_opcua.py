"""Changed values by OPC UA: what one costs our server, asyncua's and open62541, in the same run."""

from __future__ import annotations

import contextlib
import json
import statistics
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.bench.figures import record, show
from tests.bench.processes import usage

REPOSITORY = Path(__file__).parents[2]
WATCH = REPOSITORY / "tests" / "wire" / "node" / "watch.mjs"
PREFIX = {"ours": "line/drive/actual/value_", "asyncua": "value_", "open62541": "value_"}
SETTLED_S = 2.0
MEASURED_S = 6.0
ROUNDS = 3


@dataclass(frozen=True, slots=True)
class Told:
    """Changes that the clients were told in a second, and CPU of the server for each."""

    per_s: float
    cpu_us: float


class Watcher:
    """node-opcua with ``count`` items."""

    def __init__(self, url: str, namespace: str, prefix: str, count: int, interval_ms: int) -> None:
        self._process = subprocess.Popen(
            ["node", str(WATCH), url, namespace, prefix, "0", str(count), str(interval_ms)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        assert self._line()["watching"] == count

    def _line(self) -> dict[str, int]:
        assert self._process.stdout
        # node-opcua warns on its output, too.
        said = next(line for line in self._process.stdout if line.startswith("{"))
        return json.loads(said)

    def changes(self) -> int:
        assert self._process.stdin
        self._process.stdin.write("\n")
        self._process.stdin.flush()
        return self._line()["changes"]

    def close(self) -> None:
        self._process.kill()
        self._process.communicate()


@contextlib.contextmanager
def serving(kind: str, count: int, hz: float) -> Iterator[tuple[int, str, str]]:
    """Process, URL and namespace of a server whose values change."""
    command = [sys.executable, "-m", "tests.bench.opcua_values", kind, str(count), str(hz)]
    with subprocess.Popen(command, cwd=REPOSITORY, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout
            # open62541 of o6 has a banner.
            said = next(line for line in process.stdout if line.startswith("serving "))
            _, url, namespace = said.split()
            yield process.pid, url, namespace
        finally:
            process.kill()


def measure(kind: str, count: int, hz: float, clients: int = 1) -> Told:
    with serving(kind, count, hz) as (pid, url, namespace), contextlib.ExitStack() as stack:
        watchers = [Watcher(url, namespace, PREFIX[kind], count, round(1000 / hz)) for _ in range(clients)]
        for watcher in watchers:
            stack.callback(watcher.close)
        time.sleep(SETTLED_S)
        before, begin = usage(pid), time.monotonic()
        at_first = sum(watcher.changes() for watcher in watchers)
        time.sleep(MEASURED_S)
        changes = sum(watcher.changes() for watcher in watchers) - at_first
        after, took_s = usage(pid), time.monotonic() - begin
    return Told(changes / took_s, 1e6 * (after.cpu_s - before.cpu_s) / changes)


def rates(found: Sequence[Told], beside: Sequence[Told]) -> list[float]:
    """How many times as many changes for a CPU second, round by round."""
    return [other.cpu_us / one.cpu_us for one, other in zip(found, beside, strict=True)]


def spread(numbers: Sequence[float]) -> str:
    return f"{statistics.median(numbers):.2f} ({min(numbers):.2f} to {max(numbers):.2f})"


@pytest.mark.timeout(600)
def test_2000_values_at_10_hz() -> None:
    found: dict[str, list[Told]] = {kind: [] for kind in PREFIX}
    for _ in range(ROUNDS):
        for kind, rounds in found.items():
            rounds.append(measure(kind, 2000, 10))
    for kind, rounds in found.items():
        per_s = statistics.median(one.per_s for one in rounds)
        show(
            f"2,000 values at 10 Hz to node-opcua, {kind}: CPU for each",
            f"{spread([one.cpu_us for one in rounds])} µs, {per_s:.0f} told in a second",
        )
    times = rates(found["ours"], found["asyncua"])
    record("opcua: changes per CPU second, times asyncua's", statistics.median(times))
    show("  changes per CPU second, times asyncua's", spread(times))
    show("  changes per CPU second, times open62541's", spread(rates(found["ours"], found["open62541"])))


@pytest.mark.timeout(120)
def test_5000_values_at_2_hz_to_five_clients() -> None:
    told = measure("ours", 5000, 2, clients=5)
    whole = 5000 * 2 * 5
    record("opcua: 5,000 values at 2 Hz to five clients, % told", 100 * told.per_s / whole)
    show(
        "5,000 values at 2 Hz to five node-opcua clients: told",
        f"{told.per_s:.0f} of {whole} in a second, {told.cpu_us:.1f} µs each",
    )
