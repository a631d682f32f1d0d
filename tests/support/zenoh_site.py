"""A plant of which zenoh controls fu3 and nobody fu4; fu1 belongs to Modbus."""

from __future__ import annotations

import time

from bridge.command import Drive, Plant
from bridge.command.drive_link import NodeState
from tests.support import sites
from tests.support.node_states import node_goes

SWITCH_ON_INHIBITED, READY, ENABLED = 0x0240, 0x0231, 0x0237


def make_plant(node: str = "conveyor", further: int = 0) -> Plant:
    """``further``: nodes with four drives each that are there besides."""
    drives = (
        sites.drive("fu1", "modbus", 1000),
        sites.drive("fu3", "zenoh", 1000),
        sites.drive("fu4", "lease", 0, ""),
    )
    idle = [sites.drive(f"fu{i}", "none", 0) for i in range(1, 5)]
    others = [sites.node(*idle, name=f"more{i}", node_id=20 + i) for i in range(further)]
    bus = sites.bus(sites.node(*drives, name=node), *others)
    return sites.plant_of(sites.site(bus, sites.modbus(), sites.zenoh(), name="demo"))


def epoch(monotonic: float) -> int:
    """ns since 1970 of a time of this process's monotonic clock."""
    return time.time_ns() + round((monotonic - time.monotonic()) * 1e9)


def node_is(plant: Plant, state: NodeState) -> None:
    node = next(iter(plant.nodes.values()))
    node_goes(plant, node, state, time.monotonic())


def drive_says(drive: Drive, *words: int) -> None:
    """A TPDO with these words, the status word first."""
    drive.on_process_data([*words, 0, 0, 0][:4], time.monotonic())
