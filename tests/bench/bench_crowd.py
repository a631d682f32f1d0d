"""127 nodes with 100 ms heartbeats and 1 ms SYNC in real time: the master in this process, the nodes in
another, a pair of sockets between them. There is no broadcast manager: the process sends SYNC and RPDOs."""

from __future__ import annotations

from pathlib import Path

from tests.bench.crowd import KEYS, NODES, crowd, measure
from tests.bench.pair import PairBus, named, wire


async def test_127_nodes_in_real_time(tmp_path: Path) -> None:
    with wire() as (near, far):
        lost = await measure(crowd(tmp_path, NODES, PairBus(near), named(far), KEYS, [far.fileno()]))
    assert lost == (0, 0)
