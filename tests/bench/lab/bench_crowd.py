"""127 nodes with 100 ms heartbeats and 1 ms SYNC on real SocketCAN: SYNC and RPDOs come from the kernel.

In a user-mode kernel on a busy machine the nodes themselves stand still for longer than a heartbeat may
be late; so it is only shown what came of it."""

from __future__ import annotations

from pathlib import Path

from bridge.can.socketcan import SocketCanBus
from tests.bench.crowd import KEYS, NODES, crowd, measure


async def test_127_nodes_in_real_time(tmp_path: Path) -> None:
    bus = SocketCanBus("can0", "vcan0")
    await measure(crowd(tmp_path, NODES, bus, "vcan0", KEYS))
    assert bus.status.frames_lost == 0, "dropped by our socket"
