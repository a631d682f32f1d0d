"""A plant of which zenoh controls fu3 and nobody fu4; fu1 belongs to Modbus."""

from __future__ import annotations

import time
import tomllib
from functools import cache

from bridge.command import Drive, Plant
from bridge.command.link import NodeState
from bridge.config import Site
from bridge.mapping import load_family

FAMILY = "nord/sk-tu4-cao"
SITE = """
site.name = "demo"
[[bus]]
name = "can0"
interface = "virtual"
[[bus.node]]
name = "conveyor"
id = 5
mapping = "nord/sk-tu4-cao"
[[bus.node.drive]]
slot = "fu1"
control = "modbus"
fieldbus_timeout_ms = 1000
parameters = { P105 = 50.0, P112 = 10.0 }
[[bus.node.drive]]
slot = "fu3"
control = "zenoh"
fieldbus_timeout_ms = 1000
parameters = { P105 = 50.0, P112 = 10.0 }
[[bus.node.drive]]
slot = "fu4"
control = "lease"
fieldbus_timeout_ms = 0
[modbus]
[zenoh]
"""

SWITCH_ON_INHIBITED, READY, ENABLED = 0x0240, 0x0231, 0x0237

_family = cache(load_family)


def make_plant(node: str = "conveyor") -> Plant:
    site = Site.model_validate(tomllib.loads(SITE.replace('"conveyor"', f'"{node}"')))
    return Plant(site, {FAMILY: _family(FAMILY)}, "1.2.3")


def epoch(monotonic: float) -> int:
    """ns since 1970 of a time of this process's monotonic clock."""
    return time.time_ns() + round((monotonic - time.monotonic()) * 1e9)


def node_is(plant: Plant, state: NodeState) -> None:
    node = next(iter(plant.nodes.values()))
    plant.on_node(node, state, time.monotonic())


def drive_says(drive: Drive, *words: int) -> None:
    """A TPDO with these words, the status word first."""
    drive.on_process_data([*words, 0, 0, 0][:4], time.monotonic())
