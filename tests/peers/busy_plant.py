"""drivebridge with its fronts and a plant in which 500 values change five times a second, six twenty times.

busy_plant.py SITE
Nothing is on the buses of SITE, which are virtual: the values are put where those from the bus would be. What
drive 1 has for a frequency is the time at which it came, in ms modulo 100,000, a tenth of that as Hz.
"""

from __future__ import annotations

import asyncio
import math
import sys
import time
from pathlib import Path

from bridge.base import clock
from bridge.can.virtual import VirtualWire
from bridge.cli import logs
from bridge.command import Plant
from bridge.image import DataType
from bridge.northbound.page.site_description import layout_of
from bridge.northbound.page.topics import topics_of
from bridge.project import load_project
from bridge.service.bus_process import BusProcess

LIVE = 500
SLOW_HZ, FAST_HZ = 5, 20
OPERATIONAL = 2


def put(plant: Plant, name: str, value: float | int | str) -> None:
    plant.set(name, value, clock.now())


async def slow(plant: Plant, names: list[str]) -> None:
    tick = 0
    while True:
        for place, name in enumerate(names):
            put(plant, name, round(40 + 30 * math.sin(tick / 10 + place), 2))
        for node in plant.nodes:
            put(plant, f"{node}/node/state", OPERATIONAL)
        tick += 1
        await asyncio.sleep(1 / SLOW_HZ)


async def fast(plant: Plant, names: list[str]) -> None:
    tick = 0
    while True:
        stamp, *others = names
        put(plant, stamp, (round(time.time() * 1000) % 100_000) / 10)
        for place, name in enumerate(others):
            put(plant, name, round(20 + 10 * math.sin(tick / 20 + place), 2))
        tick += 1
        await asyncio.sleep(1 / FAST_HZ)


async def main(path: Path) -> None:
    project = load_project(path)
    service = BusProcess(project, lambda table: VirtualWire().end(table.name))
    plant = service.plant
    points = plant.image.points
    layout = layout_of(plant.image.points, plant.catalogue)
    shown = [points[place] for place in topics_of(points, layout)["plant"]]
    first = next(iter(layout.drives))
    own = [one.name for one in points if one.name.startswith(f"{first}/") and one.data_type is DataType.FLOAT]
    stamp = f"{first}/actual/frequency"
    followed = [stamp, *(name for name in own if name != stamp and "/parameter/" not in name)][:6]
    live = [one.name for one in shown if one.data_type is DataType.FLOAT and one.name not in followed][:LIVE]
    assert len(live) == LIVE, len(live)
    print("follow", *followed, flush=True)
    async with asyncio.TaskGroup() as tasks:
        tasks.create_task(slow(plant, live))
        tasks.create_task(fast(plant, followed))
        await service.run()


logs.set_up(verbose=False)
asyncio.run(main(Path(sys.argv[1])))
