"""How long the bridge takes to start, and what it takes, by the number of nodes and points.

Nodes are simulated in the bus process: its CPU is theirs, too. The front's is its own.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.bench.figures import record, show
from tests.bench.processes import Usage, children, usage
from tests.support import sites
from tests.support.process import Process, drivebridge, drivebridge_called, free_port

LIMIT_S = 60.0
BUS = "bitrate = 1000000\nsync_period_ms = 50\nrpdo_period_ms = 100\ndeadman_ms = 300\nmaster_node_id = 127"
SITES = {
    "1 node": (1, 1, "cia402/velocity"),
    "8 nodes": (8, 1, "cia402/velocity"),
    "32 nodes": (32, 1, "cia402/velocity"),
    "126 nodes": (126, 1, "cia402/velocity"),
    "61 nodes, 244 drives": (61, 4, "nord/sk-tu4-cao"),
}
"""Nodes, drives of each, and their mapping."""
FRONT = "61 nodes, 244 drives"


@dataclass(frozen=True, slots=True)
class Start:
    operational_s: float
    opcua_s: float
    points: int
    bus: Usage
    front: Usage


def site(folder: Path, nodes: int, drives: int, mapping: str) -> Path:
    slots = [f"fu{number}" for number in range(1, drives + 1)] if drives > 1 else ["drive"]
    scaled = sites.SCALED if mapping == sites.FAMILY else ""
    tables = [
        sites.node(
            *(sites.drive(slot, "opcua", 1000, scaled) for slot in slots),
            name=f"n{number}",
            node_id=number,
            mapping=mapping,
        )
        for number in range(1, nodes + 1)
    ]
    return sites.write(folder, sites.bus(*tables, more=BUS), sites.opcua(free_port()))


def started(folder: Path, nodes: int, drives: int, mapping: str) -> Start:
    folder.mkdir()
    path = site(folder, nodes, drives, mapping)
    points = drivebridge_called("export", "opcua", str(path)).stdout.count("\n") - 1
    begin = time.monotonic()
    with drivebridge(folder, "run", "run", str(path)) as process:
        operational_s = _said(process, "node operational", nodes) - begin
        opcua_s = _said(process, "OPC UA on", 1) - begin
        # Beside it there may be a fork of the recorder for a moment.
        front = max(children(process.pid), key=lambda child: usage(child).memory_mb)
        of_front, of_all = usage(front), usage(process.pid)
    bus = Usage(1, of_all.cpu_s - of_front.cpu_s, of_all.memory_mb - of_front.memory_mb)
    return Start(operational_s, opcua_s, points, bus, of_front)


def _said(process: Process, words: str, times: int) -> float:
    """When it has said so as often."""
    end = time.monotonic() + LIMIT_S
    while process.output().count(words) < times:
        assert process.popen.poll() is None, process.output()
        assert time.monotonic() < end, process.output()[-2000:]
        time.sleep(0.02)
    return time.monotonic()


@pytest.mark.timeout(300)
def test_start(tmp_path: Path) -> None:
    for place, (name, (nodes, drives, mapping)) in enumerate(SITES.items()):
        found = started(tmp_path / str(place), nodes, drives, mapping)
        show(
            f"start of {name}, {found.points} points",
            f"operational {found.operational_s:.1f} s, OPC UA {found.opcua_s:.1f} s   "
            f"bus process {found.bus.cpu_s:.1f} s CPU, {found.bus.memory_mb:.0f} MB   "
            f"front {found.front.cpu_s:.1f} s CPU, {found.front.memory_mb:.0f} MB",
        )
        if nodes == 126:
            record("126 nodes operational, s", found.operational_s)
        if name == FRONT:
            record("front with 244 drives, MB", found.front.memory_mb)
            record("front with 244 drives, s of CPU", found.front.cpu_s)
