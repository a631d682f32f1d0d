"""Expedited SDO reads per second: ours beside canopen's blocking client, against one slave process, over a
pair of sockets; and what it brings that reads from several nodes overlap."""

from __future__ import annotations

import asyncio
import statistics
import time
from collections.abc import Callable
from pathlib import Path

import canopen

from tests.bench.figures import show
from tests.bench.pair import PairBus, PairCan, named, wire
from tests.bench.sdo_reader import ANSWER, Reader
from tests.support.process import peer

NODE = 5
NODES = (5, 6, 7)
READS = 2000
ROUNDS = 9


def canopens(network: canopen.Network, reads: int) -> None:
    sdo = network[NODE].sdo
    for _ in range(reads):
        assert sdo.upload(0x2000, 1) == ANSWER


class Figures:
    """Elapsed time and CPU of the process for each read, in µs, of some rounds."""

    def __init__(self) -> None:
        self.elapsed: list[float] = []
        self.cpu: list[float] = []

    def measure(self, work: Callable[[], object]) -> None:
        cpu, elapsed = time.process_time(), time.perf_counter()
        work()
        self.cpu.append((time.process_time() - cpu) * 1e6 / READS)
        self.elapsed.append((time.perf_counter() - elapsed) * 1e6 / READS)

    def __str__(self) -> str:
        return f"{statistics.median(self.elapsed):6.1f} µs   {statistics.median(self.cpu):6.1f} µs of CPU"


def ratio(dividends: list[float], divisors: list[float]) -> float:
    """Median of the rounds' ratios."""
    return statistics.median(a / b for a, b in zip(dividends, divisors, strict=True))


def test_expedited_reads(tmp_path: Path) -> None:
    ours, several, theirs = Figures(), Figures(), Figures()
    with (
        wire() as (near, far),
        peer(tmp_path, "sdo_slave", named(far), *map(str, NODES), files=[far.fileno()]) as slave,
    ):
        slave.wait_output("is there")
        for _ in range(ROUNDS):
            ours.measure(lambda: asyncio.run(Reader(PairBus(near), [NODE], READS).run()))
            reader = Reader(PairBus(near), NODES, READS)
            several.measure(lambda reader=reader: asyncio.run(reader.run()))
            assert reader.most_at_once == len(NODES)
            network = canopen.Network(PairCan(near))
            network.connect()
            network.add_node(NODE, canopen.ObjectDictionary())
            theirs.measure(lambda network=network: canopens(network, READS))
            network.disconnect()
    show("an expedited SDO read, ours", str(ours))
    show("  canopen's blocking client", str(theirs))
    show(
        "  canopen's : ours",
        f"{ratio(theirs.elapsed, ours.elapsed):6.2f}      {ratio(theirs.cpu, ours.cpu):6.2f} by CPU",
    )
    show("  from three nodes side by side", str(several))
