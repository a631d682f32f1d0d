"""Expedited SDO reads per second on real SocketCAN: ours beside canopen's, against one slave process."""

from __future__ import annotations

import asyncio
import statistics
import time
from pathlib import Path

import canopen

from bridge.can.socketcan import SocketCanBus
from tests.bench.figures import show
from tests.bench.sdo_reader import ANSWER, Reader
from tests.support.process import peer

NODE = 5
NODES = (5, 6, 7)
READS = 1000
ROUNDS = 5


def ours(*node_ids: int) -> float:
    """Reads per second."""
    reader = Reader(SocketCanBus("can0", "vcan0"), node_ids, READS)
    speed = asyncio.run(reader.run())
    assert reader.most_at_once == len(node_ids)
    return speed


def theirs() -> float:
    network = canopen.Network()
    network.connect(interface="socketcan", channel="vcan0")
    try:
        node = network.add_node(NODE, canopen.ObjectDictionary())
        begin = time.monotonic()
        for _ in range(READS):
            assert node.sdo.upload(0x2000, 1) == ANSWER
        return READS / (time.monotonic() - begin)
    finally:
        network.disconnect()


def test_expedited_reads(tmp_path: Path) -> None:
    with peer(tmp_path, "sdo_slave", "vcan0", *map(str, NODES)) as slave:
        slave.wait_output("is there")
        rounds = [(ours(NODE), theirs(), ours(*NODES)) for _ in range(ROUNDS)]
    our, their, several = (statistics.median(column) for column in zip(*rounds, strict=True))
    ratio = statistics.median(a / b for a, b, _ in rounds)
    show("expedited reads per second, ours", f"{our:6.0f}")
    show("expedited reads per second, canopen's blocking client", f"{their:6.0f}")
    show("ours : canopen's", f"{ratio:6.2f}")
    show("three nodes side by side : one node", f"{several / our:6.2f}")
    assert ratio >= 2
