"""What a full bus costs: 126 nodes, SYNC every millisecond, heartbeats every 100 ms."""

from __future__ import annotations

import time
from pathlib import Path

from bridge.canopen.frame import Frame
from bridge.config import Site, load_site
from tests.bench.figures import show
from tests.support.bench import Bench
from tests.support.quick import QuickNode

NODES = 126
"""With the bridge itself there are 127."""
BOOT_S = 0.6
MEASURED_S = 1.0
STEP_S = 0.0008  # one heartbeat of 126 nodes every 100 ms, and as many TPDOs

BUS = """
[site]
name = "many"
[[bus]]
name = "can0"
interface = "virtual"
bitrate = 1000000
sync_period_ms = 1
rpdo_period_ms = 20
"""
NODE = """
[[bus.node]]
name = "node{n}"
id = {n}
mapping = "nord/sk-tu4-cao"
supervision_ms = 300
[[bus.node.drive]]
slot = "fu1"
parameters = {{ P105 = 50.0, P112 = 10.0 }}
"""


def site(folder: Path, nodes: int) -> Site:
    path = folder / "site.toml"
    path.write_text(BUS + "".join(NODE.format(n=n) for n in range(1, nodes + 1)), encoding="utf-8")
    return load_site(path)


class Crowd:
    """A bench with so many nodes; they are simulated while they boot, and only replayed afterwards."""

    def __init__(self, folder: Path, nodes: int) -> None:
        self.bench = Bench(site(folder, nodes), present=False)
        self.numbers = range(1, nodes + 1)
        self._nodes = {n: QuickNode(n) for n in self.numbers}
        self.rounds, self.spent_s = 0, 0.0

    def boot(self) -> None:
        bench = self.bench
        for node in self._nodes.values():
            node.start(bench.now)
        end, told = bench.now + BOOT_S, 0
        while bench.now < end:
            bench.now = round(bench.now + 0.001, 6)
            for node in self._nodes.values():
                node.on_time(bench.now)
            for _ in range(40):  # question and answer take no time here
                for node in self._nodes.values():
                    said, node.outbox = node.outbox, []
                    bench.receive(*said)
                bench.master.pump()
                news, told = bench.log[told:], len(bench.log)
                if not sum(self._hand_over(frame) for frame in news):
                    break

    def _hand_over(self, frame: Frame) -> bool:
        """NMT and SDO requests to their nodes; PDOs and SYNC cost the simulation too much."""
        node_id = frame.data[1] if frame.can_id == 0 else frame.can_id & 0x7F
        if frame.can_id and frame.can_id & 0x780 != 0x600:
            return False
        for node in [self._nodes[node_id]] if node_id in self._nodes else self._nodes.values():
            node.on_frame(frame, self.bench.now)
        return True

    def replay(self) -> None:
        bench = self.bench
        for number in range(round(MEASURED_S / STEP_S)):
            bench.now += STEP_S
            node_id = number % NODES + 1
            bench.receive(
                Frame(0x180 + node_id, number.to_bytes(8, "little")), Frame(0x700 + node_id, b"\x05")
            )
            begin = time.process_time()
            bench.master.pump()
            self.spent_s += time.process_time() - begin
            self.rounds += 1


def test_127_nodes_with_heartbeats_and_sync_every_millisecond(tmp_path: Path) -> None:
    crowd = Crowd(tmp_path, NODES)
    crowd.boot()
    operational = sum(crowd.bench.value(f"node{n}/node/nmt_state") == 5 for n in range(1, NODES + 1))
    assert operational == NODES
    crowd.replay()
    lost = [event.message for event in crowd.bench.events if event.kind == "node_lost"]
    assert not lost
    show(
        "127 nodes, 1 ms SYNC, 100 ms heartbeats: a round",
        f"{crowd.spent_s / crowd.rounds * 1e6:6.0f} µs of CPU",
    )
    show("  share of one CPU", f"{100 * crowd.spent_s / MEASURED_S:6.0f} %")
