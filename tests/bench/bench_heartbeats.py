"""127 nodes with 100 ms heartbeats on one bus: what a heartbeat costs, and what a round of the master."""

from __future__ import annotations

from pathlib import Path

from bridge.canopen.frame import Frame
from bridge.command.drive_link import NodeState
from tests.bench.figures import cpu_us, show
from tests.support.node_states import run_timers
from tests.support.quick import Quick, quick_site

NODES = 127
PERIOD_S = 0.1
ROUNDS = 50


def test_127_nodes_with_100_ms_heartbeats(tmp_path: Path) -> None:
    site = quick_site(tmp_path, NODES, bus="heartbeat_ms = 0", common="supervision_ms = 300")
    quick = Quick(site)
    quick.run(5.0)
    assert all(node.state is NodeState.OPERATIONAL for node in quick.network.nodes)
    network, plant, per_s = quick.network, quick.plant, NODES / PERIOD_S
    step_s = PERIOD_S / NODES

    def heartbeats(one_round: bool) -> None:
        """Each node's heartbeat in turn, ``ROUNDS`` times; with the rest of a round, or alone."""
        now = quick.now
        for _ in range(ROUNDS):
            for node_id in range(1, NODES + 1):
                now += step_s
                network.on_frames([Frame(0x700 + node_id, b"\x05", now)], now)
                if one_round:
                    run_timers(plant, now)
                    network.on_time(now)
                    network.take_routes()
                    network.take_frames()
                    quick.repeated.repetitions()
                    network.next_deadline()
                    plant.next_deadline(now)
        quick.now = now

    alone = cpu_us(lambda: heartbeats(False), ROUNDS * NODES, rounds=3)
    network.on_time(quick.now)
    whole = cpu_us(lambda: heartbeats(True), ROUNDS * NODES, rounds=3)
    assert all(node.state is NodeState.OPERATIONAL for node in network.nodes)
    show("127 nodes: a heartbeat, from frame to supervision", f"{alone:6.2f} µs of CPU")
    show("  with a whole round of the master for each", f"{whole:6.2f} µs of CPU")
    show("  127 heartbeats every 100 ms, one round each", f"{whole * per_s / 1e4:6.1f} % of a CPU")
