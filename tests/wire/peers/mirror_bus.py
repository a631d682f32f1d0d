"""A bus process with no bus: a plant whose values go up and down by themselves, shown to fronts.

Usage: mirror_bus.py ENDPOINT [NODE]. Prints "ready" and runs until it is killed.
"""

from __future__ import annotations

import asyncio
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[3]))

from bridge.command.drive_link import NodeState
from bridge.mirror import MirrorPublisher
from tests.support.views import view_of
from tests.support.zenoh_site import ENABLED, drive_says, epoch, make_plant, node_is


async def main() -> None:
    endpoint, *node = sys.argv[1:]
    plant = make_plant(*node)
    publisher = MirrorPublisher(view_of(plant, epoch_ns=epoch), endpoint, time.monotonic)
    await publisher.start()
    node_is(plant, NodeState.OPERATIONAL)
    print("ready", flush=True)
    value = 0
    while True:
        value = (value + 1) % 0x1000
        for drive in plant.drives.values():
            drive_says(drive, ENABLED, value)
        await asyncio.sleep(0.02)


asyncio.run(main())
