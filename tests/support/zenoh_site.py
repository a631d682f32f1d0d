"""A plant of which zenoh controls fu3 and nobody fu4; fu1 belongs to Modbus."""

from __future__ import annotations

import time

from bridge.command import Drive, Plant
from bridge.command.link import NodeState
from tests.support import sites

SWITCH_ON_INHIBITED, READY, ENABLED = 0x0240, 0x0231, 0x0237


def make_plant(node: str = "conveyor") -> Plant:
    drives = (
        sites.drive("fu1", "modbus", 1000),
        sites.drive("fu3", "zenoh", 1000),
        sites.drive("fu4", "lease", 0, ""),
    )
    bus = sites.bus(sites.node(*drives, name=node))
    return sites.plant_of(sites.site(bus, sites.modbus(), sites.zenoh(), name="demo"))


def epoch(monotonic: float) -> int:
    """ns since 1970 of a time of this process's monotonic clock."""
    return time.time_ns() + round((monotonic - time.monotonic()) * 1e9)


def node_is(plant: Plant, state: NodeState) -> None:
    node = next(iter(plant.nodes.values()))
    plant.on_node(node, state, time.monotonic())


def drive_says(drive: Drive, *words: int) -> None:
    """A TPDO with these words, the status word first."""
    drive.on_process_data([*words, 0, 0, 0][:4], time.monotonic())
